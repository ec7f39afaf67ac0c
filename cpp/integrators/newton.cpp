#include "integrators/newton.hpp"

#include <chrono>
#include <cmath>

namespace withe {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

}  // namespace

Newton::Newton(const Model& model, const Options& options) : model_(model), options_(options) {
  is_angle_.assign(static_cast<std::size_t>(model.dof_count), true);
  for (int dof : model.node_dof)
    for (int i = 0; i < model.dimension; ++i) is_angle_[static_cast<std::size_t>(dof + i)] = false;
  for (int dof : model.node_dof) blocks_.push_back({dof, model.dimension, false});
  for (int dof : model.frame_dof) blocks_.push_back({dof, model.frame_size(), true});
  for (int dof : model.edge_dof) blocks_.push_back({dof, 1, true});
  for (const Hinge& hinge : model.hinges) blocks_.push_back({hinge.dof, 1, true});
  edge_scale_ = model.edge_length.minCoeff();
}

Balance Newton::balance(const Evaluation& e, NewtonResult& result) const {
  double force_scale = 0.0, moment_scale = 0.0;
  for (Eigen::Index i = 0; i < e.residual.size(); ++i)
    (is_angle_[static_cast<std::size_t>(i)] ? moment_scale : force_scale) =
        std::max(is_angle_[static_cast<std::size_t>(i)] ? moment_scale : force_scale, e.magnitude(i));
  moment_scale = std::max(moment_scale, force_scale * edge_scale_);
  Balance balance;
  result.residual = 0.0;
  for (Eigen::Index i = 0; i < e.residual.size(); ++i) {
    const bool angle = is_angle_[static_cast<std::size_t>(i)];
    const double r = std::abs(e.residual(i));
    const bool floor = r <= 10.0 * e.floor(i);
    const bool relative = r <= options_.force_tolerance * (angle ? moment_scale : force_scale);
    balance.floor = balance.floor && floor;
    balance.relative = balance.relative && relative;
    balance.either = balance.either && (floor || relative);
    const double as_force = angle ? r / edge_scale_ : r;
    if (!(as_force <= result.residual)) {
      result.residual = as_force;
      result.worst_row = static_cast<int>(i);
    }
  }
  return balance;
}

double Newton::cap(const VectorX& step) const {
  double move = 0.0, turn = 0.0;
  for (const Block& block : blocks_) {
    double& greatest = block.angle ? turn : move;
    greatest = std::max(greatest, step.segment(block.first, block.size).norm());
  }
  // An edge may turn by about half a radian at once.
  double edge_turn = 0.0;
  for (int e = 0; e < model_.edge_count; ++e) {
    const auto i = static_cast<std::size_t>(e);
    const int a = model_.node_dof[static_cast<std::size_t>(model_.edge_tail[i])];
    const int b = model_.node_dof[static_cast<std::size_t>(model_.edge_head[i])];
    double d = 0.0;
    for (int k = 0; k < model_.dimension; ++k) d += std::pow(step(b + k) - step(a + k), 2);
    edge_turn = std::max(edge_turn, std::sqrt(d) / model_.edge_length(e));
  }
  double factor = 1.0;
  if (move > 0.5 * model_.length_scale) factor = 0.5 * model_.length_scale / move;
  if (turn * factor > 1.5) factor = 1.5 / turn;
  if (edge_turn * factor > 1.0) factor = 1.0 / edge_turn;
  return factor;
}

double Newton::displacement(const VectorX& step) const {
  double move = 0.0;
  for (const Block& block : blocks_)
    move = std::max(move, step.segment(block.first, block.size).norm() * (block.angle ? edge_scale_ : 1.0));
  return move;
}

NewtonResult Newton::solve(Equations& equations, VectorX& z, const VectorX* target, int max_iterations,
                           NewtonWorkspace& work, bool mixed) const {
  mixed = mixed && options_.mixed;
  NewtonResult result;
  Evaluation& e = work.evaluation;
  const double tolerance = options_.step_tolerance * model_.length_scale;
  LinearSolver& solver = equations.assembler().solver();
  bool axial_known = false;
  double previous_step = INFINITY;
  result.step = INFINITY;
  int stagnant = 0;
  for (;; ++result.iterations) {
    work.poll();
    const auto start = Clock::now();
    const bool expect_end = result.step <= tolerance * 1e3;
    const double* axial = mixed && axial_known ? work.axial_force.data() : nullptr;
    const auto evaluate = [&](bool matrix) {
      equations.evaluate(z, matrix, axial, e);
      if (target) e.residual -= *target;
    };
    evaluate(!expect_end);
    if (!e.residual.allFinite()) return result;
    const Balance balance = this->balance(e, result);
    // Rounding alone is no proof before the first step: a light load on a stiff rod hides in it.
    if ((balance.floor && (result.iterations > 0 || balance.relative)) ||
        (balance.either && (result.step <= tolerance || stagnant >= 3))) {
      work.counters.assembly_time += seconds_since(start);
      result.converged = true;
      return result;
    }
    if (result.iterations == max_iterations) return result;
    if (expect_end) evaluate(true);
    work.counters.assembly_time += seconds_since(start);

    const auto solve_start = Clock::now();
    ++work.counters.factorizations;
    ++work.counters.iterations;
    if (solver.factorize().status != FactorStatus::ok) {
      // A free mode (a rod that may spin about its axis): hold it by a shift far below every stiffness.
      double greatest = 0.0;
      for (int i = 0; i < model_.dof_count; ++i)
        greatest = std::max(greatest, std::abs(equations.assembler().diagonal(i)));
      work.trial.setConstant(model_.dof_count, 1e-12 * greatest);
      if (!(greatest > 0.0) ||
          solver.factorize({work.trial.data(), static_cast<std::size_t>(work.trial.size())}).status != FactorStatus::ok)
        return result;
    }
    work.step = -e.residual;
    solver.solve({work.step.data(), static_cast<std::size_t>(work.step.size())});
    work.counters.solve_time += seconds_since(solve_start);
    if (!work.step.allFinite()) return result;
    double factor = cap(work.step);
    if (options_.line_search == LineSearch::goldstein_price)
      factor *= line_search(equations, z, factor * work.step, target, work);
    work.step *= factor;
    if (mixed) equations.predict_axial_force(work.step, work.axial_force);
    axial_known = mixed;
    z += work.step;
    previous_step = result.step;
    result.step = factor < 1.0 ? INFINITY : displacement(work.step);
    stagnant = balance.either && result.step > 0.25 * previous_step ? stagnant + 1 : 0;
  }
}

/// [dissertation, Algorithm 4], with the sign of q + alpha dq and the bounds it leaves unset: Goldstein-Price on
/// |F|^2 / 2.
double Newton::line_search(Equations& equations, const VectorX& z, const VectorX& step, const VectorX* target,
                           NewtonWorkspace& work) const {
  const double before = 0.5 * work.evaluation.residual.squaredNorm();
  const double slope = -2.0 * before;  // F^T (dF/dq) dq, with dq = -J^-1 F
  double low = 0.0, high = 2.0, alpha = 1.0;
  for (int n = 0; n < 20; ++n) {
    work.trial = z + alpha * step;
    equations.evaluate(work.trial, false, nullptr, work.evaluation);
    if (target) work.evaluation.residual -= *target;
    const double change = 0.5 * work.evaluation.residual.squaredNorm() - before;
    if (!(change <= 0.1 * alpha * slope))
      high = alpha;
    else if (alpha < 1.0 && change < 0.9 * alpha * slope)
      low = alpha;
    else
      break;
    if (high - low < 1e-3) break;
    alpha = 0.5 * (low + high);
  }
  equations.evaluate(z, false, nullptr, work.evaluation);
  return alpha;
}

}  // namespace withe
