#include "gradients/parameter_gradient.hpp"

#include "elasticity/elements.hpp"
#include "model/drawn_frame.hpp"
#include "model/mass_matrix.hpp"
#include "model/stencil_numbers.hpp"

namespace withe {
namespace {

/// Share of an edge that a stencil has to either side: of its length as it bends and as it twists, once for each
/// stiffness.
struct EdgePart {
  int edge;
  Vector3 share, stiffness, length;

  EdgePart(const Model& model, const Parameters& p, int of, double bends, double twists)
      : edge(of),
        share(bends, bends, twists),
        stiffness(p.edge_twist(of) * Vector3::UnitZ()),
        length(model.edge_arc(of) * share) {
    stiffness.head<2>() = bend_of(model, p, of);
  }

  Vector3 flexibilities() const {
    return {flexibility(length(0), stiffness(0)), flexibility(length(1), stiffness(1)),
            flexibility(length(2), stiffness(2))};
  }
};

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
    static_cast<PartNumbers&>(out) = by;
    out.fluid_viscosity = by.fluid_viscosity;
    out.friction = by.friction;
    out.slip_tolerance = by.slip_tolerance;
    out.obstacle_friction = by.obstacle_friction;
    out.pair_friction = by.pair_friction;
    out.obstacle_rolling = by.obstacle_rolling;
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
      double by_share = by_.mass.segment(model_.frame_dof[at(s.frame)], model_.frame_size()).sum();
      if (!model_.planar()) by_share -= by_.mass(model_.edge_dof[at(s.edge)]);
      if (s.hinge >= 0) by_share += by_.mass(model_.hinges[at(s.hinge)].dof);
      by_inertia(s.edge) += kFrameShare * by_share;
    }
    out.edge_rotary = by_inertia.cwiseProduct(model_.edge_arc);
    out.edge_density += by_.edge_mass.cwiseProduct(model_.edge_arc);
    out.rest_length += by_inertia.cwiseProduct(p_.edge_rotary) + by_.edge_mass.cwiseProduct(p_.edge_density);
    if (by_.gravity_size != 0.0) out.gravity += by_.gravity_size * p_.gravity.normalized();
  }

  /// From derivatives by a stencil's stiffnesses to those by what they are without its arc.
  static void add_arc(const ArcOfStencil& arc, const Vector3& stiffness, Vector3& by) {
    if (!arc.turns || stiffness(0) <= 0.0 || stiffness(1) <= 0.0 || stiffness(2) == 0.0) return;
    using Three = Dual<3>;
    const Three twist = twist_of_arc(Three::unknown(stiffness(2), 2), Three::unknown(stiffness(0), 0),
                                     Three::unknown(stiffness(1), 1), arc.square_of_turn, arc.share);
    const double of_twist = by(2);
    by(2) = 0.0;
    for (int k = 0; k < 3; ++k) by(k) += of_twist * twist.slope[k];
  }

  /// Stiffnesses K = 1 / (V0 / K0 + V1 / K1) of a stencil follow those of an edge by K^2 V0 / K0^2.
  void add_part(const EdgePart& part, const Vector3& stiffness, const Vector3& by) {
    Vector3 by_edge = Vector3::Zero();
    for (int k = 0; k < 3; ++k) {
      const double of = part.stiffness(k);
      if (of == 0.0) continue;
      const double by_flexibility = -by(k) * stiffness(k) * stiffness(k);
      by_edge(k) = -by_flexibility * part.length(k) / (of * of);
      out.rest_length(part.edge) += by_flexibility * part.share(k) / of;
    }
    if (model_.planar()) {
      const Vector2& c = model_.planar_components[at(model_.edge_rod[at(part.edge)])];
      by_edge.head<2>() = by_edge(0) * c.cwiseAbs2();
    }
    out.edge_bend.row(part.edge) += by_edge.head<2>().transpose();
    out.edge_twist(part.edge) += by_edge(2);
  }

  void add_stiffnesses() {
    out.edge_stretch = by_.stretch_stiffness;
    out.edge_viscous_time = by_.stretch_time;
    for (Eigen::Index i = 0; i < by_.bend_stiffness.rows(); ++i) {
      const auto& edge = model_.bend[static_cast<std::size_t>(i)].edge;
      const EdgePart part[2] = {EdgePart(model_, p_, edge[0], model_.bend_share(i, 0), 0.5),
                                EdgePart(model_, p_, edge[1], model_.bend_share(i, 1), 0.5)};
      const Vector3 stiffness = (part[0].flexibilities() + part[1].flexibilities()).cwiseInverse();
      Vector3 by = by_.bend_stiffness.row(i).transpose();
      add_arc(arc_of_bend(model_, i), stiffness, by);
      const double both = model_.edge_arc(edge[0]) + model_.edge_arc(edge[1]);
      for (const EdgePart& each : part) {
        add_part(each, stiffness, by);
        out.edge_viscous_time(each.edge) += by_.bend_time(i) * model_.edge_arc(each.edge) / both;
        out.rest_length(each.edge) +=
            by_.bend_time(i) * (p_.edge_viscous_time(each.edge) - p_.bend_viscous_time(i)) / both;
      }
    }
    for (Eigen::Index i = 0; i < by_.half_stiffness.rows(); ++i) {
      const int e = model_.half[static_cast<std::size_t>(i)].edge;
      const EdgePart part(model_, p_, e, model_.half_share(i), model_.half_voronoi(i) / model_.edge_arc(e));
      const Vector3 stiffness = part.flexibilities().cwiseInverse();
      Vector3 by = by_.half_stiffness.row(i).transpose();
      add_arc(arc_of_half(model_, i), stiffness, by);
      add_part(part, stiffness, by);
      out.edge_viscous_time(e) += by_.half_time(i);
    }
  }

  /// Derivatives by the natural curvature and twist of a stencil, and by its length, from those by its natural strains.
  struct ByShape {
    Vector2 curvature;
    double twist, length;
    Vector2 components;  ///< of a plane: by `Model::planar_components`
  };
  ByShape by_shape(int rod, const Vector2& curvature, double twist, double voronoi, const Vector3& by) const {
    using Two = Dual<2>;
    // Curvatures, twist and lengths enter by their products alone, the twist by a factor.
    const double turn = twist * voronoi;
    const Vec3<Two> strain = natural_strain(p_.measure, Two::unknown(curvature(0) * voronoi, 0),
                                            Two::unknown(curvature(1) * voronoi, 1), Two(1.0), 1.0);
    Two sum(0.0);
    double by_turn = 0.0;
    Vector2 components = Vector2::Zero();
    if (model_.planar()) {
      const Vector2& c = model_.planar_components[at(rod)];
      sum = by(0) * (c(0) * strain.x + c(1) * strain.y);
      components = by(0) * Vector2(strain.x.value, strain.y.value);
    } else {
      sum = by(0) * strain.x + by(1) * strain.y + (by(2) * turn) * strain.z;
      by_turn = by(2) * strain.z.value;
    }
    const Vector2 by_bent(sum.slope[0], sum.slope[1]);
    return {voronoi * by_bent, voronoi * by_turn, curvature.dot(by_bent) + twist * by_turn, components};
  }

  /// Derivatives by the natural shape of a rod at one of its stencils, from those by the stencil's natural strains.
  /// Returns the derivative by its length.
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

  /// Derivatives by the natural shape as it was drawn.
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
