#include "integrators/newton.hpp"

#include <algorithm>
#include <cmath>

#include "common/timer.hpp"

namespace withe {
namespace {

// A matrix of an earlier time step that leaves more than this of an error has served badly, and is tried again after
// so many steps.
constexpr double kSlow = 0.15;
constexpr int kPatience = 16;
constexpr double kForgetting = 0.96;  // a step, of how badly a matrix served within one
// So many iterations cost as much as a new matrix.
constexpr int kTiring = 3;
// An iteration with an old matrix costs about a quarter of one with a new one.
constexpr double kWorth = 2.5;
// After so many iterations, steps that are still too long to be taken whole and a residual that has grown by so much
// lead nowhere in time.
constexpr int kFirstIterations = 4;
constexpr double kHopeless = 1e3;
// Halvings of a step between surfaces before it is taken as it is.
constexpr int kMostCuts = 10;
// A first step of which less is kept counts as cut.
constexpr double kPromising = 0.5;
// That much of a step uphill is too little.
constexpr double kLittle = 0.125;
// Friction has no potential, and may lead downhill in a circle; what has not converged after so many iterations does.
constexpr int kLongestDescent = 20;
// While steps are longer than this, over the tolerance, surfaces may yet stick or slip, and an old matrix not know it.
constexpr double kUnsettled = 1e4;

// Corrections of a prediction must shrink by this factor, while they are longer than this share of the prediction.
constexpr double kMostContraction = 0.5, kNear = 0.05;

std::size_t at(MatrixAge age) { return static_cast<std::size_t>(age); }

}  // namespace

Newton::Newton(const Model& model, const Options& options) : model_(model), options_(options) {
  is_angle_.assign(static_cast<std::size_t>(model.dof_count), true);
  for (int dof : model.node_dof)
    for (int i = 0; i < model.dimension; ++i) is_angle_[static_cast<std::size_t>(dof + i)] = false;
  for (int dof : model.node_dof) nodes_.push_back({dof, model.dimension});
  for (int dof : model.frame_dof) angles_.push_back({dof, model.frame_size()});
  for (int dof : model.edge_dof) angles_.push_back({dof, 1});
  for (const Hinge& hinge : model.hinges) angles_.push_back({hinge.dof, 1});
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

/// Length of the longest of some blocks of a step.
double Newton::greatest(const std::vector<Block>& blocks, const VectorX& step) const {
  double square = 0.0;
  for (const Block& block : blocks) {
    double sum = 0.0;
    for (int i = 0; i < block.size; ++i) sum += step(block.first + i) * step(block.first + i);
    square = std::max(square, sum);
  }
  return std::sqrt(square);
}

/// Greatest change of an edge vector over its length.
double Newton::greatest_edge_turn(const VectorX& step) const {
  double edge_turn = 0.0;
  for (int e = 0; e < model_.edge_count; ++e) {
    const auto i = static_cast<std::size_t>(e);
    const int a = model_.node_dof[static_cast<std::size_t>(model_.edge_tail[i])];
    const int b = model_.node_dof[static_cast<std::size_t>(model_.edge_head[i])];
    double square = 0.0;
    for (int k = 0; k < model_.dimension; ++k) square += (step(b + k) - step(a + k)) * (step(b + k) - step(a + k));
    edge_turn = std::max(edge_turn, square / (model_.edge_length(e) * model_.edge_length(e)));
  }
  return std::sqrt(edge_turn);
}

double Newton::cap(const VectorX& step) const {
  const double move = greatest(nodes_, step), turn = greatest(angles_, step), edge_turn = greatest_edge_turn(step);
  double factor = 1.0;
  if (move > 0.5 * model_.length_scale) factor = 0.5 * model_.length_scale / move;
  if (turn * factor > 1.5) factor = 1.5 / turn;
  if (edge_turn * factor > 1.0) factor = 1.0 / edge_turn;
  return factor;
}

double Newton::turn(const VectorX& step) const {
  return std::max(greatest_edge_turn(step), 0.5 * greatest(angles_, step));
}

double Newton::displacement(const VectorX& step) const {
  return std::max(greatest(nodes_, step), edge_scale_ * greatest(angles_, step));
}

bool Newton::factorize(Equations& equations, NewtonWorkspace& work) const {
  const Timer timer(work.counters.solve_time);
  LinearSolver& solver = equations.assembler().solver();
  ++work.counters.factorizations;
  if (solver.factorize().status == FactorStatus::ok) return true;
  double greatest = 0.0;
  for (int i = 0; i < model_.dof_count; ++i) greatest = std::max(greatest, std::abs(equations.assembler().diagonal(i)));
  work.trial.setConstant(model_.dof_count, 1e-12 * greatest);
  return greatest > 0.0 &&
         solver.factorize({work.trial.data(), static_cast<std::size_t>(work.trial.size())}).status == FactorStatus::ok;
}

/// Residual, and matrix where it is asked for.
void Newton::evaluate_at(Equations& equations, const VectorX& z, bool matrix, const double* axial,
                         const VectorX* target, NewtonWorkspace& work) {
  const Timer timer(work.counters.assembly_time);
  equations.evaluate(z, matrix, axial, work.evaluation);
  if (target) work.evaluation.residual -= *target;
}

/// step = -A^-1 residual, with the matrix as it is factorised.
void Newton::solve_for_step(Equations& equations, NewtonWorkspace& work, VectorX& step) {
  const Timer timer(work.counters.solve_time);
  step = -work.evaluation.residual;
  equations.assembler().solver().solve({step.data(), static_cast<std::size_t>(step.size())});
}

/// Where a solve with matrices that may be old stands.
struct Newton::Progress {
  double tolerance = 0;  ///< [m]
  bool may_reuse = false;
  bool slipping = false;  ///< whether surfaces may turn round within a slip far smaller than a step
  bool fresh = true;      ///< whether the coming iteration makes a matrix
  MatrixAge age = MatrixAge::fresh, last_age = MatrixAge::fresh;
  double step = INFINITY, last_step = INFINITY;  ///< [m]
  double rest = INFINITY;                        ///< estimated distance from the solution [m]
  bool made_here = false;
  /// Of the last step; it may have evaluated the coming iteration, and solved for its step with the old matrix.
  Search search;
};

/// Whether corrections of a prediction are too long, or do not shrink, for what they lead to to lie on the same path.
bool Newton::loses_path(const Prediction& predicted, const Progress& p, bool first) {
  if (p.step <= std::max(kNear * predicted.length, kUnsettled * p.tolerance)) return false;
  return first ? !(p.step <= predicted.length) : !(p.step <= kMostContraction * p.last_step);
}

/// After an iteration: learns how well matrices serve, and decides about the next one.
void Newton::plan_next(Progress& p, FactorRecord& factor) const {
  const double tolerance = p.tolerance;
  p.rest = p.step;
  if (!p.may_reuse) return;
  bool measured = false;
  if (std::isfinite(p.last_step) && std::isfinite(p.step)) {
    // Steps near the tolerance are rounding as much as progress.
    const double rate = p.step / p.last_step;
    double& known = factor.contraction[at(p.last_age)];
    if (p.last_step > 1e2 * tolerance || rate < known) known = rate;
    measured = p.last_age == p.age;
  }
  const double here = std::min(0.5, (measured ? 1.0 : 4.0) * factor.contraction[at(p.age)]);
  p.rest = p.step * here / (1.0 - here);
  const double next = factor.contraction[at(p.age == MatrixAge::across ? MatrixAge::across : MatrixAge::within)];
  p.fresh = !std::isfinite(p.step) || next > 0.5 || (p.slipping && p.step > kUnsettled * tolerance) ||
            (p.rest > tolerance && std::log(p.rest / tolerance) > kWorth * std::log(1.0 / next));
}

NewtonResult Newton::solve(Equations& equations, VectorX& z, const VectorX* target, int max_iterations,
                           NewtonWorkspace& work, bool mixed, double interval, bool impatient,
                           const Prediction* predicted) const {
  mixed = mixed && options_.mixed;
  NewtonResult result;
  Evaluation& e = work.evaluation;
  FactorRecord& factor = work.factor;
  const double tolerance = this->tolerance(work);
  Progress p;
  p.tolerance = tolerance;
  p.slipping = equations.contact() && equations.contact()->eases();
  p.may_reuse = interval != 0.0 && options_.line_search != LineSearch::goldstein_price;
  if (p.may_reuse && factor.owner == &equations && factor.interval == std::abs(interval) &&
      factor.generation == equations.assembler().generation()) {
    const bool slow = factor.contraction[at(MatrixAge::across)] > kSlow;
    p.fresh = factor.tired || (slow && ++factor.waited < kPatience);
    if (!p.fresh) factor.waited = 0;
  }
  factor.tired = false;
  // What served badly once is tried again in time.
  factor.contraction[at(MatrixAge::within)] *= kForgetting;
  if (!p.may_reuse) factor.owner = nullptr;
  bool axial_known = mixed && (interval != 0.0 || predicted);
  int stagnant = 0, overdue = 0;
  double first_residual = 0.0;
  const auto end = [&] {
    if (equations.contact()) equations.contact()->forget_foreseen();
    return result;
  };
  const auto give_up = [&] {
    factor.owner = nullptr;
    return end();
  };
  for (;; ++result.iterations) {
    work.poll();
    const bool expect_end = p.rest <= tolerance * 1e3;
    const double* axial = mixed && axial_known ? work.axial_force.data() : nullptr;
    const auto evaluate = [&](bool matrix) { evaluate_at(equations, z, matrix, axial, target, work); };
    if (!p.search.evaluated || (p.fresh && !expect_end)) evaluate(p.fresh && !expect_end);
    result.step = p.step;
    if (!e.residual.allFinite()) return give_up();
    const Balance balance = this->balance(e, result);
    // Rounding alone is no proof before the first step: a light load on a stiff rod hides in it. Points on the way end
    // by their steps alone, whatever rounding leaves: the same scene elsewhere in space takes the same steps.
    const bool on_the_way = predicted && predicted->enough > 0.0;
    if (on_the_way ? p.step <= predicted->enough
                   : (balance.floor && (result.iterations > 0 || balance.relative)) ||
                         (balance.either && (p.rest <= tolerance || stagnant >= 3))) {
      result.converged = true;
      factor.tired = p.age == MatrixAge::across && result.iterations >= kTiring;
      return end();
    }
    if (result.iterations == max_iterations) return give_up();
    if (result.iterations == 0) first_residual = result.residual;
    if (interval != 0.0 && result.iterations >= kFirstIterations && std::isinf(p.step) && std::isinf(p.last_step) &&
        result.residual > kHopeless * first_residual)
      return give_up();
    // By what is known of the matrix this should have been the end: it serves worse than that.
    overdue = p.rest <= tolerance ? overdue + 1 : 0;
    if (p.may_reuse && overdue >= kTiring) p.fresh = true;
    if (p.fresh && expect_end) evaluate(true);

    ++work.counters.iterations;
    if (p.fresh) {
      if (!factorize(equations, work)) return give_up();
      p.made_here = true;
      factor.owner = p.may_reuse ? &equations : nullptr;
      factor.interval = std::abs(interval);
      factor.generation = equations.assembler().generation();
    }
    if (p.search.solved && !p.fresh)
      work.step.swap(work.next_step);
    else
      solve_for_step(equations, work, work.step);
    p.search = {};
    if (!work.step.allFinite()) return give_up();
    double shorten = shortened(equations, z, work.step);
    equations.foresee(work.step, shorten);
    if (mixed) equations.predict_axial_force(work.step, work.axial_force);
    axial_known = mixed;
    if (equations.contact()) {
      // Near the end every step is shorter than the last whole one, or friction's jump lies between.
      const double full = displacement(work.step) / shorten;
      const bool follows = result.iterations == 0 || (std::isfinite(p.step) && full <= 0.5 * p.step);
      if (full > 1e2 * tolerance || !follows) {
        const Demand demand{.nearer = result.iterations >= kLongestDescent};
        if (!step_between_surfaces(equations, z, target, demand, shorten, work, p.search)) return give_up();
        if (p.search.remade) {
          p.fresh = p.made_here = true;
          factor.owner = nullptr;
        }
        axial_known = false;  // no prediction outlives a step that may lead elsewhere
      }
    }
    if (result.iterations == 0) result.cut = equations.contact() && shorten < kPromising;
    if (impatient && result.cut) return give_up();
    if (options_.line_search == LineSearch::goldstein_price) {
      const double alpha = line_search(equations, z, work.step, target, work);
      work.step *= alpha;
      shorten *= alpha;
      axial_known = axial_known && alpha == 1.0;
      p.search = {};
    }
    if (p.search.evaluated)
      z.swap(work.trial);
    else
      z += work.step;
    p.last_step = p.step;
    p.last_age = p.age;
    p.step = shorten < 1.0 ? INFINITY : displacement(work.step);
    if (predicted && predicted->strict && loses_path(*predicted, p, result.iterations == 0)) return give_up();
    p.age = p.fresh ? MatrixAge::fresh : p.made_here ? MatrixAge::within : MatrixAge::across;
    stagnant = balance.either && p.step > 0.25 * p.last_step ? stagnant + 1 : 0;
    plan_next(p, factor);
  }
}

/// Shortens a step to what neither turns nor moves anything too far, and brings no surfaces too near; returns by how
/// much.
double Newton::shortened(Equations& equations, const VectorX& z, VectorX& step) const {
  double kept = cap(step);
  step *= kept;
  const double allowed = equations.allowed(z, step);
  step *= allowed;
  return kept * allowed;
}

/// Pressing has negative stiffness where surfaces slide off each other, and with much of it a step may lead uphill, to
/// where forces balance but do not hold. Where little of such a step can be kept, it is made anew without that
/// stiffness. Whether there is one; `shorten` is what the step has lost.
bool Newton::step_between_surfaces(Equations& equations, const VectorX& z, const VectorX* target, Demand demand,
                                   double& shorten, NewtonWorkspace& work, Search& found) const {
  Evaluation& e = work.evaluation;
  const bool uphill = work.step.dot(e.residual) > 0.0;
  found = search(equations, z, target, {.nearer = demand.nearer, .least = uphill ? kLittle : 0.0}, shorten, work);
  if (uphill && !found.evaluated) {
    equations.contact()->leave_out_geometric(true);
    evaluate_at(equations, z, true, nullptr, target, work);
    equations.contact()->leave_out_geometric(false);
    if (!factorize(equations, work)) return false;
    solve_for_step(equations, work, work.step);
    if (!work.step.allFinite()) return false;
    shorten = shortened(equations, z, work.step);
    found = search(equations, z, target, demand, shorten, work);
    found.remade = true;
  }
  work.step *= found.kept;
  shorten *= found.kept;
  return true;
}

/// Contact and friction turn on and off, so that full steps may go to and fro for ever. A step is kept at a length to
/// which it leads downhill, which needs no more than an evaluation, or from which the same matrix asks for a smaller
/// step next: the natural monotonicity test [Deuflhard 2011, section 3.3], which sees displacements only and so no
/// difference between forces and moments. `shorten` is what the step has lost already.
Newton::Search Newton::search(Equations& equations, const VectorX& z, const VectorX* target, Demand demand,
                              double shorten, NewtonWorkspace& work) const {
  Evaluation& e = work.evaluation;
  const double full = displacement(work.step) / shorten, before = work.step.dot(e.residual);
  Search found;
  for (int tries = 0; tries < kMostCuts && found.kept > demand.least; ++tries) {
    work.trial = z + found.kept * work.step;
    evaluate_at(equations, work.trial, false, nullptr, target, work);
    found.evaluated = e.residual.allFinite();
    if (found.evaluated) {
      const double after = work.step.dot(e.residual);
      if (!demand.nearer && before <= after && after <= 0.0) return found;
      solve_for_step(equations, work, work.next_step);
      found.solved = displacement(work.next_step) <= (1.0 - 0.25 * found.kept * shorten) * full;
      if (found.solved) return found;
    }
    found.kept *= 0.5;
  }
  found.evaluated = false;
  return found;
}

/// [Choi, dissertation, Algorithm 4], with the sign of q + alpha dq and the bounds it leaves unset: Goldstein-Price on
/// |F|^2 / 2.
double Newton::line_search(Equations& equations, const VectorX& z, const VectorX& step, const VectorX* target,
                           NewtonWorkspace& work) const {
  const double before = 0.5 * work.evaluation.residual.squaredNorm();
  const double slope = -2.0 * before;  // F^T (dF/dq) dq, with dq = -J^-1 F
  double low = 0.0, high = 2.0, alpha = 1.0;
  for (int n = 0; n < 20; ++n) {
    work.trial = z + alpha * step;
    evaluate_at(equations, work.trial, false, nullptr, target, work);
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
  return alpha;
}

}  // namespace withe
