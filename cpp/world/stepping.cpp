#include <algorithm>
#include <cmath>
#include <utility>

#include "common/check.hpp"
#include "common/text.hpp"
#include "run/checks.hpp"
#include "run/drive.hpp"
#include "run/energy_watch.hpp"
#include "run/journal.hpp"
#include "run/squeeze.hpp"
#include "run/step_watch.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

// Number of attempts with stiffer contact before a step counts as failed.
constexpr int kMaxStiffenings = 4;
// Inner steps times nodes that error control may take in one time step by default: about half a minute on one core.
constexpr double kMaxWork = 3e7;
// Steps between two checks of the mesh, and between two checks of the energy, each of which costs as much as a step.
constexpr int kResolutionPeriod = 64, kEnergyPeriod = 16;
// Steps between two estimates of the error of the other order, each of which costs a linear solve.
constexpr int kOrderPeriod = 4;
// Greatest turn in a step of frames and edges that supports hold [rad]. In the middle of a step a frame that turns by w
// has turned by 2 atan(tan(w / 2) / 2), but an edge's angle by w / 2. A rod between them is twisted by the difference,
// w^3 / 32. In energy-momentum steps edges that turn by w have the rate 2 tan(w / 2) / dt. Parts of fourth-order steps
// twist there and back, and so turn by less.
constexpr double kMaxHeldTurn = 0.25, kMaxHeldTurnOfPart = 0.15;
// Share of the kinetic energy that forces of impacts may add in a step, see ReboundWork.
constexpr double kMaxReboundGain = 1e-4;
/// True if a shorter step reduced an excess. A user's function that jumps within a step jumps by as much in a shorter
/// one.
bool lessens(double now, double before) { return before == 0.0 || now < 0.9 * before; }

}  // namespace

/// One time step of `duration`, in equal parts where it does not converge or is not accurate enough.
void World::Implementation::advance(double duration) {
  const double base = state.time;
  if (actuation_changed) check_fibre_strain(model, parameters, configuration(), state.time);
  account_for_settings();
  if (!first_energy) begin_energy_watch();
  begin_crossing_watch();
  mark.motions = motions;
  mark.history = *this;
  systems.mark();
  spread_jumps(model, state, duration, motions, obstacle_motions);
  try {
    advance_in_parts(duration);
  } catch (...) {
    if (state.time == base) {  // what was tried leaves no trace
      motions = mark.motions;
      static_cast<StepHistory&>(*this) = mark.history;
      systems.return_to_mark();
    } else {
      systems.forget_matrix();
    }
    throw;
  }
  if (steps_taken % kEnergyPeriod == 0) {
    check_energy();
    check_squeeze();
  }
  if (steps_taken % kResolutionPeriod == 0) check_resolution();
  check_crossings();
}

void World::Implementation::advance_in_parts(double duration) {
  const double base = state.time;
  composable = may_compose();
  const StepControl control(options, composable);
  StepProgress progress = control.begin(lengths, !predictor.empty());
  Excess rejected;
  const long max_steps = options.max_steps.value_or(std::lround(kMaxWork / model.node_count));
  for (long tries = 0; !progress.division.finished(); ++tries) {
    systems.work.newton.poll();
    lengths = progress.lengths;
    division = progress.division;
    if (options.tolerance && tries >= max_steps)
      fail_error_control(tries, duration, duration / control.parts_at(lengths.level), (state.time - base) / duration);
    const double dt = duration * division.share();
    const Verdict verdict = try_step(control, dt, rejected);
    progress.lengths = lengths;
    if (accepts(verdict)) {
      progress = control.advance(progress, verdict, dt);
      const bool finished = progress.division.finished();
      state.time = finished ? base + duration : base + duration * progress.division.reached();
    } else if (control.may_subdivide(lengths)) {
      progress = control.subdivide(progress, verdict);
    } else {
      fail_step(verdict, dt);
    }
  }
  lengths = progress.lengths;
}

void World::Implementation::fail_error_control(long tries, double duration, double dt, double share_taken) const {
  fail(NewtonResult{}, dt,
       "error control has taken " + std::to_string(tries) + " inner steps for " + text(100.0 * share_taken, 3) +
           " % of one time_step of " + text(duration) + " s",
       "Undamped motion of high frequency needs steps as short as its period. Use a larger tolerance, viscosity of the "
       "material, integrator='backward_euler', or a greater max_steps");
}

void World::Implementation::fail_step(Verdict why, double dt) const {
  fail(last_newton, dt,
       options.integrator == Integrator::verlet ? "the explicit step broke down"
       : why == Verdict::gained_energy          ? "the step gains energy that no load supplies"
       : why == Verdict::inaccurate             ? "the smallest step misses the tolerance"
                                                : "the step did not converge",
       why == Verdict::inaccurate      ? "Try a larger tolerance, or more max_halvings"
       : why == Verdict::gained_energy ? "Try a smaller time_step, or integrator='energy_momentum'"
                                       : "");
}

/// Takes one part of dt, and rejects it where it gains energy that no load supplies or is not accurate enough.
Verdict World::Implementation::try_step(const StepControl& control, double dt, Excess& rejected) {
  const bool keeps = may_take_back();
  if (keeps) static_cast<Moving&>(kept) = *this;
  if (tape) kept.taped = tape->count();
  systems.work.newton.finest = 0.01 * control.allowed_error(dt);  // so that what Newton leaves is no part of the error
  PartResult part;
  bool done = false;
  try {
    done = scheme_step(dt, part);
  } catch (...) {
    if (keeps) return_to_start();
    throw;
  }
  if (!done) {
    statistics.rejected_steps += 1;
    return Verdict::failed;
  }
  const Verdict judged = judge(control, part, dt, rejected);
  if (!accepts(judged)) {
    take_back();
    return judged;
  }
  rejected = {};
  watch_step({model, options, parameters, state, systems.scheme(), dt, steps_taken}, step_watch, warnings,
             energy_scratch);
  commit_step(part);
  const Contact* contact = watched_contact();
  const bool near_limit = 2.5 * held_turn_of(part) > 1.0 || (contact && contact->unresolved(2.0 * dt));
  const auto [after, verdict] = control.accept(lengths, part.errors, dt, near_limit);
  if (options.tolerance && acts_in_middle(options.integrator))
    statistics.unresolved_amplitude =
        std::max(statistics.unresolved_amplitude, unresolved_amplitude(options, part.errors.own, dt));
  lengths = after;
  return verdict;
}

/// True if a part that was solved may be rejected.
bool World::Implementation::may_take_back() const {
  const bool euler = options.adaptive && options.integrator == Integrator::backward_euler;
  return euler || watched_contact() || options.tolerance || options.integrator == Integrator::fourth_order ||
         turns_rods(model, motions, state.time, callbacks.prescribes);
}

/// Contact by which parts are judged; nothing where they are not.
Contact* World::Implementation::watched_contact() const {
  return options.adaptive && options.integrator != Integrator::verlet ? systems.scheme().contact() : nullptr;
}

/// Turn of what is held in a part, over the greatest that is accurate.
double World::Implementation::held_turn_of(const PartResult& part) const {
  if (!options.adaptive || !acts_in_middle(options.integrator)) return 0.0;
  return part.held_turn / (composes() ? kMaxHeldTurnOfPart : kMaxHeldTurn);
}

/// Verdict on a part that was solved. `rejected`: what parts were rejected for before.
Verdict World::Implementation::judge(const StepControl& control, const PartResult& part, double dt, Excess& rejected) {
  if (!control.bears(lengths, part.errors.own, dt)) return Verdict::inaccurate;
  Contact* contact = watched_contact();
  const Excess now{held_turn_of(part),
                   contact && !obstacle_motions.empty() ? farthest_obstacle(kept.state, state) : 0.0};
  const bool unresolved =
      part.rebound_gain > kMaxReboundGain || (now.turn > 1.0 && lessens(now.turn, rejected.turn)) ||
      (contact && ((contact->unresolved(dt) && lessens(now.way, rejected.way)) || contact->missed(kept.state.q)));
  if (unresolved && control.may_subdivide(lengths)) {
    rejected = now;
    return Verdict::inaccurate;
  }
  const bool euler = options.adaptive && options.integrator == Integrator::backward_euler;
  if (unresolved) return Verdict::easy;
  const bool gains =
      euler && gains_under_pressure(model, parameters, state, systems.work.pressure.gains, energy_scratch);
  if (gains || (contact && contact_pumps(model, parameters, *contact, kept, *this, dt, options.time_step, contact_guard,
                                         energy_scratch)))
    return Verdict::gained_energy;
  return Verdict::easy;
}

/// Undoes an accepted step.
void World::Implementation::take_back() {
  return_to_start();
  reaction_current = false;
  statistics.rejected_steps += 1;
}

void World::Implementation::return_to_start() {
  static_cast<Moving&>(*this) = kept;
  if (tape) tape->cut(kept.taped, state, poses_of(motions));
  apply_ramps(model, ramps, state.time, parameters);
}

/// Counts an accepted step.
void World::Implementation::commit_step(const PartResult& part) {
  statistics.steps += 1;
  steps_taken += 1;
  if (rule_of_step() == StepRule::energy_momentum) statistics.energy_momentum_steps += 1;
  if (composes()) statistics.fourth_order_steps += 1;
  statistics.largest_turn = std::max(statistics.largest_turn, part.turn);
  retire_ramps();
}

/// One step of the scheme; changes nothing where it does not converge.
bool World::Implementation::scheme_step(double dt, PartResult& part) {
  return composes() ? composed_step(dt, part) : inner_step(dt, 0, part);
}

bool World::Implementation::may_compose() const {
  const auto stands = [](const SupportMotion& m) { return m.position == m.to_position && m.rotation == m.to_rotation; };
  return options.tolerance && options.integrator == Integrator::energy_momentum && !parameters.dragged && !tape &&
         !callbacks.force && !callbacks.prescribes && std::all_of(motions.begin(), motions.end(), stands) &&
         !dissipation_of(model, parameters);
}

bool World::Implementation::composed_step(double dt, PartResult& part) {
  const double start = state.time;
  double reached = 0.0;
  try {
    for (std::size_t i = 0; i < kFourthOrderParts.size(); ++i) {
      reached += kFourthOrderParts[i];
      if (!inner_step(kFourthOrderParts[i] * dt, static_cast<int>(i), part)) {
        return_to_start();
        return false;
      }
      state.time = start + reached * dt;
    }
  } catch (...) {
    return_to_start();
    throw;
  }
  return true;
}

/// Asks for loads and for where supports shall be. An explicit step begins with the forces that the last one has ended
/// with: loads at its end are none of those at its start, from which it would be of first order.
void World::Implementation::call_before_step(double force_time, double end_time) {
  if (!callbacks.before_step) return;
  if (options.integrator != Integrator::verlet) {
    callbacks.before_step(force_time, end_time);
    return;
  }
  if (!state.acceleration_current) {
    if (callbacks.force) custom().find(state.time, state.q, state.v);
    find_acceleration(systems.scheme(), parameters, custom().at_rest(), end_time - state.time, state, systems.work);
  }
  const bool planar = model.planar();
  callbacks.before_step(force_time, end_time);
  state.acceleration_current = planar == model.planar();  // or another model's
}

/// Asks for what is prescribed, and steps by dt; changes nothing where the step does not converge.
bool World::Implementation::inner_step(double dt, int slot, PartResult& part) {
  const double start = state.time, end = start + dt, middle = force_time(options, start, dt);
  call_before_step(middle, end);
  const bool ramped = are_active(ramps);
  double actuation = 0.0;
  if (ramped) actuation += apply_ramps(model, ramps, middle, state.q, configuration(), parameters, energy_scratch);
  prescribe(model, *this, *this, end, prescribed);
  Equations& system = systems.scheme();
  const auto undo = [&] {
    if (ramped) apply_ramps(model, ramps, start, parameters);
  };
  if (tape) check_tape(*tape, state, parameters);
  StepResult r;
  try {
    prescribe_custom(dt, prescribed);
    r = step_by_rule(dt, slot);
    for (int tries = 0; r.too_deep && tries < kMaxStiffenings; ++tries) {
      ledger.dissipated -= system.contact()->stiffen(state, false);
      systems.work.newton.matrix.owner = nullptr;
      r = step_by_rule(dt, slot);
    }
  } catch (...) {
    undo();
    throw;
  }
  last_newton = r.newton;
  if (!r.accepted) {
    undo();
    if (r.squeezed) fail_squeezed(model, system, state, r.squeezed, dt);
    return false;
  }
  for (std::size_t s = 0; s < motions.size(); ++s) motions[s].put(prescribed.supports[s]);
  const bool begins = division.first() && slot == 0;
  if (tape) record_step(*tape, model, contact(), *this, *this, {rule_of_step(), dt, systems.work.move, begins});
  part.errors = r.errors;
  part.turn = std::max(part.turn, r.largest_turn);
  part.rebound_gain = std::max(part.rebound_gain, r.rebound_gain);
  part.held_turn = std::max(part.held_turn, prescribed.held.turn);
  if (rule_of_step() == StepRule::energy_momentum) part.held_turn = std::max(part.held_turn, prescribed.held.spin);
  ledger.load_work += r.load_work;
  ledger.dissipated += r.dissipated;
  ledger.support_work += r.support_work;
  contact_guard.put_in = r.pressing_gain;
  keep_reactions(dt, begins);
  if (ramped) {
    const Configuration& there = model.planar() ? configuration() : systems.work.after;
    actuation += apply_ramps(model, ramps, end, state.q, there, parameters, energy_scratch);
    ledger.actuation_work += actuation;
  }
  return true;
}

StepRule World::Implementation::rule_of_step() const { return equation_options(options).rule; }

StepResult World::Implementation::step_by_rule(double dt, int slot) {
  if (options.integrator == Integrator::verlet)
    return verlet_step(systems.scheme(), parameters, prescribed, dt, state, systems.work);
  const bool compares = composable && (composes() || steps_taken % kOrderPeriod == 0);
  const StepPlan plan{rule_of_step(), dt, slot, composes(), compares};
  return implicit_step(systems.scheme(), systems.newton(), options, parameters, prescribed, plan, state, predictor,
                       systems.work);
}

}  // namespace withe
