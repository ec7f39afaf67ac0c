#include "gradients/readout_gradient.hpp"

#include <algorithm>

#include "common/check.hpp"
#include "model/drawn_frame.hpp"
#include "model/edge_vectors.hpp"
#include "model/stencil_numbers.hpp"
#include "steps/regular_stencils.hpp"

namespace withe {
namespace {

/// Strains kappa1, kappa2, tau themselves.
constexpr BendMeasure kPlain{0.0, 0.0};

Eigen::Index stencil_count(const Model& model) {
  Eigen::Index count = 0;
  for (const auto& places : model.place) count += static_cast<Eigen::Index>(places.size());
  return count;
}

void add_gradient(const ElementTable& table, int element, const double* gradient, double factor, VectorX& out) {
  const int* dofs = table.dofs(element);
  for (int i = 0; i < table.width(); ++i)
    if (dofs[i] >= 0) out[dofs[i]] += factor * gradient[i];
}

/// J^T by, J the derivative of the smooth curvature by the discrete one.
Vector2 by_discrete(const Vector2& discrete, double voronoi, const Vector2& by) {
  using ByTwo = Dual<2>;
  const ByTwo x = ByTwo::unknown(discrete(0), 0), y = ByTwo::unknown(discrete(1), 1),
              factor = smooth_over_discrete(x, y, voronoi), sum = by(0) * (factor * x) + by(1) * (factor * y);
  return {sum.slope[0], sum.slope[1]};
}

class Readouts {
 public:
  Readouts(const Model& model, const Assembler& assembler, const Parameters& parameters, const State& state,
           StateAdjoint& out, CoefficientAdjoint& coefficients)
      : model_(model), assembler_(assembler), p_(parameters), state_(state), out_(out), by_(coefficients) {
    compute_configuration(model, state_, state_.q, c_);
    if (model.planar()) return;
    // Directors are measured from where they are, and so turn with their edges without a change of their angles.
    accept_configuration(model, VectorX(state_.q), c_, state_);
    compute_configuration(model, state_, state_.q, c_);
  }

  /// Directors turn by psi about their edge's tangent, and with it by the smallest turn: d1' = psi d2 - (d1 . t') t.
  void add_directors(const MatrixX9& by) {
    for (int e = 0; e < model_.edge_count; ++e) {
      const EdgeFrame<double>& f = c_.edge[at(e)];
      const Vector3 by1 = by.row(e).segment<3>(0), by2 = by.row(e).segment<3>(3), by_t = by.row(e).segment<3>(6);
      if (model_.planar()) {
        add_planar_directors(e, f, by1, by2, by_t);
        continue;
      }
      const Vector3 t = to_eigen(f.tangent), d1 = to_eigen(f.d1), d2 = to_eigen(f.d2);
      out_.q[model_.edge_dof[at(e)]] += by1.dot(d2) - by2.dot(d1);
      const Vector3 across = by_t - by_t.dot(t) * t - by1.dot(t) * d1 - by2.dot(t) * d2;
      add_to_edge(model_, e, to_vec3(f.inverse_length * across), out_.q);
    }
  }

  void add_tensions(const VectorX& by) { add_axial_forces(model_, p_, c_, by, out_.q, by_); }

  void add_stencils(const MatrixX2& curvatures, const VectorX& twists) {
    Eigen::Index row = 0;
    for (std::size_t r = 0; r < model_.place.size(); ++r)
      for (std::size_t s = 0; s < model_.place[r].size(); ++s, ++row) {
        const Vector2 by_curvature = curvatures.size() != 0 ? Vector2(curvatures.row(row)) : Vector2(Vector2::Zero());
        const double by_twist = twists.size() != 0 ? twists(row) : 0.0;
        add_stencil(static_cast<int>(r), static_cast<int>(s), by_curvature, by_twist);
      }
  }

 private:
  /// In its plane an edge turns its directors about the normal.
  void add_planar_directors(int e, const EdgeFrame<double>& f, const Vector3& by1, const Vector3& by2,
                            const Vector3& by_t) {
    const Matrix3 now = edge_directors(model_, c_, e);
    const Vector3 d1 = now.col(0), d2 = now.col(1), t = now.col(2), n = model_.plane->normal;
    const double by = by1.dot(n.cross(d1)) + by2.dot(n.cross(d2)) + by_t.dot(n.cross(t));
    by_.edge_turn.row(e) += (by1.dot(d2) - by2.dot(d1)) * drawn_edge_frame(model_, e).col(2).transpose();
    const Vector2 way = by * f.inverse_length * Vector2(-f.tangent.y, f.tangent.x);
    out_.q.segment<2>(model_.head_dof[at(e)]) += way;
    out_.q.segment<2>(model_.tail_dof[at(e)]) -= way;
  }

  void add_stencil(int rod, int stencil, const Vector2& by_curvature, double by_twist) {
    const StencilPlace& place = model_.place[at(rod)][at(stencil)];
    StrainGradients strains;
    if (place.bend >= 0) {
      const int b = place.bend;
      const auto& edge = model_.bend[at(b)].edge;
      const double voronoi = model_.bend_voronoi(b);
      const double carried =
          model_.bend_share(b, 0) * model_.edge_arc(edge[0]) + model_.bend_share(b, 1) * model_.edge_arc(edge[1]);
      bend_gradients(model_, kPlain, c_, b, strains);
      add_lengths(rod, stencil, b, carried, strains, by_curvature, by_twist);
      add_strains(assembler_.bend, b, strains, by_strains(rod, stencil, strains, voronoi, carried, by_curvature),
                  by_twist / voronoi);
      return;
    }
    add_halves(rod, stencil, place.half, by_curvature, by_twist);
  }

  /// Curvature of a frame: the mean over both halves, weighted by their lengths V, of k0 (1 - V / C) + S / C. The twist
  /// is the sum of tau over both lengths. The carried length C of a half is a fixed part of its edge.
  void add_halves(int rod, int stencil, const int (&halves)[2], const Vector2& by_curvature, double by_twist) {
    const Vector2 natural = p_.natural_curvature[at(rod)].row(stencil);
    StrainGradients strains;
    double length = 0.0, by_sum = 0.0;
    for (int h : halves)
      if (h >= 0) length += model_.half_voronoi(h);
    for (int h : halves) {
      if (h < 0) continue;
      const int edge = model_.half[at(h)].edge;
      const double voronoi = model_.half_voronoi(h), carried = model_.half_share(h) * model_.edge_arc(edge);
      half_gradients(model_, state_.q, kPlain, c_, h, strains);
      const Vector2 turn = voronoi * smooth_curvature(discrete_curvature(rod, strains), voronoi);
      const double twisted = model_.planar() ? 0.0 : strains.strain[2], beyond = voronoi / carried;
      by_sum += by_curvature.dot(voronoi * (1.0 - beyond) * natural + beyond * turn) + by_twist * twisted;
      by_.rest_length(edge) += 0.5 / length * (1.0 - beyond) * by_curvature.dot(natural);
      const Vector2 part = (voronoi / length) * by_curvature,
                    by = by_strains(rod, stencil, strains, voronoi, carried, part);
      add_strains(assembler_.half, h, strains, by, by_twist / length);
      add_attachment(h, strains, by, by_twist / length);
    }
    for (int h : halves)
      if (h >= 0) by_.rest_length(model_.half[at(h)].edge) -= 0.5 / (length * length) * by_sum;
  }

  void add_attachment(int h, const StrainGradients& strains, const Vector2& by, double by_tau) {
    auto out = by_.attachment.row(h);
    if (model_.planar()) {
      out += by(0) * strains.gradient[0][4] * model_.plane->normal.transpose();
      return;
    }
    const auto spin = [&](int s) { return Eigen::Map<const Vector3>(strains.gradient[s] + 7); };
    const Vector3 sum = by(0) * spin(0) + by(1) * spin(1) + by_tau * spin(2);
    out += (attached_axes(model_, c_, state_.q, h).transpose() * sum).transpose();
  }

  /// Towards both directors.
  Vector2 discrete_curvature(int rod, const StrainGradients& strains) const {
    if (model_.planar()) return strains.strain[0] * model_.planar_components[at(rod)];
    return {strains.strain[0], strains.strain[1]};
  }

  /// Read-outs of a stencil depend on rest lengths too: the curvature k0 (1 - V / C) + S / C, with C the carried length
  /// of the stencil and S its rotation, and the twist tau / V.
  void add_lengths(int rod, int stencil, int bend, double carried, const StrainGradients& strains,
                   const Vector2& by_curvature, double by_twist) {
    const double voronoi = model_.bend_voronoi(bend);
    const Vector2 natural = p_.natural_curvature[at(rod)].row(stencil);
    const Vector2 turn = voronoi * smooth_curvature(discrete_curvature(rod, strains), voronoi);
    const double twisted = model_.planar() ? 0.0 : strains.strain[2];
    for (int end = 0; end < 2; ++end) {
      const double share = model_.bend_share(bend, end) / carried;
      by_.rest_length(model_.bend[at(bend)].edge[end]) +=
          by_curvature.dot((voronoi * share - 0.5) / carried * natural - share / carried * turn) -
          by_twist * twisted / (2.0 * voronoi * voronoi);
    }
  }

  /// Derivatives by discrete curvatures; see `World::curvatures`. In a plane, by both components of the one curvature.
  Vector2 by_strains(int rod, int stencil, const StrainGradients& strains, double voronoi, double carried,
                     const Vector2& by) {
    const double beyond = voronoi / carried;
    by_.natural_curvature[at(rod)].row(stencil) += (1.0 - beyond) * by.transpose();
    Vector2 out = by_discrete(discrete_curvature(rod, strains), voronoi, beyond * by);
    if (!model_.planar()) return out;
    by_.planar_components.row(rod) += strains.strain[0] * out.transpose();
    return {model_.planar_components[at(rod)].dot(out), 0.0};
  }

  void add_strains(const ElementTable& table, int element, const StrainGradients& strains, const Vector2& by,
                   double by_tau) {
    add_gradient(table, element, strains.gradient[0], by(0), out_.q);
    if (model_.planar()) return;
    add_gradient(table, element, strains.gradient[1], by(1), out_.q);
    add_gradient(table, element, strains.gradient[2], by_tau, out_.q);
  }

  const Model& model_;
  const Assembler& assembler_;
  const Parameters& p_;
  State state_;
  StateAdjoint& out_;
  CoefficientAdjoint& by_;
  Configuration c_;
};

}  // namespace

void ReadoutAdjoint::check(const Model& model) const {
  const auto fits = [](const auto& table, Eigen::Index rows, const char* what) {
    require(table.size() == 0 || table.rows() == rows, "derivatives by ", what,
            " must have this number of rows: ", rows);
  };
  for (const MatrixX3* table : {&positions, &velocities}) fits(*table, model.node_count, "positions or velocities");
  fits(directors, model.edge_count, "directors");
  for (const VectorX* table : {&tensions, &spins}) fits(*table, model.edge_count, "tensions or spins");
  fits(curvatures, stencil_count(model), "curvatures");
  fits(twists, stencil_count(model), "twists");
  const auto supports = static_cast<Eigen::Index>(model.supports.size());
  for (const MatrixX3* table : {&reactions.forces, &reactions.moments})
    require(table->rows() <= supports, "derivatives by reactions must have at most this number of rows: ", supports);
}

bool leaves_plane(const Model& model, const State& state, const ReadoutAdjoint& by) {
  if (!model.planar()) return false;
  constexpr double kRounded = 1e-9;
  const Vector3& normal = model.plane->normal;
  const auto beyond = [](const auto& off, const auto& all) {
    return off.size() > 0 && off.cwiseAbs().maxCoeff() > kRounded * std::max(all.cwiseAbs().maxCoeff(), 1e-300);
  };
  for (const MatrixX3* by_vectors : {&by.positions, &by.velocities, &by.reactions.forces})
    if (beyond((*by_vectors * normal).eval(), *by_vectors)) return true;
  const MatrixX3& moments = by.reactions.moments;
  if (beyond((moments - moments * normal * normal.transpose()).eval(), moments)) return true;
  if (beyond(by.twists, by.twists) || beyond(by.spins, by.spins)) return true;
  if (by.curvatures.size() != 0) {
    VectorX off(by.curvatures.rows());
    Eigen::Index row = 0;
    for (std::size_t rod = 0; rod < model.place.size(); ++rod)
      for (std::size_t s = 0; s < model.place[rod].size(); ++s, ++row) {
        const Vector2& p = model.planar_components[rod];
        off(row) = by.curvatures(row, 0) * p(1) - by.curvatures(row, 1) * p(0);
      }
    if (beyond(off, by.curvatures)) return true;
  }
  if (by.directors.size() == 0) return false;
  // Turns of an edge about an axis w change the scalar by w . sum d x dL/dd.
  Configuration c;
  compute_configuration(model, state, state.q, c);
  MatrixX3 turns(by.directors.rows(), 3);
  for (int e = 0; e < model.edge_count; ++e) {
    const Matrix3 d = edge_directors(model, c, e);
    Vector3 turn = Vector3::Zero();
    for (int i = 0; i < 3; ++i) turn += d.col(i).cross(Vector3(by.directors.row(e).segment<3>(3 * i)));
    turns.row(e) = (turn - turn.dot(normal) * normal).transpose();
  }
  return beyond(turns, by.directors);
}

void add_unknowns(const Model& model, const ReadoutAdjoint& by, StateAdjoint& out) {
  for (int i = 0; i < by.positions.rows(); ++i) add_to_node(model, i, by.positions.row(i), out.q);
  for (int i = 0; i < by.velocities.rows(); ++i) add_to_node(model, i, by.velocities.row(i), out.v);
  if (by.spins.size() != 0 && !model.planar())
    for (int e = 0; e < model.edge_count; ++e) out.v[model.edge_dof[at(e)]] += by.spins(e);
}

void add_readouts(const Model& model, const Assembler& assembler, const Parameters& parameters, const State& state,
                  const ReadoutAdjoint& by, StateAdjoint& out, CoefficientAdjoint& coefficients) {
  Readouts readouts(model, assembler, parameters, state, out, coefficients);
  if (by.directors.size() != 0) readouts.add_directors(by.directors);
  if (by.tensions.size() != 0) readouts.add_tensions(by.tensions);
  if (by.curvatures.size() != 0 || by.twists.size() != 0) readouts.add_stencils(by.curvatures, by.twists);
}

}  // namespace withe
