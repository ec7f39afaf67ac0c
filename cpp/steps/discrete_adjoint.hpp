#pragma once
/// Derivatives of discrete gradients, the elastic forces of energy-momentum steps, by both ends of a step.

#include <array>
#include <utility>

#include "elasticity/discrete_elements.hpp"
#include "geometry/rotation.hpp"
#include "model/edge_vectors.hpp"
#include "steps/regular_stencils.hpp"

namespace withe {

/// Adjoint of discrete gradients. A discrete gradient depends only on the two ends of a step, apart from the force that
/// a torque adds at nodes by the transport of the directors: spin times the torque. It does not change if the two ends
/// are exchanged. Therefore the derivatives by the start are the derivatives by the end of the reversed step.
class DiscreteAdjoint {
 public:
  DiscreteAdjoint(const StepProblem& problem, const StepData& data, const VectorX& rows, StepAdjoint& adjoint)
      : problem_(problem),
        adjoint_(adjoint),
        back_(-data.change),
        back_q_(problem.start->q),
        start_(problem.start_configuration),
        forth_{problem.start_configuration, data.configuration, data.end_configuration, data.end, data.change, false},
        backwards_{data.end_configuration, data.configuration, start_, back_q_, back_, false},
        rows_(rows) {
    const Model& model = problem.model;
    for (int dof : model.frame_dof) {
      if (model.planar()) break;
      // In the reversed step a frame turns by the opposite Cayley vector. Its rows are moments.
      back_q_.segment<3>(dof) = back_.segment<3>(dof);
      rows_.segment<3>(dof) = (cayley_spin(data.z.segment<3>(dof)) * rows_.segment<3>(dof)).eval();
    }
    for (int e = 0; !model.planar() && e < model.edge_count; ++e) {
      // Angles at the start, as the reversed step has them: measured from the directors carried to the tangents at the
      // end.
      EdgeFrame<double>& start = start_.edge[at(e)];
      const Vec3d& source = data.end_configuration.edge[at(e)].tangent;
      start.spin = (-start.inverse_length / (1.0 + dot(source, start.tangent))) * cross(source, start.tangent);
      const Vec3d& spin = data.configuration.edge[at(e)].spin;
      const int tail = model.tail_dof[at(e)], head = model.head_dof[at(e)];
      for (int i = 0; i < 3; ++i) rows_[model.edge_dof[at(e)]] += spin[i] * (rows_[head + i] - rows_[tail + i]);
    }
  }

  /// `evaluate(step, k, with_matrix, local)` takes stiffnesses and natural strains `k`: those of elasticity, by which
  /// derivatives are taken, or those that are `acting`. `frame`: the frame whose unknowns are among those of the
  /// element, or -1. Returns rows^T times the forces of a unit moment on each of the mean strains.
  template <class Evaluate>
  std::array<double, 3> add_turning(const ElementTable& table, int i, const TurnCoefficients& k,
                                    const TurnCoefficients& acting, const Angles& angles, int frame,
                                    const Evaluate& evaluate, Columns3& by_stiffness, Columns3& by_natural) {
    double rows[kMaxLocal];
    gather(table, i, rows_, rows);
    return add_turning(table, i, rows, k, acting, angles, frame, evaluate, by_stiffness, by_natural).along;
  }

  /// Derivatives of rows^T times the contribution of one element.
  struct Turning {
    std::array<double, 3> along{};        ///< by unit moments on the mean strains
    std::array<double, kMaxLocal> end{};  ///< by its unknowns at the end of the step
  };
  template <class Evaluate>
  Turning add_turning(const ElementTable& table, int i, const double* rows, const TurnCoefficients& k,
                      const TurnCoefficients& acting, const Angles& angles, int frame, const Evaluate& evaluate,
                      Columns3& by_stiffness, Columns3& by_natural) {
    const auto work = [&](const TurnCoefficients& of) {
      Local local;
      evaluate(forth_, of, false, local);
      double sum = 0.0;
      for (int r = 0; r < table.width(); ++r) sum += rows[r] * local.gradient[r];
      return sum;
    };
    Turning out;
    for (int s = 0; s < (problem_.model.planar() ? 1 : 3); ++s) {
      TurnCoefficients unit{k.measure, {}, k.natural};
      (s == 0 ? unit.stiffness.x : s == 1 ? unit.stiffness.y : unit.stiffness.z) = 1.0;
      const double now = work(unit);
      by_stiffness(i, s) += now;
      (s == 0 ? unit.natural.x : s == 1 ? unit.natural.y : unit.natural.z) += 1.0;
      out.along[at(s)] = now - work(unit);
      by_natural(i, s) -= k.stiffness[s] * out.along[at(s)];
    }
    const auto [start, end] = add_ends(
        table, i, rows, angles, [&](const DiscreteStep& step, Local& local) { evaluate(step, acting, true, local); });
    out.end = end;
    if (frame < 0 || problem_.model.planar()) return out;
    adjoint_.start_spin.row(frame) += by_spin(backwards_, frame, start.data() + 7).transpose();
    adjoint_.end_spin.row(frame) += by_spin(forth_, frame, end.data() + 7).transpose();
    return out;
  }

  /// Converts derivatives by the Cayley vector of a frame at the end of a step into derivatives by its rotation vector.
  Vector3 by_spin(const DiscreteStep& step, int frame, const double* by) const {
    const int dof = problem_.model.frame_dof[at(frame)];
    return cayley_spin(step.end_q.segment<3>(dof)).transpose().inverse() * Eigen::Map<const Vector3>(by);
  }

  /// Returns the derivatives by the start and by the end. They are half the matrices of steps, since q1 = 2 z - q0.
  template <int size = kMaxLocal, class Evaluate>
  std::pair<std::array<double, size>, std::array<double, size>> add_ends(const ElementTable& table, int element,
                                                                         const double* rows, const Angles& angles,
                                                                         const Evaluate& evaluate) {
    LocalOf<size> by_end, by_start;
    evaluate(forth_, by_end);
    evaluate(backwards_, by_start);
    const int* dofs = table.dofs(element);
    std::array<double, size> end{}, start{};
    for (std::size_t c = 0; c < static_cast<std::size_t>(table.width()); ++c) {
      for (int r = 0; r < table.width(); ++r) {
        end[c] += 0.5 * rows[r] * by_end.hessian[r][c];
        start[c] += 0.5 * rows[r] * by_start.hessian[r][c];
      }
      if (dofs[c] >= 0) adjoint_.start[dofs[c]] += start[c] - end[c];
    }
    for (int i = 0; i < angles.count; ++i) {
      const auto place = static_cast<std::size_t>(angles.place[i]);
      add_turn(angles.edge[i], start[place], end[place]);
    }
    return {start, end};
  }

  /// Adds the derivatives of all ordinary stencils in space, with the coefficients that act. `axial` and `modulus` have
  /// one entry per edge, see StencilBatch. Returns rows^T times the forces of a unit moment on each of the mean
  /// strains.
  Columns3 add_regular(const Assembler& assembler, const ElasticCoefficients& k, const VectorX& axial,
                       const VectorX& modulus) {
    const Model& model = problem_.model;
    StencilBatch batch = kernel_batch(assembler, k.measure, forth_.middle, k.bend_natural, k.bend_stiffness);
    batch.geometric = axial.data();
    batch.modulus = modulus.data();
    const MomentumBatch forth{.start_frames = frames_of(forth_.start),
                              .end_frames = frames_of(forth_.end),
                              .start_strain = forth_.start.bend_strain.data(),
                              .end_strain = forth_.end.bend_strain.data()};
    const MomentumBatch back{.start_frames = frames_of(forth_.end),
                             .end_frames = frames_of(start_),
                             .start_strain = forth_.end.bend_strain.data(),
                             .end_strain = start_.bend_strain.data()};
    const StencilKernels& kernels = stencil_kernels();
    Columns3 along = Columns3::Zero(k.bend_stiffness.rows(), 3);
    kernels.momentum_changes(batch, forth, rows_.data(), along.data());
    VectorX end = VectorX::Zero(model.dof_count + kPadding), start = end;
    kernels.momentum_product(batch, forth, rows_.data(), end.data());
    kernels.momentum_product(batch, back, rows_.data(), start.data());
    adjoint_.start += (start - end).head(model.dof_count);
    for (int e = 0; e < model.edge_count; ++e) add_turn(e, start[model.edge_dof[at(e)]], end[model.edge_dof[at(e)]]);
    return along;
  }

  const DiscreteStep& forth() const { return forth_; }
  const DiscreteStep& backwards() const { return backwards_; }
  const VectorX& rows() const { return rows_; }

 private:
  /// Adds derivatives by the angle of an edge. Converts them into derivatives by turns of directors that move with the
  /// edge.
  void add_turn(int edge, double start, double end) {
    adjoint_.start_turn[edge] += start;
    adjoint_.end_turn[edge] += end;
    add_to_edge(problem_.model, edge, -start * start_.edge[at(edge)].spin, adjoint_.start);
  }

  const StepProblem& problem_;
  StepAdjoint& adjoint_;
  VectorX back_, back_q_;
  Configuration start_;
  DiscreteStep forth_, backwards_;
  VectorX rows_;  ///< rows of angles include the effect of torques on nodes
};

}  // namespace withe
