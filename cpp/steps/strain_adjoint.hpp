#pragma once
/// Derivatives that are common to ordinary and discrete gradients of elastic and viscous forces: by the coefficients of
/// a stencil, and by the strains at the start of the step.

#include "steps/regular_stencils.hpp"

namespace withe {

/// Coefficients of bending and twisting in a step, and derivatives by them.
struct TurningNumbers {
  const Columns3 &stiffness, &natural;
  const VectorX& viscous_time;
  Columns3 &by_stiffness, &by_natural;
  VectorX& by_time;
  double rate;  ///< 1 / h; without viscosity 0

  /// `along`: rows^T times the gradient of the strain. `change`: change of the strain from the start, for viscosity.
  void add(Eigen::Index i, int s, double along, double strain, double change) const {
    by_stiffness(i, s) += (strain - natural(i, s)) * along;
    by_natural(i, s) -= stiffness(i, s) * along;
    add_rate(i, s, along, change);
  }

  /// Adds only the part of viscosity.
  void add_rate(Eigen::Index i, int s, double along, double change) const {
    if (rate == 0.0) return;
    by_stiffness(i, s) += rate * viscous_time(i) * change * along;
    by_time(i) += rate * stiffness(i, s) * change * along;
  }
};

/// Contribution of one stencil: its strains in the necessary configurations, and its coefficients.
class StencilAdjoint {
 public:
  StencilAdjoint(const StepProblem& problem, const ElementTable& table, int element, StepAdjoint& adjoint)
      : problem_(problem), table_(table), element_(element), adjoint_(adjoint) {
    gather(table, element, adjoint.rows, rows_);
  }

  StrainGradients middle, start, end;

  double along(int strain) const {
    double sum = 0.0;
    for (int i = 0; i < table_.width(); ++i) sum += rows_[i] * middle.gradient[strain][i];
    return sum;
  }
  const double (&rows() const)[kMaxLocal] { return rows_; }

  /// Change of a strain that viscosity acts on: over the step, or half of it under the midpoint rules.
  double change(int strain) const {
    return problem_.in_middle() ? 0.5 * (end.strain[strain] - start.strain[strain])
                                : middle.strain[strain] - start.strain[strain];
  }

  /// Adds derivatives through the strain at the start, and through the strain at q1 = 2 z - q0. `viscous`: kv.
  void add_ends(int strain, double viscous) {
    const double factor = viscous * along(strain), share = problem_.in_middle() ? 0.5 : 1.0;
    add_start(strain, -share * factor);
    if (problem_.in_middle()) add_configuration(end.gradient[strain], share * factor, -1.0, adjoint_.end_turn);
  }

  /// Adds `factor` times the derivative of the strain at the start by the start.
  void add_start(int strain, double factor) {
    add_configuration(start.gradient[strain], factor, 1.0, adjoint_.start_turn);
  }

  /// Adds `gradient` in a configuration whose derivative by q0 is `by_start`.
  void add_configuration(const double* gradient, double factor, double by_start, VectorX& turn) {
    const int* dofs = table_.dofs(element_);
    for (int i = 0; i < table_.width(); ++i)
      if (dofs[i] >= 0) adjoint_.start[dofs[i]] += factor * by_start * gradient[i];
    for (int i = 0; i < angles.count; ++i) turn[angles.edge[i]] += factor * gradient[angles.place[i]];
  }

  void add_turning(const TurningNumbers& numbers, const Columns3& viscous_stiffness) {
    for (int s = 0; s < middle.count; ++s) {
      const bool viscous = numbers.rate != 0.0;
      numbers.add(element_, s, along(s), middle.strain[s], viscous ? change(s) : 0.0);
      if (viscous) add_ends(s, viscous_stiffness(element_, s));
    }
  }

  Angles angles;

 private:
  const StepProblem& problem_;
  const ElementTable& table_;
  int element_;
  StepAdjoint& adjoint_;
  double rows_[kMaxLocal];
};

/// Sum of factors times gradients of the strains f (kappa1, kappa2, tau) of ordinary stencils in space. `strain`:
/// values of these strains.
inline VectorX strain_forces(const Model& model, const Assembler& assembler, const BendMeasure& measure,
                             const Configuration& c, const Columns3& strain, const Columns3& factors) {
  // Derivatives of the energy k (s - n)^2 / 2 with s - n = 1.
  const Columns3 natural = strain.array() - 1.0;
  const VectorX none = VectorX::Zero(model.edge_count);
  VectorX out = VectorX::Zero(model.dof_count + kPadding), magnitude = out;
  StencilBatch batch = kernel_batch(assembler, measure, c, natural, factors);
  batch.force = none.data();
  batch.residual = out.data();
  batch.magnitude = magnitude.data();
  stencil_kernels().bend(batch);
  return out;
}

}  // namespace withe
