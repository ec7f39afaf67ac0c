#include "integrators/stiffness_signs.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <utility>

#include "steps/strain_parts.hpp"

namespace withe {

LinearSolver& StiffnessSigns::symmetric_part() {
  LinearSolver& matrix = equations_.assembler().solver();
  if (matrix.symmetry() == Symmetry::symmetric) return matrix;
  const SparsityPattern& pattern = equations_.assembler().pattern();
  if (generation_ != equations_.assembler().generation()) {
    generation_ = equations_.assembler().generation();
    symmetric_ = make_linear_solver(pattern, Symmetry::symmetric);
  }
  const std::span<const double> from = std::as_const(matrix).values();
  const std::span<double> to = symmetric_->values();
  std::fill(to.begin(), to.end(), 0.0);
  for (int column = 0, k = 0; column < pattern.size; ++column)
    for (; k < pattern.column_starts[static_cast<std::size_t>(column) + 1]; ++k) {
      const int row = pattern.row_indices[static_cast<std::size_t>(k)];
      to[static_cast<std::size_t>(symmetric_->place(row, column))] +=
          (row == column ? 1.0 : 0.5) * from[static_cast<std::size_t>(matrix.place(row, column))];
    }
  if (equations_.loops()) equations_.loops()->condense(equations_.assembler(), matrix, *symmetric_);
  return *symmetric_;
}

bool StiffnessSigns::definite(LinearSolver& stiffness, double damping, const VectorX& weight) {
  shift_ = damping * weight;
  ++counters_.factorizations;
  const Factorization f = stiffness.factorize({shift_.data(), static_cast<std::size_t>(shift_.size())});
  return f.status == FactorStatus::ok && f.negative_pivots == 0;
}

bool StiffnessSigns::stable(const State& state, StepData& data) {
  LinearSolver& solver = equations_.assembler().solver();
  if (solver.symmetry() == Symmetry::unsymmetric && !equations_.has_potential_here()) {
    ++counters_.factorizations;
    return solver.factorize().status == FactorStatus::ok;
  }
  if (definite(symmetric_part(), -1.0, neutral_shift(equations_, kMaxRounding))) return true;
  const Lowest found = lowest(lowest_mode(0), state, data);
  return found.curvature >= -found.unknown;  // both are zero along a motion that nothing resists
}

bool StiffnessSigns::neutral(const State& state, StepData& data) {
  if (equations_.assembler().solver().symmetry() == Symmetry::symmetric) return neutral_motion(state, data).size() != 0;
  return !definite(symmetric_part(), -1.0, neutral_shift(equations_, kMaxRounding));
}

VectorX StiffnessSigns::neutral_motion(const State& state, StepData& data, double slack) {
  if (definite(symmetric_part(), -1.0, neutral_shift(equations_, kMaxRounding))) return {};
  VectorX mode = lowest_mode(0);
  // A hundredth of the rounding error of the matrix: no motion is softer.
  const double least = 0.01 * neutral_shift(equations_, kEpsilon).dot(mode.cwiseAbs2());
  const Lowest found = lowest(mode, state, data);
  if (std::abs(found.curvature) > slack * found.unknown + least) mode.resize(0);
  return mode;
}

/// The curvature of a neutral mode is not exactly zero, for two reasons. One is rounding. The other is a force F out of
/// balance: along q(a) of constant potential, K q' . q' = -F . q'', and nodes that turn by a have |q''| = |q'|. The
/// bound is twice the latter, because rounding reaches it for a bar under tension.
StiffnessSigns::Lowest StiffnessSigns::lowest(const VectorX& mode, const State& state, StepData& data) {
  VectorX imbalance = data.residual;
  equations_.assembler().project(imbalance);
  double left = 0.0;
  const Model& model = equations_.model();
  for (const int dof : model.node_dof)
    left += imbalance.segment(dof, model.dimension).norm() * mode.segment(dof, model.dimension).norm();
  left *= 2.0 * norms_.turn(mode);
  const Curvature least = curvature_along(equations_, state, mode, data);
  return {least.value, least.rounding + left};
}

/// A hinge or a slide between bodies has no inertia of its own, but that of the parts that it moves.
VectorX StiffnessSigns::weights() const {
  VectorX weight = equations_.mass().rows;
  const StepProblem& problem = equations_.problem();
  const Model& model = problem.model;
  if (model.hinges.empty() && model.slides.empty()) return weight.cwiseMax(1e-300);
  VectorX moved = weight;
  Carrying carrying;
  for (std::size_t i = model.carried.size(); i-- > 0;) {  // parts of parts first
    const CarriedPart& part = model.carried[i];
    find_carrying(problem, problem.start->q, i, carrying);
    for (std::size_t b = 0; b < part.body_dofs.size(); ++b)
      for (int d = 0; d < part.own_size; ++d) {
        const double follow = carrying.follow(d, static_cast<Eigen::Index>(b));
        moved[part.body_dofs[b]] += follow * follow * moved[part.own_dof + d];
      }
  }
  const auto take = [&](int dof) {
    if (weight[dof] == 0.0) weight[dof] = moved[dof];
  };
  for (const Hinge& hinge : model.hinges) take(hinge.dof);
  for (const Slide& slide : model.slides) take(slide.dof);
  return weight.cwiseMax(1e-300);
}

VectorX StiffnessSigns::lowest_mode(int seed) {
  const Model& model = equations_.model();
  LinearSolver& solver = symmetric_part();
  const VectorX weight = weights();
  const double stiffness = equations_.assembler().greatest_stiffness(weight);
  double damping = stiffness > 0.0 ? 1e-16 * stiffness : 1.0;  // a free body has none
  while (!definite(solver, damping, weight) && damping < 1e3 * stiffness) damping *= 2.0;
  std::mt19937 random(static_cast<unsigned>(seed + 1));
  std::normal_distribution<double> normal;
  VectorX direction(model.dof_count);
  for (Eigen::Index i = 0; i < direction.size(); ++i) direction(i) = normal(random);
  for (int k = 0; k < 20; ++k) {
    direction = direction.cwiseProduct(weight);
    equations_.assembler().project(direction);
    solver.solve({direction.data(), static_cast<std::size_t>(direction.size())});
    direction /= direction.norm();
  }
  return direction;
}

}  // namespace withe
