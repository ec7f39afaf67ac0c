#include "integrators/statics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "integrators/step_parts.hpp"
#include "integrators/stiffness_signs.hpp"
#include "steps/elastic_forces.hpp"

namespace withe {
namespace {

/// Greatest angle by which an edge has left its source frame [rad]; a load increment is cut beyond a right angle.
bool turned_too_far(const State& state, const Configuration& c, bool planar) {
  if (planar) return false;
  for (std::size_t e = 0; e < c.edge.size(); ++e)
    if (dot(state.tangent[e], c.edge[e].tangent) < 0.0) return true;
  return false;
}

// Correction after which a point on the way needs no other, over the length of the scene: Newton's method leaves an
// error of about its square, 1e-12.
constexpr double kMaxWaypointCorrection = 1e-6;
// Turn of edges between two points of a path, by the linear solution [rad]. Their frames are known up to a right angle.
constexpr double kMaxPointTurn = 1.0;
// Turn of edges that a whole load would cause by the linear solution, from which on the stiffness is rounding [rad].
constexpr double kMinSingularTurn = 1e9;
// Increment over the whole path, or over that which turns edges by kMaxPointTurn, whichever is shorter. The path has
// ended where a point beyond a shorter increment is not found: after six tries.
constexpr double kMinIncrement = 1.0 / 64.0;
// Corrections of a point that one ring may spoil: its rod sticks, slips, or slips the other way.
constexpr int kMaxKinksOfRing = 2;
// Points of a path. A support that goes a thousand lengths away tears the scene along: settling there finds it.
constexpr int kMaxPoints = 1000;
// Jumps between branches on the way to one equilibrium.
constexpr int kMaxJumps = 20;
// Increments from the end of a path to the start of the dynamic continuation, in lengths of the last one tried.
constexpr double kJumpIncrements = 4.0;
// Turn in a jump from which on the branch has changed [rad].
constexpr double kMinJumpTurn = 0.25 * kMaxPointTurn;
// Displacement in an interval over the length of the scene, below which the scene is slow, and below which Newton's
// method without inertia takes it to its equilibrium.
constexpr double kMaxSlowMove = 1e-4, kMaxNearMove = 1e-7;
// Displacement, over that of the last failure of Newton's method without inertia, at which the method is tried again.
constexpr double kMaxRetryMove = 0.1;
// Intervals in which a scene settles.
constexpr int kMaxIntervals = 400;
// Intervals after which they may be twice as long, where loads without a potential drive the scene round.
constexpr int kIntervalsPerDoubling = 50;
// Difference of the gains on the two sides of a saddle, over the gain, up to which the sides count as equal.
constexpr double kMaxGainDifference = 1e-6;

class Statics {
 public:
  Statics(Equations& equations, const Newton& newton, const Options& options, Parameters& parameters,
          const Actuation* before, const Boundary& boundary, Saddles saddles, State& state, NewtonWorkspace& work)
      : equations_(equations),
        newton_(newton),
        options_(options),
        parameters_(parameters),
        leaves_saddles_(saddles == Saddles::leave),
        state_(state),
        work_(work),
        path_(equations, newton, parameters, boundary,
              growing(equations, parameters, boundary.prescribed, state, work, before), state, work),
        signs_(equations, newton.norms(), work.counters) {}

  StaticResult run() {
    StaticResult result;
    find(result);
    result.converged = result.converged && !breaks_loops(equations_, state_.q);
    if (!result.converged) note_imbalance(result.newton);
    return result;
  }

 private:
  void find(StaticResult& result) {
    const State start = state_;
    result.converged = follow(result);
    if (!result.converged) {
      result.branch_changed = true;
      path_.go_back(start, 0.0);
      path_.go_to(1.0);
      if (!path_.hold(1.0, state_.q)) return;
      path_.accept(state_.q);
      result.converged = settle(1.0, result) || (equations_.has_potential() && descend(1000, result.newton));
    }
    if (!result.converged) return;
    result.stable = stable(1.0);
    for (int tries = 0; leaves_saddles_ && tries < 4 && !result.stable && equations_.has_potential_here(); ++tries) {
      result.branch_changed = true;
      leave_saddle(1.0, tries);
      result.converged = settle(1.0, result) || (equations_.has_potential() && descend(1000, result.newton));
      if (!result.converged) return;
      result.stable = stable(1.0);
    }
  }

  /// Sets the residual and its worst row to those of static balance at the end of the search. The residual of the last
  /// interval contains inertia.
  void note_imbalance(NewtonResult& last) {
    path_.go_to(1.0);
    path_.evaluate(state_.q, false, nullptr);
    newton_.balance(work_.data, last);
    last.worst_row = newton_.worst_row(work_.data.residual);
  }

  /// Progress along the path.
  struct Walk {
    double reached = 0.0, longest = 1.0;  ///< factors: of the last point, of an increment
    int cuts = 0, jumps = 0, points = 0;
    bool was_stable = false;
  };
  enum class Point {
    on_path,
    left,  ///< the scene has settled elsewhere
    lost,
  };

  /// Follows the path from the present state to its end. False where not even a jump leads on.
  bool follow(StaticResult& result) {
    path_.start_out_of_balance();
    evaluate(0.0);
    neutral_ = signs_.neutral(state_, work_.data);
    if (neutral_) path_.hold_neutral();
    Walk walk;
    while (walk.reached < 1.0) {
      if (walk.cuts == 0) {
        const Point point = begin_point(walk, result);
        if (point == Point::lost) return false;
        if (point == Point::left) continue;
      }
      if (!walk_on(walk, result)) return false;
    }
    result.newton.converged = true;
    return true;
  }

  /// Finds the tangent at a point, and leaves the path where the scene falls or is stable no more.
  Point begin_point(Walk& walk, StaticResult& result) {
    if (++walk.points > kMaxPoints) return Point::lost;
    path_.go_to(walk.reached);
    path_.find_tangent(tangent_);
    ++result.newton.iterations;
    if (walk.points == 1 && leaves_saddles_ && falls())
      return let_fall(walk.reached, result) ? Point::left : Point::lost;
    // A branch that was stable and is so no more is left where that happens.
    if (leaves_saddles_ && walk.was_stable && !firm(walk.reached) && equations_.has_potential() &&
        !stable(walk.reached)) {
      result.branch_changed = true;
      leave_saddle(walk.reached, 0);
      if (!settle(walk.reached, result)) return Point::lost;
      walk.was_stable = false;
      return Point::left;
    }
    walk.was_stable = firm(walk.reached);
    return Point::on_path;
  }

  /// Goes to the next point, tries a smaller increment, or jumps. False after too many jumps, or if one fails.
  bool walk_on(Walk& walk, StaticResult& result) {
    // The tangent of an unsupported mechanism is rounding: its path ends where it begins.
    const bool singular = tangent_.found && tangent_.turn > kMinSingularTurn;
    tangent_.found = tangent_.found && !singular;
    const double by_turn = tangent_.found ? kMaxPointTurn / tangent_.turn : 1.0;
    const double increment = std::min({1.0 - walk.reached, walk.longest, by_turn});
    const double next = increment == 1.0 - walk.reached ? 1.0 : walk.reached + increment;
    if (!singular && reach(next, next - walk.reached, result.newton)) {
      walk.reached = next;
      walk.longest = walk.cuts == 0 ? std::max(2.0 * walk.longest, 2.0 * increment) : increment;
      walk.cuts = 0;
      return true;
    }
    walk.longest = increment * (walk.cuts == 0 ? 0.25 : 0.5);
    ++walk.cuts;
    if (!singular && increment > kMinIncrement * std::min(by_turn, 1.0)) return true;
    if (++walk.jumps > kMaxJumps) return false;
    const double beyond = beyond_jump(walk.reached, increment);
    if (!jump(beyond, beyond - walk.reached, result)) return false;
    walk.reached = beyond;
    walk.longest = kJumpIncrements * increment;
    walk.cuts = 0;
    return true;
  }

  int most_iterations() const { return std::min(kMaxPathIterations, options_.max_iterations); }

  /// Iterations for the border of slip. Where Coulomb's friction holds a limp rod, the border of the slipping contacts
  /// advances by one contact per iteration. The solution follows when the border has arrived, so these iterations are
  /// no sign that there is no solution.
  int border_iterations() const {
    return equations_.contact() && !equations_.has_potential() ? equations_.contact()->count() : 0;
  }

  /// True if the present point of the path is stable by the pivots of its matrix. A matrix with multipliers has no such
  /// signs.
  bool firm(double factor) {
    if (equations_.loops()) return stable(factor);
    return tangent_.factorization.status == FactorStatus::ok && tangent_.factorization.negative_pivots == 0;
  }

  /// True if the residual force of the present state does not hold the scene in place. The scene falls then, as a body
  /// does that is let go between two wells. A path on which that force fades would lead back to the saddle between the
  /// wells. Surfaces that an obstacle has been pushed into are to leave each other, not to fall.
  bool falls() {
    // Signs of pivots are known of symmetric matrices only.
    if (!equations_.has_potential_here() || (equations_.has_potential() && firm(0.0)) || !tangent_.found) return false;
    if (equations_.contact() && equations_.contact()->contacts().depth() > kMaxDepth) return false;
    return newton_.norms().displacement(tangent_.rate) > kMaxNearMove * equations_.model().length_scale && !stable(0.0);
  }
  bool let_fall(double& reached, StaticResult& result) {
    const double beyond = beyond_jump(reached, kMinIncrement);
    if (!jump(beyond, 0.0, result)) return false;
    reached = beyond;
    return true;
  }

  /// A scene that continues dynamically may receive all forces at once, but not all motion of supports.
  double beyond_jump(double reached, double increment) const {
    return path_.supports_move() ? std::min(1.0, reached + kJumpIncrements * increment) : 1.0;
  }

  /// The point of the path at the factor `next`, predicted along the tangent.
  bool reach(double next, double increment, NewtonResult& last) {
    path_.go_to(next);
    // With contact, corrections shrink less than on smooth paths, but they are no longer than the prediction: surfaces
    // that slide without friction would otherwise slide away. Rings have kinks.
    const bool touching = equations_.contact() && equations_.contact()->count() > 0;
    const int rings = equations_.hands() ? equations_.hands()->rings().count() : 0;
    Prediction prediction{.length = 0.0, .strict = !touching, .kinks = kMaxKinksOfRing * rings};
    bool predicted = tangent_.found;
    if (predicted) {
      step_ = increment * tangent_.rate;
      prediction.length = newton_.norms().displacement(step_);
      if (next < 1.0 && !touching && rings == 0)
        prediction.enough = kMaxWaypointCorrection * equations_.model().length_scale;
      // Axial forces come from the linear solution: the edges of the prediction stretch as they turn.
      equations_.evaluate(state_.q, false, nullptr, work_.data);
      predict_axial_force(equations_.problem(), work_.data, step_, work_.axial_force);
      z_ = state_.q + step_;
      if (!path_.hold(next, z_)) return false;
      predicted = clear_way(z_);
    }
    if (!predicted) {
      z_ = state_.q;
      if (!path_.hold(next, z_) || !clear_way(z_)) return false;
      prediction.length = newton_.norms().displacement(z_ - state_.q);
      prediction.strict = prediction.forces = false;
    }
    const NewtonResult r = newton_.solve(equations_, z_,
                                         {.target = &path_.target(),
                                          .max_iterations = most_iterations(),
                                          .free_steps = border_iterations(),
                                          .hold_neutral = neutral_,
                                          .predicted = predicted || touching ? &prediction : nullptr},
                                         work_);
    note(r, last);
    last.step = r.step;
    if (!r.converged || turned_too_far(state_, work_.data.configuration, equations_.model().planar())) return false;
    path_.accept(z_);
    return true;
  }

  static void note(const NewtonResult& r, NewtonResult& last) {
    last.iterations += r.iterations;
    last.residual = r.residual;
    last.worst_row = r.worst_row;
  }

  /// True if the scene may go at once to z without pushing surfaces through each other.
  bool clear_way(const VectorX& z) {
    return !equations_.contact() || equations_.allowed(state_.q, z - state_.q) == 1.0;
  }

  /// Jump at the end of the path: the scene moves dynamically to the next equilibrium.
  bool jump(double next, double increment, StaticResult& result) {
    path_.go_to(next);
    const VectorX before = state_.q;
    z_ = state_.q;
    if (tangent_.found && path_.supports_move()) z_ += increment * tangent_.rate;
    if (!path_.hold(next, z_)) return false;
    if (!clear_way(z_)) {
      z_ = state_.q;
      if (!path_.hold(next, z_) || !clear_way(z_)) return false;
    }
    path_.accept(z_);
    if (!settle(next, result)) return false;
    VectorX change = state_.q - before;
    for (int dof : equations_.model().frame_dof) change.segment(dof, equations_.model().frame_size()).setZero();
    if (newton_.norms().turn(change) > kMinJumpTurn) result.branch_changed = true;
    return true;
  }

  /// Pseudo-transient continuation: backward Euler from rest, repeatedly, with intervals that grow as the scene
  /// settles. The intervals are no physical time: rate-dependent resistance does not act, so equilibria do not depend
  /// on viscosity or drag. Each interval minimises the potential plus M |z - q|^2 / (2 h^2), which is convex where the
  /// interval begins. Newton's method is then neither drawn back to a saddle, nor across it. Mixed Newton keeps slender
  /// rods from slow progress. When almost nothing moves, Newton's method without inertia ends the search, unless it
  /// leads away, for example back to a saddle.
  ///
  /// Loads without a potential may drive the scene around its equilibria for a long time. Their problem is monotone,
  /// instead of convex, where an interval begins. Intervals stay short enough for this only until the scene is slow.
  /// After every kIntervalsPerDoubling intervals the longest interval doubles, because longer intervals damp more.
  bool settle(double factor, StaticResult& result) {
    const bool conservative = equations_.has_potential();
    evaluate(factor);
    const double stiffness = stiffness_here();
    double potential = work_.data.potential;
    energy_scale_ = std::max(energy_scale_, std::abs(potential));
    double h = 1e2 / std::sqrt(stiffness), moved = INFINITY;
    const double longest = 1e12 * h, shortest = 1e-6 * h, of_waves = 1e4 * h,
                 slow = kMaxSlowMove * equations_.model().length_scale;
    double near = kMaxNearMove * equations_.model().length_scale;
    for (int k = 0; k < kMaxIntervals && h > shortest; ++k) {
      state_.v.setZero();
      // A neutral motion keeps intervals from growing further.
      const bool still = neutral_ && h >= of_waves && moved < near;
      const bool at_rest = h >= longest || (still && (!conservative || stable(factor)));
      const double beyond = conservative ? 1.0 : std::exp2(k / kIntervalsPerDoubling);
      if (!at_rest && (conservative || moved >= slow)) h = beyond * definite_interval(factor, h / beyond, shortest);
      const int border = border_iterations();
      const NewtonResult r = solve_interval(at_rest ? 0.0 : h, border, result.newton);
      const double found = work_.data.potential - path_.target().dot(z_);
      const double way = newton_.norms().displacement(z_ - state_.q);
      if (r.converged && (!conservative || leads_down(potential, found, at_rest && way > slow))) {
        path_.accept(z_);
        if (at_rest) return true;
        moved = way;
        potential = found;
        h = std::min(longest, h * growth(r.iterations - border));
      } else if (at_rest) {
        near = kMaxRetryMove * moved;
        h = std::min(h, 0.25 * longest);
      } else {
        h *= 0.25;
      }
    }
    result.restless = !conservative && h > shortest;
    return false;
  }

  /// Greatest stiffness over mass at the present state [1/s^2]. Free bodies have none, but they fall a length of the
  /// scene in a time.
  double stiffness_here() const {
    const VectorX& mass = equations_.mass().rows;
    const double stiffness = equations_.assembler().greatest_stiffness(mass);
    if (stiffness > 0.0) return stiffness;
    const double size = equations_.model().length_scale;
    double fastest = 1e-300;
    for (const int dof : equations_.model().node_dof)
      if (mass(dof) > 0.0)
        fastest = std::max(fastest,
                           work_.data.residual.segment(dof, equations_.model().dimension).norm() / (mass(dof) * size));
    return fastest;
  }

  /// True if an interval lowers the potential, within rounding. A motion that goes `far` in an interval without inertia
  /// is neutral, or was at a saddle, which lies higher now that waves have run out: it must not lead up at all.
  bool leads_down(double before, double after, bool far) const {
    const double sum = std::abs(before) + std::abs(after), rise = after - before - least_energy();
    return rise <= 1e-10 * sum && !(far && rise > 1e-14 * sum);
  }

  /// Next interval over the last one, by the iterations that it took.
  static double growth(int iterations) { return iterations <= 4 ? 10.0 : iterations <= 8 ? 3.0 : 1.0; }

  /// An interval of backward Euler from rest, which ends in z; of no length: equilibrium.
  NewtonResult solve_interval(double h, int border, NewtonResult& last) {
    equations_.begin(state_, parameters_, h > 0.0 ? StepRule::settling : StepRule::statics, h, path_.prescribed());
    z_ = state_.q;
    NewtonResult r = newton_.solve(equations_, z_,
                                   {.target = &path_.target(),
                                    .max_iterations = kMaxPathIterations,
                                    .free_steps = border,
                                    .hold_neutral = neutral_},
                                   work_);
    note(r, last);
    r.converged = r.converged && !turned_too_far(state_, work_.data.configuration, equations_.model().planar());
    return r;
  }

  /// The longest of h and its halves in which the symmetric part of the stiffness plus M / h^2 is positive definite at
  /// the present state; `shortest` or less where it is so in none.
  double definite_interval(double factor, double h, double shortest) {
    evaluate(factor);
    const VectorX weight = signs_.weights();
    LinearSolver& stiffness = signs_.symmetric_part();
    while (h > shortest && !signs_.definite(stiffness, 1.0 / (h * h), weight)) h *= 0.5;
    return h;
  }

  /// Levenberg-Marquardt on the potential: every accepted step lowers it.
  bool descend(int max_steps, NewtonResult& last) {
    VectorX z;
    if (equations_.loops()) return false;  // the potential has a saddle, not a minimum, in the multipliers
    path_.go_to(1.0);
    const VectorX weight = signs_.weights();
    double damping = 0.0;
    for (int k = 0; k < max_steps; ++k) {
      work_.poll();
      evaluate(1.0);
      const StepData here = work_.data;
      const Balance balance = newton_.balance(here, last);
      if (damping == 0.0) {
        const double stiffness = equations_.assembler().greatest_stiffness(weight);
        damping = 1e-6 * stiffness;
        lowest_ = 1e-12 * stiffness;
      }
      if ((balance.floor || (balance.either && damping <= lowest_ * 1e2)) ||
          (k % 10 == 9 && damping <= lowest_ * 1e4)) {
        if (finish(here.potential, last)) return true;
        evaluate(1.0);
      }
      const bool lower = find_lower(here, weight, damping, z);
      ++last.iterations;
      ++work_.counters.iterations;
      if (!lower) return false;
      path_.accept(z);
      damping = std::max(damping * 0.2, lowest_);
    }
    return false;
  }

  /// Near a minimum full Newton steps finish the work, if they stay near.
  bool finish(double energy, NewtonResult& last) {
    VectorX z = state_.q;
    const NewtonResult r = newton_.solve(equations_, z, {.max_iterations = 30}, work_);
    last.iterations += r.iterations;
    last.residual = r.residual;
    if (!r.converged || work_.data.potential > energy + 1e-9 * std::abs(energy) + least_energy() ||
        turned_too_far(state_, work_.data.configuration, equations_.model().planar()))
      return false;
    path_.accept(z);
    return true;
  }

  /// A damped step from `here` to a lower potential, with more damping until there is one.
  bool find_lower(const StepData& here, const VectorX& weight, double& damping, VectorX& z) {
    VectorX step;
    for (int tries = 0; tries < 40; ++tries) {
      LinearSolver& solver = equations_.assembler().solver();
      if (!signs_.definite(solver, damping, weight)) {
        damping *= 8.0;
        continue;
      }
      step = -here.residual;
      solver.solve({step.data(), static_cast<std::size_t>(step.size())});
      if (newton_.norms().cap(step) < 1.0 || equations_.allowed(state_.q, step) < 1.0) {
        damping *= 4.0;
        continue;
      }
      z = state_.q + step;
      equations_.evaluate(z, false, nullptr, work_.data);
      const double gain = here.residual.dot(step);  // negative
      const double rounding = 1e-13 * (std::abs(here.potential) + here.magnitude.cwiseAbs().dot(step.cwiseAbs()));
      if (std::isfinite(work_.data.potential) && work_.data.potential - here.potential <= 0.1 * gain + rounding)
        return true;
      damping *= 4.0;
    }
    return false;
  }

  /// Evaluates the present state, with loads and supports at a factor: its imbalance, its matrix, and the potential
  /// of the problem with this imbalance.
  void evaluate(double factor) {
    path_.go_to(factor);
    path_.evaluate(state_.q, true, nullptr);
  }

  bool stable(double factor) {
    evaluate(factor);
    return signs_.stable(state_, work_.data);
  }

  /// Moves along the lowest mode, to the side with the lower potential, for any orientation of the scene. Every other
  /// try goes to the other side. The sides of a symmetric scene differ only by rounding.
  void leave_saddle(double factor, int tries) {
    evaluate(factor);
    const double here = work_.data.potential;
    VectorX way = signs_.lowest_mode(tries);
    way *= 1e-3 * equations_.model().length_scale / std::max(newton_.norms().displacement(way), 1e-300);
    way *= newton_.norms().cap(way);
    const VectorX ahead = state_.q + way, behind = state_.q - way;
    const auto gain = [&](const VectorX& q) {
      path_.evaluate(q, false, nullptr);
      return work_.data.potential - here;
    };
    const double gain_ahead = gain(ahead), gain_behind = gain(behind);
    const bool falls_ahead = gain_ahead - gain_behind <= kMaxGainDifference * std::abs(gain_ahead),
               first = tries % 2 == 0;
    path_.accept(falls_ahead == first ? ahead : behind);
  }

  /// Rounding error of the potential where little of it is left: a coil that relaxes into its natural shape ends at
  /// none.
  double least_energy() const { return 1e-14 * energy_scale_; }

  Equations& equations_;
  const Newton& newton_;
  const Options& options_;
  Parameters& parameters_;
  bool leaves_saddles_;
  State& state_;
  NewtonWorkspace& work_;
  double energy_scale_ = 0.0;  ///< greatest potential met [J]
  double lowest_ = 0.0;
  Homotopy path_;
  Homotopy::Tangent tangent_;
  StiffnessSigns signs_;
  bool neutral_ = false;  ///< true if a motion is neutral, and is held by a shift as small as rounding
  VectorX step_, z_;
};

}  // namespace

StaticResult find_equilibrium(Equations& equations, const Newton& newton, const Options& options,
                              Parameters& parameters, const Actuation* before, const Boundary& boundary,
                              Saddles saddles, State& state, NewtonWorkspace& work) {
  return Statics(equations, newton, options, parameters, before, boundary, saddles, state, work).run();
}

}  // namespace withe
