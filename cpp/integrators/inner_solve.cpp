#include "integrators/inner_solve.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "elasticity/stretch.hpp"

namespace withe {
namespace {

/// Initial guesses of a step, in the order in which they are tried. The last two cost nothing if an earlier guess leads
/// to the solution.
enum class Guess : std::size_t {
  /// The extrapolated motion.
  accelerated,
  /// Rest: the first iteration is the linear step.
  rest,
  /// Rest, and continuation in friction's regularisation. A rod that hits a rough post at 42 m/s within one step needs
  /// shorter steps without it.
  continuation,
  /// A steady motion, without axial forces as unknowns. A soft helix whose edges turn by a radian in a step needs
  /// shorter steps without it.
  plain,
};
constexpr std::array kGuesses{Guess::accelerated, Guess::rest, Guess::continuation, Guess::plain};

// Iterations from the extrapolated motion, which may not converge.
constexpr int kMaxTrialIterations = 12;
// Slip tolerance of friction, over that of the scene, in the steps of the continuation.
constexpr std::array<double, 7> kRegularisation{8192.0, 4096.0, 512.0, 64.0, 16.0, 4.0, 1.0};

// Steps in which supports get to their places, and what may be left of the way, over the size of the scene and the
// greatest displacement.
constexpr int kMaxSupportSteps = 8;
constexpr double kReached = 1e-14;

/// Axial forces at the start of a step [N]. The mixed method starts from these. Axial forces of an extrapolated motion
/// would be meaningless, because its edges turn along straight lines and so stretch.
void start_axial_force(const Equations& equations, const VectorX& q, VectorX& out) {
  const Model& model = equations.model();
  const ElasticCoefficients& k = equations.elastic();
  out.resize(model.edge_count);
  for (int e = 0; e < model.edge_count; ++e) {
    const int a = model.tail_dof[at(e)], b = model.head_dof[at(e)];
    double square = 0.0;
    for (int i = 0; i < model.dimension; ++i) square += (q(b + i) - q(a + i)) * (q(b + i) - q(a + i));
    out(e) = axial_force(std::sqrt(square), model.edge_length(e), k.stretch_stiffness(e), k.stretch_natural(e));
  }
}

/// The way of supports that is left from q + `move` to their places in a part of the step; returns the greatest.
double way_of_supports(const Equations& equations, double part, const State& state, const VectorX& move,
                       VectorX& held) {
  const Assembler& assembler = equations.assembler();
  held.setZero(state.q.size());
  assembler.add_held_change(state.q, equations.problem().prescribed->held.q, part, held);
  assembler.add_held_part(move, -1.0, held);
  return held.lpNorm<Eigen::Infinity>();
}

/// Adds the step of Newton's method from q + `move` in which supports move by `held`. Where that is farther than rods
/// can deform, they respond to a small share of it. Without a factorisation rods do not respond.
void step_with_supports(Equations& equations, const Newton& newton, const State& state, const VectorX& held,
                        StepWorkspace& work) {
  StepData& e = work.newton.data;
  work.newton.matrix.owner = nullptr;
  work.z = state.q + work.move;
  equations.evaluate(work.z, true, nullptr, e);
  VectorX& force = work.change;
  force = -e.residual;
  if (equations.assembler().solver().factorize().status == FactorStatus::ok) {
    const double little = 1e-6 * newton.norms().cap(held);
    work.z += little * held;
    equations.evaluate(work.z, false, nullptr, e);
    force = force - (e.residual + force) / little;
    equations.assembler().solver().solve({force.data(), static_cast<std::size_t>(force.size())});
    if (force.allFinite()) work.move += force;
  }
  work.move += held;
}

/// Adds the displacement of supports within a part of the step to `work.move`. If supports move farther than the edges
/// next to them can deform, the rod follows by the linear step. A clamp that jumps by a hundred edges in one step needs
/// this; otherwise Newton's method fails, and the step is subdivided.
void follow_supports(Equations& equations, const Newton& newton, const Options& options, double part,
                     const State& state, StepWorkspace& work) {
  const Assembler& assembler = equations.assembler();
  const VectorX& target = equations.problem().prescribed->held.q;
  if (!options.heuristics.uses(Heuristic::supports_linear) ||
      newton.norms().leaves_alone(part * assembler.greatest_held_change(state.q, target))) {
    assembler.add_held_change(state.q, target, part, work.move);
    return;
  }
  VectorX& held = work.difference;
  held.setZero(state.q.size());
  assembler.add_held_change(state.q, target, part, held);
  const double bearable = newton.norms().cap(held);
  if (bearable < 1.0)
    step_with_supports(equations, newton, state, held, work);
  else
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
        records_(work.newton.guesses),
        frictional_(equations.contact() && equations.contact()->frictional()),
        regularised_(frictional_ && equations.contact()->regularises()),
        starts_at_rest_(predictor.choice(plan.slot).points == 0 && (frictional_ || state.v.isZero(0.0))) {}

  NewtonResult run() {
    NewtonResult found;
    int spent = 0;
    for (Guess guess : kGuesses) {
      if (!applies(guess)) continue;
      GuessRecord& record = records_[static_cast<std::size_t>(guess)];
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
    if (guess == Guess::accelerated && (!uses(Heuristic::start_accelerated) || starts_at_rest_)) return false;
    if (guess == Guess::plain && !uses(Heuristic::start_plain)) return false;
    if (guess == Guess::continuation && !uses(Heuristic::start_continuation)) return false;
    return guess != Guess::continuation || regularised_;
  }

  /// True if a guess is always tried: rest, and, without friction, all but the extrapolated motion. Other guesses are
  /// tried as `GuessRecord` lets them.
  bool certain(Guess guess) const {
    if (guess == Guess::rest) return true;
    return guess != Guess::accelerated && !(frictional_ && options_.adaptive);
  }

  bool uses(Heuristic h) const { return options_.heuristics.uses(h); }

  /// Writes the guess to `work.z`; returns false if surfaces are in the way of supports.
  bool guess_at(Guess guess) {
    if (guess == Guess::accelerated) {
      predictor_.predict({state_.time + 0.5 * plan_.dt, h_, plan_.dt, plan_.slot}, state_.v, work_.mean);
      work_.move = h_ * work_.mean;
    } else {
      work_.move = (guess == Guess::plain ? h_ : 0.0) * state_.v;
    }
    equations_.assembler().project(work_.move);
    work_.move *= newton_.norms().cap(work_.move);
    if (equations_.contact() && uses(Heuristic::hold_sticking)) equations_.contact()->hold_sticking(state_, work_.move);
    follow_supports(equations_, newton_, options_, h_ / plan_.dt, state_, work_);
    const double allowed = equations_.allowed(state_.q, work_.move);
    const bool reached = allowed == 1.0 || reach_supports(allowed);
    if (allowed == 1.0) work_.z = state_.q + work_.move;
    start_axial_force(equations_, state_.q, work_.newton.axial_force);
    return reached;
  }

  /// Moves supports to their places from where surfaces have stopped a guess, by steps of Newton's method.
  bool reach_supports(double allowed) {
    work_.move *= allowed;
    const double part = h_ / plan_.dt;
    VectorX &left = work_.difference, &before = work_.mean;
    for (int k = 0; k <= kMaxSupportSteps; ++k) {
      const double way = way_of_supports(equations_, part, state_, work_.move, left);
      work_.z = state_.q + work_.move;
      if (way <= kReached * std::max(equations_.model().length_scale, work_.move.lpNorm<Eigen::Infinity>()))
        return true;
      before = work_.move;
      step_with_supports(equations_, newton_, state_, left, work_);
      work_.z = state_.q + before;
      work_.change = work_.move - before;
      work_.move = before + equations_.allowed(work_.z, work_.change) * work_.change;
    }
    return false;
  }

  NewtonResult solve_from(Guess guess) {
    if (!guess_at(guess)) return {};
    if (guess == Guess::continuation) return solve_by_continuation();
    // The extrapolated motion need not lead to the solution, and is rejected early.
    const bool trial = guess == Guess::accelerated && uses(Heuristic::few_iterations);
    return newton_.solve(
        equations_, work_.z,
        {.max_iterations = trial ? std::min(kMaxTrialIterations, options_.max_iterations) : options_.max_iterations,
         .mixed = guess != Guess::plain,
         .interval = h_},
        work_.newton);
  }

  /// Continuation in the slip tolerance. Where surfaces stop or reverse, friction jumps within a slip far smaller than
  /// an iteration, and the iterates of Newton's method alternate across the jump. So the slip tolerance is large at
  /// first and decreases in steps. The slip of sticking surfaces is proportional to the tolerance, which leads from one
  /// solution to the next.
  NewtonResult solve_by_continuation() {
    NewtonResult found;
    int spent = 0;
    for (const double regularisation : kRegularisation) {
      found = newton_.solve(equations_, work_.z,
                            {.max_iterations = kMaxPathIterations, .interval = h_, .regularisation = regularisation},
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
  GuessRecords& records_;
  bool frictional_;
  bool regularised_;  ///< true if Newton's method may fail because of friction's regularisation
  /// True if no past motion predicts the step better than the present velocity, and the velocity is zero or friction
  /// acts. With zero velocity the extrapolated motion is rest. With friction, the velocity lets surfaces slip that
  /// stick. Energy-momentum steps of twelve rods that pile up take 17 % more iterations without.
  bool starts_at_rest_;
};

}  // namespace

NewtonResult solve_inner(Equations& equations, const Newton& newton, const Options& options, const StepPlan& plan,
                         double h, const State& state, const Predictor& predictor, StepWorkspace& work) {
  return InnerSolve(equations, newton, options, plan, h, state, predictor, work).run();
}

}  // namespace withe
