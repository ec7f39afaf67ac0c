#include "gradients/parameter_gradient.hpp"

#include "elasticity/elements.hpp"
#include "model/drawn_frame.hpp"
#include "model/stencil_numbers.hpp"

namespace withe {
namespace {

/// By EI1, EI2, GJ of two edges.
using ByEdges = Dual<6>;

struct EdgeNumbers {
  ByEdges bend[2], twist;
};

/// In a plane the one bending stiffness stands in the first place.
EdgeNumbers edge_numbers(const Model& model, const Parameters& p, int edge, int first) {
  EdgeNumbers out{{ByEdges::unknown(p.edge_bend(edge, 0), first), ByEdges::unknown(p.edge_bend(edge, 1), first + 1)},
                  ByEdges::unknown(p.edge_twist(edge), first + 2)};
  if (model.planar()) {
    const Vector2 c = model.planar_components[at(model.edge_rod[at(edge)])];
    out.bend[0] = c(0) * c(0) * out.bend[0] + c(1) * c(1) * out.bend[1];
    out.bend[1] = ByEdges(0.0);
  }
  return out;
}

class Chain {
 public:
  Chain(const Model& model, const Parameters& parameters, const CoefficientAdjoint& by)
      : model_(model), p_(parameters), by_(by) {
    const Eigen::Index edges = model.edge_count;
    for (VectorX* v : {&out.edge_stretch, &out.edge_twist, &out.edge_density, &out.edge_rotary, &out.edge_viscous_time,
                       &out.edge_drag})
      v->setZero(edges);
    out.edge_bend = MatrixX2::Zero(edges, 2);
    out.added_mass.setZero(model.node_count);
    for (std::size_t r = 0; r < p_.natural_curvature.size(); ++r) {
      out.natural_curvature.push_back(by.natural_curvature[r]);
      out.natural_twist.push_back(VectorX::Zero(p_.natural_twist[r].size()));
      const int first = model.rod_first_edge[r], end = model.rod_first_edge[r + 1];
      out.natural_stretch.push_back(by.stretch_natural.segment(first, end - first));
      out.drawn_curvature.push_back(MatrixX2::Zero(p_.natural_curvature[r].rows(), 2));
      out.drawn_twist.push_back(VectorX::Zero(p_.natural_twist[r].size()));
    }
    out.rest_length = by.rest_length;
    out.edge_turn = by.edge_turn;
    components_ = by.planar_components;
    out.loads = by.loads;
    out.spring_stiffness = by.spring_stiffness;
    out.spring_rest_length = by.spring_rest_length;
    out.spring_damping = by.spring_damping;
    out.fluid_viscosity = by.fluid_viscosity;
    out.friction = by.friction;
    out.slip_tolerance = by.slip_tolerance;
    out.obstacle_friction = by.obstacle_friction;
    out.pair_friction = by.pair_friction;
    out.hand_stiffness = by.hand_stiffness;
    out.hand_limit = by.hand_limit;
    add_masses();
    add_stiffnesses();
    add_natural();
    add_offsets();
    add_attachments();
    add_components();
  }

  ParameterGradient out;

 private:
  void add_masses() {
    VectorX by_mass(model_.node_count), by_drag(model_.node_count);
    for (int i = 0; i < model_.node_count; ++i) {
      const int dof = model_.node_dof[at(i)], n = model_.dimension;
      Vector3 force = Vector3::Zero();
      if (model_.planar())
        force = by_.gravity(dof) * model_.plane->first + by_.gravity(dof + 1) * model_.plane->second;
      else
        force = by_.gravity.segment<3>(dof);
      out.gravity += p_.node_mass(i) * force;
      by_mass(i) = by_.mass.segment(dof, n).sum() + p_.gravity.dot(force);
      by_drag(i) = by_.drag.segment(dof, n).sum();
    }
    out.added_mass = by_mass;
    VectorX by_inertia = VectorX::Zero(model_.edge_count);
    for (int e = 0; e < model_.edge_count; ++e) {
      const double arc = model_.edge_arc(e);
      const int tail = model_.edge_tail[at(e)], head = model_.edge_head[at(e)];
      out.edge_density(e) = 0.5 * arc * (by_mass(tail) + by_mass(head));
      out.edge_drag(e) = 0.5 * arc * (by_drag(tail) + by_drag(head));
      if (!p_.lumped && !model_.edge_lumped[at(e)] && !(p_.held_lumped && model_.edge_held[at(e)])) {
        out.edge_density(e) += arc / 6.0 * by_.mass_coupling(e);
        out.edge_drag(e) += arc / 6.0 * by_.drag_coupling(e);
      }
      out.rest_length(e) += (out.edge_density(e) * p_.edge_density(e) + out.edge_drag(e) * p_.edge_drag(e)) / arc;
      if (!model_.planar()) by_inertia(e) = by_.mass(model_.edge_dof[at(e)]);
    }
    for (const FrameStencil& s : model_.half) {
      by_inertia(s.edge) += 0.5 * by_.mass.segment(model_.frame_dof[at(s.frame)], model_.frame_size()).sum();
      if (s.hinge >= 0) by_inertia(s.edge) += 0.5 * by_.mass(model_.hinges[at(s.hinge)].dof);
    }
    out.edge_rotary = by_inertia.cwiseProduct(model_.edge_arc);
    out.edge_density += by_.edge_mass.cwiseProduct(model_.edge_arc);
    out.rest_length += by_inertia.cwiseProduct(p_.edge_rotary) + by_.edge_mass.cwiseProduct(p_.edge_density);
    if (by_.gravity_size != 0.0) out.gravity += by_.gravity_size * p_.gravity.normalized();
  }

  void add_edge(int edge, const double* slope) {
    out.edge_bend(edge, 0) += slope[0];
    out.edge_bend(edge, 1) += slope[1];
    out.edge_twist(edge) += slope[2];
  }

  static ByEdges twist_stiffness(const ByEdges& twist, const ByEdges& bend1, const ByEdges& bend2,
                                 const ArcOfStencil& arc) {
    if (!arc.turns || value_of(twist) == 0.0 || value_of(bend1) <= 0.0 || value_of(bend2) <= 0.0) return twist;
    return twist_of_arc(twist, bend1, bend2, arc.square_of_turn, arc.share);
  }

  /// Minus how the stiffness of a stencil changes with the length of one of its edges, of which it carries a share.
  static double by_length(const ByEdges& stiffness, const ByEdges& of_edge, double share) {
    return of_edge.value == 0.0 ? 0.0 : stiffness.value * stiffness.value * share / of_edge.value;
  }

  void add_stiffnesses() {
    out.edge_stretch = by_.stretch_stiffness;
    out.edge_viscous_time = by_.stretch_time;
    for (Eigen::Index i = 0; i < by_.bend_stiffness.rows(); ++i) {
      const int a = model_.bend[static_cast<std::size_t>(i)].edge[0],
                b = model_.bend[static_cast<std::size_t>(i)].edge[1];
      const double la = model_.edge_arc(a), lb = model_.edge_arc(b);
      const double va = model_.bend_share(i, 0) * la, vb = model_.bend_share(i, 1) * lb;
      const EdgeNumbers of_a = edge_numbers(model_, p_, a, 0), of_b = edge_numbers(model_, p_, b, 3);
      const auto together = [](double v0, const ByEdges& k0, double v1, const ByEdges& k1) {
        return in_series(flexibility(v0, k0), flexibility(v1, k1));
      };
      const ByEdges bend1 = together(va, of_a.bend[0], vb, of_b.bend[0]),
                    bend2 = together(va, of_a.bend[1], vb, of_b.bend[1]),
                    twist = twist_stiffness(together(0.5 * la, of_a.twist, 0.5 * lb, of_b.twist), bend1, bend2,
                                            arc_of_bend(model_, i));
      const ByEdges sum =
          by_.bend_stiffness(i, 0) * bend1 + by_.bend_stiffness(i, 1) * bend2 + by_.bend_stiffness(i, 2) * twist;
      add_edge(a, sum.slope);
      add_edge(b, sum.slope + 3);
      // V / K = V0 / K0 + V1 / K1.
      for (int end = 0; end < 2; ++end) {
        const EdgeNumbers& of = end == 0 ? of_a : of_b;
        out.rest_length(end == 0 ? a : b) -=
            by_.bend_stiffness(i, 0) * by_length(bend1, of.bend[0], model_.bend_share(i, end)) +
            by_.bend_stiffness(i, 1) * by_length(bend2, of.bend[1], model_.bend_share(i, end)) +
            by_.bend_stiffness(i, 2) * by_length(twist, of.twist, 0.5);
      }
      const double both = la + lb;
      out.edge_viscous_time(a) += by_.bend_time(i) * la / both;
      out.edge_viscous_time(b) += by_.bend_time(i) * lb / both;
      for (int edge : {a, b})
        out.rest_length(edge) += by_.bend_time(i) * (p_.edge_viscous_time(edge) - p_.bend_viscous_time(i)) / both;
    }
    for (Eigen::Index i = 0; i < by_.half_stiffness.rows(); ++i) {
      const int e = model_.half[static_cast<std::size_t>(i)].edge;
      const EdgeNumbers of = edge_numbers(model_, p_, e, 0);
      const double inverse = 1.0 / (model_.half_share(i) * model_.edge_arc(e));
      const ByEdges bend1 = inverse * of.bend[0], bend2 = inverse * of.bend[1],
                    twist = twist_stiffness(of.twist / model_.half_voronoi(i), bend1, bend2, arc_of_half(model_, i));
      const ByEdges sum =
          by_.half_stiffness(i, 0) * bend1 + by_.half_stiffness(i, 1) * bend2 + by_.half_stiffness(i, 2) * twist;
      add_edge(e, sum.slope);
      out.rest_length(e) -= sum.value / model_.edge_arc(e);
      out.edge_viscous_time(e) += by_.half_time(i);
    }
  }

  /// What natural strains say of the curvature and twist that they are made of, and of the length.
  struct ByShape {
    Vector2 curvature;
    double twist, length;
    Vector2 components;  ///< of a plane: by `Model::planar_components`
  };
  ByShape by_shape(int rod, const Vector2& curvature, double twist, double voronoi, const Vector3& by) const {
    using Four = Dual<4>;
    // Curvatures and lengths enter by their products alone.
    const Four length = Four::unknown(voronoi, 3);
    const Vec3<Four> strain =
        natural_strain(p_.measure, Four::unknown(curvature(0), 0) * length, Four::unknown(curvature(1), 1) * length,
                       Four::unknown(twist, 2) * length, 1.0);
    Four sum(0.0);
    Vector2 components = Vector2::Zero();
    if (model_.planar()) {
      const Vector2& c = model_.planar_components[at(rod)];
      sum = by(0) * (c(0) * strain.x + c(1) * strain.y);
      components = by(0) * Vector2(strain.x.value, strain.y.value);
    } else {
      sum = by(0) * strain.x + by(1) * strain.y + by(2) * strain.z;
    }
    return {{sum.slope[0], sum.slope[1]}, sum.slope[2], sum.slope[3], components};
  }

  /// What a stencil's natural strains say of the natural shape that a rod has at one of its own.
  /// Returns what they say of its length.
  double add_shape(int rod, int stencil, double voronoi, const Vector3& by) {
    if (rod < 0 || stencil < 0) return 0.0;
    const auto r = static_cast<std::size_t>(rod);
    const ByShape found =
        by_shape(rod, p_.natural_curvature[r].row(stencil), p_.natural_twist[r](stencil), voronoi, by);
    out.natural_curvature[r].row(stencil) += found.curvature.transpose();
    out.natural_twist[r](stencil) += found.twist;
    if (model_.planar()) components_.row(rod) += found.components.transpose();
    return found.length;
  }

  /// Likewise of the natural shape as it was drawn.
  double add_drawn_shape(int rod, int stencil, double voronoi, const Vector3& by) {
    const RodDescription& drawn = model_.description.rods[at(rod)];
    const ByShape found =
        by_shape(rod, drawn.natural_curvature.row(stencil), drawn.natural_twist(stencil), voronoi, by);
    out.drawn_curvature[at(rod)].row(stencil) += found.curvature.transpose();
    out.drawn_twist[at(rod)](stencil) += found.twist;
    if (model_.planar()) components_.row(rod) += found.components.transpose();
    return found.length;
  }

  void add_natural() {
    for (std::size_t r = 0; r < model_.place.size(); ++r)
      for (std::size_t s = 0; s < model_.place[r].size(); ++s) {
        const int bend = model_.place[r][s].bend;
        if (bend < 0) continue;
        const double by_length = add_shape(static_cast<int>(r), static_cast<int>(s), model_.bend_voronoi(bend),
                                           by_.bend_natural.row(bend).transpose());
        for (int edge : model_.bend[at(bend)].edge) out.rest_length(edge) += 0.5 * by_length;
      }
    for (std::size_t h = 0; h < model_.half.size(); ++h) {
      const double by_length = add_shape(model_.half_owner[h].first, model_.half_owner[h].second,
                                         model_.half_voronoi(static_cast<Eigen::Index>(h)),
                                         by_.half_natural.row(static_cast<Eigen::Index>(h)).transpose());
      out.rest_length(model_.half[h].edge) += 0.5 * by_length;
    }
  }

  /// Across rods natural strains are those of the drawing, and on top what each rod's nearest natural strain, over its
  /// half of the length, is beyond the one that was drawn.
  void add_offsets() {
    if (model_.bend_across.empty()) return;
    const State drawn = initial_state(model_);
    Configuration c;
    compute_configuration(model_, drawn, drawn.q, c);
    for (int b : model_.bend_across) {
      const Vector3 by = by_.bend_natural.row(b);
      add_drawn_strains(b, c, by);
      if (model_.bend_owner[at(b)].second < -1) continue;
      for (int edge : model_.bend[at(b)].edge) {
        const int rod = model_.edge_rod[at(edge)];
        const int stencils = static_cast<int>(p_.natural_twist[at(rod)].size());
        if (stencils == 0) continue;
        const int nearest = edge == model_.rod_first_edge[at(rod)] ? 0 : stencils - 1;
        const double length = 0.5 * model_.edge_arc(edge);
        out.rest_length(edge) +=
            0.5 * (add_shape(rod, nearest, length, by) + add_drawn_shape(rod, nearest, length, -by));
      }
    }
  }

  void add_drawn_strains(int b, const Configuration& drawn, const Vector3& by) {
    StrainGradients strains;
    bend_gradients(model_, p_.measure, drawn, b, strains);
    const int nodes = model_.planar() ? 2 : 4;  // unknowns from one node to the next
    for (int end = 0; end < 2; ++end) {
      const int edge = model_.bend[at(b)].edge[end];
      const EdgeFrame<double>& f = drawn.edge[at(edge)];
      const double sign = model_.bend[at(b)].sign[end], length = 1.0 / f.inverse_length;
      for (int s = 0; s < strains.count; ++s) {
        // A turn w of an edge moves its vector e by w x e, and its directors by w . t.
        Vector3 by_edge = Vector3::Zero(), turn = by_edge;
        const double* at_end = strains.gradient[s] + (end == 0 ? 0 : 2 * nodes);
        for (int i = 0; i < model_.dimension; ++i) by_edge(i) = (end == 0 ? -sign : sign) * at_end[i];
        if (model_.planar()) {
          turn = length * (f.tangent.x * by_edge(1) - f.tangent.y * by_edge(0)) * model_.plane->normal;
        } else {
          const Vector3 t = to_eigen(f.tangent);
          turn = length * t.cross(by_edge) + strains.gradient[s][3 + 4 * end] * t;
        }
        out.edge_turn.row(edge) += by(s) * turn.transpose();
      }
    }
  }

  void add_attachments() {
    for (std::size_t h = 0; h < model_.half.size(); ++h) {
      const Vector3 by = by_.attachment.row(static_cast<Eigen::Index>(h));
      if (by.isZero(0.0)) continue;
      const FrameStencil& half = model_.half[h];
      const int r = model_.edge_rod[at(half.edge)], first = model_.rod_first_edge[at(r)];
      const RodDescription& rod = model_.description.rods[at(r)];
      const int node = (half.edge - first + (half.frame_first ? 0 : 1)) % static_cast<int>(rod.nodes.size());
      const FrameEdges edges = frame_edges(rod, first, node);
      const DrawnFrameSlopes slopes =
          drawn_frame_slopes(edges, drawn_edge_frame(model_, edges.before), drawn_edge_frame(model_, edges.after),
                             model_.edge_length(edges.before), model_.edge_length(edges.after));
      out.edge_turn.row(edges.before) += by.transpose() * slopes.before;
      out.edge_turn.row(edges.after) += by.transpose() * slopes.after;
      out.rest_length(edges.before) += by.dot(slopes.length0);
      out.rest_length(edges.after) += by.dot(slopes.length1);
    }
  }

  /// Components (d2 . n, -d1 . n) of a plane's normal, of a rod's first edge: they change as its directors turn about
  /// it.
  void add_components() {
    for (Eigen::Index r = 0; r < components_.rows(); ++r) {
      const Vector2& c = model_.planar_components[static_cast<std::size_t>(r)];
      const int edge = model_.rod_first_edge[static_cast<std::size_t>(r)];
      out.edge_turn.row(edge) +=
          (components_(r, 0) * c(1) - components_(r, 1) * c(0)) * drawn_edge_frame(model_, edge).col(2).transpose();
    }
  }

  const Model& model_;
  const Parameters& p_;
  const CoefficientAdjoint& by_;
  MatrixX2 components_;  ///< by `Model::planar_components`
};

}  // namespace

ParameterGradient parameter_gradient(const Model& model, const Parameters& parameters, const CoefficientAdjoint& by) {
  return Chain(model, parameters, by).out;
}

}  // namespace withe
