#include "integrators/inner_solve.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace withe {
namespace {

/// Initial guesses: the extrapolated motion; rest; rest, and continuation in friction's regularisation.
enum class Guess : std::size_t { extrapolated, rest, continuation };

// Iterations of a guess that may be wrong.
constexpr int kFew = 12;
// The slip over which friction grows, over that of the scene, and iterations at each.
constexpr std::array<double, 7> kRegularisation{8192.0, 4096.0, 512.0, 64.0, 16.0, 4.0, 1.0};
constexpr int kMostOfEach = 20;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// Axial forces at the start of a step [N]: where the mixed method sets out from, for those of an extrapolated motion,
/// whose edges turn along straight lines and so stretch, mean nothing.
void start_axial_force(const Equations& equations, const VectorX& q, VectorX& out) {
  const Model& model = equations.model();
  out.resize(model.edge_count);
  for (int e = 0; e < model.edge_count; ++e) {
    const int a = model.node_dof[at(model.edge_tail[at(e)])], b = model.node_dof[at(model.edge_head[at(e)])];
    double square = 0.0;
    for (int i = 0; i < model.dimension; ++i) square += (q(b + i) - q(a + i)) * (q(b + i) - q(a + i));
    out(e) = equations.elastic().stretch_stiffness(e) * (std::sqrt(square) / model.edge_length(e) - 1.0);
  }
}

/// Adds to `work.move` what supports do within a part of the step. Where that is more than the edges next to them bear,
/// the others follow as they would by the linear step.
void follow_supports(Equations& equations, const Newton& newton, const Options& options, double part,
                     const State& state, StepWorkspace& work) {
  const Assembler& assembler = equations.assembler();
  if (!options.heuristics.uses(Heuristic::supports_linear) ||
      newton.norms().leaves_alone(part * assembler.greatest_held_change(state.q, work.held.q))) {
    assembler.add_held_change(state.q, work.held.q, part, work.move);
    return;
  }
  VectorX& held = work.difference;
  held.setZero(state.q.size());
  assembler.add_held_change(state.q, work.held.q, part, held);
  const double bearable = newton.norms().cap(held);
  if (bearable < 1.0) {
    StepData& e = work.newton.data;
    work.newton.matrix.owner = nullptr;
    work.z = state.q + work.move;
    equations.evaluate(work.z, true, nullptr, e);
    VectorX& force = work.change;
    force = -e.residual;
    if (equations.assembler().solver().factorize().status == FactorStatus::ok) {
      const double little = 1e-6 * bearable;
      work.z += little * held;
      equations.evaluate(work.z, false, nullptr, e);
      force = force - (e.residual + force) / little;
      equations.assembler().solver().solve({force.data(), static_cast<std::size_t>(force.size())});
      if (force.allFinite()) work.move += force;
    }
  }
  work.move += held;
}

class InnerSolve {
 public:
  InnerSolve(Equations& equations, const Newton& newton, const Options& options, const StepPlan& plan, double h,
             const State& state, const Predictor& predictor, StepWorkspace& work)
      : equations_(equations),
        newton_(newton),
        options_(options),
        plan_(plan),
        h_(h),
        state_(state),
        predictor_(predictor),
        work_(work),
        history_(work.newton.guesses),
        regularised_(equations.contact() && equations.contact()->frictional() && equations.contact()->regularises()),
        points_(predictor.points(plan.slot)) {}

  NewtonResult run() {
    NewtonResult found;
    int spent = 0;
    for (Guess guess : {Guess::extrapolated, Guess::rest, Guess::continuation}) {
      if (!applies(guess)) continue;
      GuessRecord& record = history_.records[static_cast<std::size_t>(guess)];
      const bool sure = certain(guess);
      if (!sure && uses(Heuristic::start_record) && record.skipped()) continue;
      found = solve_from(guess);
      spent += found.iterations;
      if (!sure) record.note(found.converged);
      if (found.converged) break;
    }
    found.iterations = spent;
    return found;
  }

 private:
  bool applies(Guess guess) const {
    if (guess == Guess::extrapolated) return points_ != 0 && uses(Heuristic::extrapolated_start);
    return guess == Guess::rest || (regularised_ && uses(Heuristic::start_continuation));
  }

  /// What is always tried: rest, and where steps are not cut, continuation. Others only while they help.
  bool certain(Guess guess) const {
    return guess == Guess::rest || (guess == Guess::continuation && !options_.adaptive);
  }

  bool uses(Heuristic h) const { return options_.heuristics.uses(h); }

  /// Puts the guess into `work.z`.
  void guess_at(Guess guess) {
    if (guess == Guess::extrapolated) {
      predictor_.extrapolate(state_.time + 0.5 * plan_.dt, points_, work_.mean);
      work_.move = h_ * state_.v + (h_ * h_) * work_.mean;
    } else {
      work_.move.setZero(state_.q.size());
    }
    equations_.assembler().project(work_.move);
    work_.move *= newton_.norms().cap(work_.move);
    follow_supports(equations_, newton_, options_, h_ / plan_.dt, state_, work_);
    work_.z = state_.q + work_.move * equations_.allowed(state_.q, work_.move);
    start_axial_force(equations_, state_.q, work_.newton.axial_force);
  }

  NewtonResult solve_from(Guess guess) {
    guess_at(guess);
    if (guess == Guess::continuation) return solve_by_continuation();
    // What need not lead to the solution is rejected after few iterations; what surfaces cut short soon converges in
    // one scene, and leads nowhere in another.
    const bool trial = guess == Guess::extrapolated && uses(Heuristic::few_iterations);
    const NewtonResult found =
        newton_.solve(equations_, work_.z,
                      {.max_iterations = trial ? std::min(kFew, options_.max_iterations) : options_.max_iterations,
                       .interval = h_,
                       .give_up_if_cut = trial && history_.cut.waits > 0},
                      work_.newton);
    if (trial && found.cut && !history_.cut.skipped()) history_.cut.note(found.converged);
    return found;
  }

  /// Where surfaces stop or turn round, friction jumps within a slip far smaller than an iteration, and Newton's method
  /// goes to and fro across it. So the slip over which it grows is made great first, and small little by little: what
  /// sticks slips in proportion to it, which leads from one solution to the next.
  NewtonResult solve_by_continuation() {
    NewtonResult found;
    VectorX& last = work_.velocity;
    int spent = 0;
    for (std::size_t k = 0; k < kRegularisation.size(); ++k) {
      if (k > 1) {
        const double share =
            (kRegularisation[k] - kRegularisation[k - 1]) / (kRegularisation[k - 1] - kRegularisation[k - 2]);
        work_.move = share * (work_.z - last);
        last = work_.z;
        work_.z += equations_.allowed(work_.z, work_.move) * work_.move;
      } else {
        last = work_.z;
      }
      found = newton_.solve(equations_, work_.z,
                            {.max_iterations = kMostOfEach, .interval = h_, .regularisation = kRegularisation[k]},
                            work_.newton);
      spent += found.iterations;
      if (!found.converged) break;
    }
    found.iterations = spent;
    return found;
  }

  Equations& equations_;
  const Newton& newton_;
  const Options& options_;
  const StepPlan& plan_;
  double h_;
  const State& state_;
  const Predictor& predictor_;
  StepWorkspace& work_;
  GuessHistory& history_;
  bool regularised_;  ///< whether friction's regularisation is what Newton's method may fail on
  int points_;        ///< of the extrapolation
};

}  // namespace

NewtonResult solve_inner(Equations& equations, const Newton& newton, const Options& options, const StepPlan& plan,
                         double h, const State& state, const Predictor& predictor, StepWorkspace& work) {
  return InnerSolve(equations, newton, options, plan, h, state, predictor, work).run();
}

}  // namespace withe
