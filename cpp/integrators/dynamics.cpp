#include "integrators/dynamics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/timer.hpp"
#include "integrators/inner_solve.hpp"
#include "integrators/newton_system.hpp"
#include "integrators/step_parts.hpp"
#include "steps/elastic_forces.hpp"
#include "steps/inertia.hpp"
#include "steps/joint_forces.hpp"

namespace withe {
namespace {

// Time since the middle of the step before, over the step, up to which the step before counts as no longer: 1
// for equal steps, 2 where the step before was three times as long.
constexpr double kMaxUsualTime = 2.0;

/// Displacement by a force that acts over a step [m], filtered by (M / h^2 + K)^-1 [Hosea and Shampine 1996]. Modes
/// that the step does not resolve, and therefore leaves bounded, then count for as little as they move.
double moved_by(VectorX& force, Equations& equations, const Newton& newton, double h, StepWorkspace& work) {
  equations.assembler().project(force);
  MatrixRecord& matrix = work.newton.matrix;
  // A matrix that was made for an iteration that was not needed has not been factorised.
  const bool usable = matrix.belongs_to(equations, h) && (matrix.factorized || factorize(equations, work.newton));
  if (!usable) {
    // Nothing moved, and no matrix was computed.
    force = (h * h) * force.cwiseProduct(equations.mass().inverse);
    return newton.norms().displacement(force);
  }
  matrix.factorized = true;
  equations.assembler().solver().solve({force.data(), static_cast<std::size_t>(force.size())});
  return newton.norms().displacement(force);
}

/// Displacement by an error of `constant` dt^power times a derivative of the acceleration [m], see `moved_by`.
double moved_by_error(double constant, double dt, int power, Equations& equations, const Newton& newton, double h,
                      VectorX& derivative, StepWorkspace& work) {
  derivative *= constant * std::pow(dt, power) / (h * h);
  multiply(equations.model(), equations.mass(), derivative, work.assumed);
  return moved_by(work.assumed, equations, newton, h, work);
}

/// Estimated errors of the step just taken. Backward Euler: dt^2 / 2 times the mean acceleration. Other schemes:
/// c dt^(p + 1) times the derivative of order p - 1 of the acceleration.
///
/// - Midpoint has p = 2 and c = 1/12.
/// - Fourth-order steps have p = 4 and c = |sum g^5| / 80 over their parts g, whose own errors of third order cancel.
///   Their error is known at the last part, and 0 before.
///
/// Such errors add up to a shift in phase, whose displacement is at most twice a mode's amplitude a. After a time T,
/// the error of frequency w is min(2 a, a c (w dt)^p w T). Both bounds meet at (w dt)^(p + 1) = 2 dt / (c T). A
/// Butterworth filter of order p + 1 leaves slower modes unchanged, and divides faster modes by that power of the
/// ratio. So an unresolved amplitude counts once, as 2 a over the duration, however short the steps are. For steps of
/// both orders that take equally long to compute, the frequencies are about equal, so one filter serves both.
StepErrors estimated_errors(Equations& equations, const Newton& newton, const Options& options, const StepPlan& plan,
                            Predictor& predictor, StepWorkspace& work) {
  const VectorX& acceleration = work.mean;
  if (plan.rule == StepRule::backward_euler) {
    work.difference = 0.5 * acceleration;
    multiply(equations.model(), equations.mass(), work.difference, work.assumed);
    return {moved_by(work.assumed, equations, newton, plan.dt, work), {}};
  }
  constexpr double kMidpointError = 1.0 / 12.0;
  double dt = plan.dt;
  const VectorX* whole = &acceleration;
  if (plan.composed) {
    const double part = kFourthOrderParts[static_cast<std::size_t>(plan.slot)];
    if (plan.slot == 0) work.whole_acceleration.setZero(acceleration.size());
    work.whole_acceleration += part * acceleration;
    if (plan.slot + 1 < static_cast<int>(kFourthOrderParts.size())) return {};
    dt = plan.dt / part;
    whole = &work.whole_acceleration;
  }
  const int order = plan.composed ? 4 : 2;
  const double constant = plan.composed ? kFourthOrderError : kMidpointError;
  const double cut = std::pow(2.0 * dt / (constant * options.duration.value_or(1.0)), 1.0 / (order + 1));
  VectorX &first = work.difference, &third = work.third_derivative;
  const bool both = plan.composed || plan.compares_order;
  predictor.differentiate(plan.composed ? Predictor::kFifth : Predictor::kThird, cut, dt, *whole, first,
                          both ? &third : nullptr);
  const double h = 0.5 * plan.dt;
  const auto second_order = [&] { return moved_by_error(kMidpointError, dt, 3, equations, newton, h, first, work); };
  const auto fourth_order = [&] { return moved_by_error(kFourthOrderError, dt, 5, equations, newton, h, third, work); };
  StepErrors errors{plan.composed ? fourth_order() : second_order(), {}};
  if (plan.compares_order) errors.other = plan.composed ? second_order() : fourth_order();
  return errors;
}

/// Velocity of held unknowns at the end of a step. They have no dynamics of their own, and the midpoint formula 2 v -
/// v0 would oscillate for ever. Their mean velocities of this step and the last are extrapolated to second order,
/// unless they jump.
void find_held_velocity(const Model& model, const HeldTarget& held, const StepPlan& plan, const State& state,
                        StepWorkspace& work) {
  VectorX& v = work.held_velocity;
  v = (1.0 / plan.dt) * (held.q - state.q);
  if (plan.rule == StepRule::backward_euler || state.motion.known == 0) return;
  const double share = 0.5 * plan.dt / (state.time + 0.5 * plan.dt - state.motion.time[0]);
  for (const Constraint& c : model.constraints) {
    const Vector3 now = c.held(v), gain = now - c.held(state.motion.velocity[0]);
    if (carries_on(now, gain)) v.segment(c.first, c.size) += share * gain.head(c.size);
  }
}

/// True if supports move bodies that keep some freedom, or contradict velocities that a user has set.
bool moves_bodies(const Model& model, const HeldTarget& held, const StepPlan& plan, const State& state) {
  if (plan.rule == StepRule::backward_euler) return false;
  const auto is_free = [](const CarriedPart& part) { return part.is_node() && !part.is_held; };
  if (std::none_of(model.carried.begin(), model.carried.end(), is_free)) return false;
  return std::any_of(model.constraints.begin(), model.constraints.end(), [&](const Constraint& c) {
    return !c.held_change(state.q, held.q).isZero(0.0) || !c.held(state.v).isZero(0.0);
  });
}

/// Time between the velocities of supports before and after a step. Velocities of backward Euler are means over its
/// steps, in their middles, which matters if the last step was much longer.
double held_time(const StepPlan& plan, const State& state) {
  if (plan.rule != StepRule::backward_euler || state.motion.known == 0) return plan.dt;
  const double between = state.time + 0.5 * plan.dt - state.motion.time[0];
  return between > kMaxUsualTime * plan.dt ? between : plan.dt;
}

/// Finds the fluid's force for a step of dt, from the velocities within the step to the order of the scheme, at the
/// corresponding positions. The midpoint rules extrapolate the velocities of the last two steps: velocities at the ends
/// of steps would oscillate on stiff modes, and so would the initial guess.
bool begin_flow(Equations& equations, double dt, bool euler, const State& state, StepWorkspace& work) {
  if (!equations.flows()) return true;
  VectorX &v = work.mean, &q = work.z;
  if (euler)
    v = state.v;
  else if (state.motion.known == 2 && equations.flow_excess() > 1.0)
    v = state.motion.velocity[0];
  else
    extrapolate_velocity(state, state.time + 0.5 * dt, v);
  equations.assembler().project(v);
  equations.assembler().add_held_change(state.q, equations.problem().prescribed->held.q, 1.0 / dt, v);
  q = state.q;
  if (!euler) q += 0.5 * dt * v;
  return solve_flow(equations, q, v, work.newton.counters);
}

void remember_motion(const VectorX& q1, double dt, State& state) {
  Motion& motion = state.motion;
  motion.velocity[1].swap(motion.velocity[0]);
  motion.velocity[0] = (1.0 / dt) * (q1 - state.q);
  motion.time[1] = motion.time[0];
  motion.time[0] = state.time + 0.5 * dt;
  motion.known = std::min(motion.known + 1, 2);
}

}  // namespace

void extrapolate_velocity(const State& state, double time, VectorX& v) {
  const Motion& past = state.motion;
  if (past.known < 2)
    v = state.v;
  else
    v = past.velocity[0] +
        ((time - past.time[0]) / (past.time[0] - past.time[1])) * (past.velocity[0] - past.velocity[1]);
}

void add_work(const Equations& equations, const Parameters& parameters, const VectorX& change, StepWorkspace& work,
              StepResult& result) {
  const StepData& data = work.newton.data;
  if (equations.loaded()) {
    equations.load_force(data, work.assumed);
    result.load_work = work.assumed.dot(change);
  }
  if (equations.dissipates(parameters)) result.dissipated += equations.dissipated(data, change);
}

void add_support_work(const Equations& equations, const VectorX& v0, const VectorX& v1, double dt, double held_time,
                      StepWorkspace& work, StepResult& result) {
  VectorX& full_residual = work.newton.data.full_residual;
  VectorX& momentum = work.difference;  // growth of momentum
  VectorX& rate = work.mean;
  work.z = v1 - v0;
  multiply(equations.model(), equations.mass(), work.z, momentum);
  rate = (1.0 / dt) * momentum;
  if (held_time != dt) {
    work.z /= dt;
    for (const Constraint& c : equations.model().constraints)
      work.z.segment(c.first, c.size) += (1.0 / held_time - 1.0 / dt) * c.held_change(v0, v1).head(c.size);
    multiply(equations.model(), equations.mass(), work.z, rate);
  }
  for (const Constraint& c : equations.model().constraints) {
    const Vector3 gain = c.held(momentum), assumed = c.held(work.assumed);
    const Vector3 force = c.held(full_residual) - assumed, mean = 0.5 * (c.held(v0) + c.held(v1));
    result.support_work += force.dot(c.part(work.change)) + gain.dot(mean);
    full_residual.segment(c.first, c.size) += (c.held(rate) - assumed).head(c.size);
  }
}

bool solve_flow(Equations& equations, const VectorX& q, const VectorX& v, Counters& counters) {
  const Timer timer(counters.fluid_time);
  return equations.begin_flow(q, v);
}

namespace {

/// True if the step to q1 is acceptable: no edge turns far, and contact detection missed no contact.
bool acceptable(Equations& equations, const StepPlan& plan, const State& state, const VectorX& q1, StepWorkspace& work,
                StepResult& result) {
  result.largest_turn = largest_turn(equations.model(), state.q, q1);
  if (!q1.allFinite() || !(result.largest_turn <= 1.5)) return false;
  // Inertia takes the tangent of half a turn, and is the same for another turn more; friction and twist are not.
  if (plan.rule == StepRule::energy_momentum && farthest_turn(equations.model(), state.q, q1) >= std::numbers::pi)
    return false;
  if (breaks_loops(equations, work.z)) return false;
  Contact* contact = equations.contact();
  if (!contact) return true;
  // Iterates pass through no surface, but they may find a way around an obstacle that the rod would have met.
  work.change = work.z - state.q;
  if (equations.allowed(state.q, work.change) < 1.0) return false;
  contact->update(q1);
  result.squeezed = squeezed_contact(equations, work.change, work.mean);
  if (result.squeezed) return false;
  result.too_deep = contact->too_deep();
  return !result.too_deep;
}

/// Velocity at the end, `work.velocity`, of a step whose mean velocity is `work.mean`.
void find_end_velocity(const Equations& equations, const StepPlan& plan, const State& state, StepWorkspace& work) {
  VectorX& v1 = work.velocity;
  if (plan.rule == StepRule::backward_euler)
    v1 = work.mean;
  else
    v1 = 2.0 * work.mean - state.v;
  if (plan.rule == StepRule::energy_momentum)
    set_turning_velocities(equations.model(), state.v, work.change, plan.dt, v1);
  if (plan.rule != StepRule::backward_euler) set_body_velocities(equations.model(), state.v, work.change, plan.dt, v1);
  balance_bodies(equations.problem(), work.newton.data, v1);
  clear_multipliers(equations.model(), v1);
  if (equations.model().has_bodies()) work.formula_velocity = v1;
  equations.assembler().set_held_part(work.held_velocity, v1);
  work.follow_gain = 0.0;
  if (plan.rule == StepRule::backward_euler) return;
  const double before =
      equations.model().carried.empty() ? 0.0 : kinetic_energy(equations.model(), equations.mass(), v1);
  if (follow_held_bodies(equations.problem(), work.z, v1))
    work.follow_gain = kinetic_energy(equations.model(), equations.mass(), v1) - before;
}

/// Accounts for the forces and the dissipated energy; full residuals become minus the reactions. Returns the energy
/// removed by friction and restitution [J].
double account(Equations& equations, const Parameters& parameters, const StepPlan& plan, const State& state,
               const VectorX& q1, StepWorkspace& work, StepResult& result) {
  const bool conserves = plan.rule == StepRule::energy_momentum;
  StepData& data = work.newton.data;
  const VectorX& working = conserves ? work.working : work.change;
  add_work(equations, parameters, working, work, result);
  if (const HandForces* hands = equations.hands()) result.support_work += hands->work(equations.problem(), data, q1);
  double contact_loss = 0.0;
  if (const Contact* contact = equations.contact()) {
    const double by_obstacles = contact->obstacle_work();
    contact_loss = equations.contact_loss(data, working, by_obstacles);
    result.dissipated += contact_loss;
    result.support_work += by_obstacles;
  }
  if (!equations.model().constraints.empty()) {
    work.assumed = data.inertia;
    result.support_work += work.follow_gain;
    if (conserves) result.support_work += finite_turn_work(equations.problem(), data, work.change, work.working);
    add_support_work(equations, state.v, work.velocity, plan.dt, held_time(plan, state), work, result);
  }
  return contact_loss;
}

/// The state becomes that at the end of the step, whose configuration an energy-momentum step has found.
void advance(const Equations& equations, const StepPlan& plan, const VectorX& q1, StepWorkspace& work, State& state) {
  const Model& model = equations.model();
  if (plan.rule == StepRule::energy_momentum && work.newton.data.end == q1)
    std::swap(work.after, work.newton.data.end_configuration);
  else if (!model.planar())
    compute_configuration(model, state, q1, work.after);
  if (state.motion.velocity[0].size() != 0) remember_motion(q1, plan.dt, state);
  accept_configuration(model, q1, work.after, state);
  state.v = work.velocity;
  state.acceleration = work.mean;
  state.time += plan.dt;
}

/// Replaces the velocities at the end of a step by those after the impacts of the step. `lost`: energy that contact has
/// removed. In backward Euler steps the work of contact forces is no change of the kinetic energy: (v1 - v0) . M (v1 -
/// v0) / 2 is lost too.
void add_rebounds(const Equations& equations, const Parameters& parameters, const StepPlan& plan, double lost,
                  State& state, StepWorkspace& work, StepResult& result) {
  const Model& model = equations.model();
  const double dt = plan.dt, unbooked = plan.rule == StepRule::backward_euler
                                            ? dt * dt * kinetic_energy(model, equations.mass(), state.acceleration)
                                            : 0.0;
  const ReboundWork done = work.rebounds.apply(model, parameters, lost + unbooked, work.masses(model), state);
  result.dissipated += unbooked + done.dissipated;
  result.support_work += done.support_work;
  result.rebound_gain = done.gain;
  state.acceleration += (1.0 / dt) * (state.v - work.velocity);
}

/// Replaces the velocities at the end of a step in which supports move bodies. A support acts at a point of a body,
/// with no moment about this point, so the momenta of the free unknowns are those of the midpoint formula 2 v - v0.
/// That formula has another velocity of the point, `work.formula_velocity`, than the support. If the other velocities
/// of the formula stayed, a body on a hinge that jumps to a new velocity would turn too fast and too slowly by turns.
void add_support_impulse(const Equations& equations, const Parameters& parameters, const StepPlan& plan, State& state,
                         StepWorkspace& work, StepResult& result) {
  const Model& model = equations.model();
  MassSystem& masses = work.masses(model);
  if (!masses.begin(state, parameters)) return;
  const double before = kinetic_energy(model, equations.mass(), state.v);
  VectorX held = equations.assembler().held_part(state.v);
  equations.assembler().set_held_part(work.formula_velocity, state.v);
  masses.constrain(std::move(held), state.v);
  result.support_work += kinetic_energy(model, equations.mass(), state.v) - before;
  state.acceleration += (1.0 / plan.dt) * (state.v - work.velocity);
}

/// Velocities that a user sets body by body may violate the rates of closed loops of joints. An impulse of the joints
/// makes them consistent. Returns the kinetic energy that the impulse removes [J].
double make_rates_consistent(const Model& model, const Parameters& parameters, State& state, StepWorkspace& work) {
  MassSystem& masses = work.masses(model);
  return masses.begin(state, parameters) ? masses.close_loops(state.v) : 0.0;
}

}  // namespace

StepResult implicit_step(Equations& equations, const Newton& newton, const Options& options,
                         const Parameters& parameters, const Prescribed& prescribed, const StepPlan& plan, State& state,
                         Predictor& predictor, StepWorkspace& work) {
  StepResult result;
  const Model& model = equations.model();
  const bool euler = plan.rule == StepRule::backward_euler;
  const double dt = plan.dt, h = euler ? dt : 0.5 * dt;
  if (!prescribed.held.reachable) return result;
  const bool holds = !model.constraints.empty();
  if (equations.loops() && predictor.empty() && !state.v.isZero(0.0))
    result.dissipated = make_rates_consistent(model, parameters, state, work);
  if (holds) {
    find_held_velocity(model, prescribed.held, plan, state, work);
    work.held_acceleration = (1.0 / held_time(plan, state)) * (work.held_velocity - state.v);
  }
  equations.begin(state, parameters, plan.rule, h, prescribed, holds ? &work.held_acceleration : nullptr);
  if (equations.contact() && equations.contact()->blocked()) return result;
  if (!begin_flow(equations, dt, euler, state, work)) return result;
  result.newton = solve_inner(equations, newton, options, plan, h, state, predictor, work);
  if (!result.newton.converged) return result;
  VectorX& q1 = work.move;
  equations.problem().set_end(work.z, q1);
  if (!acceptable(equations, plan, state, q1, work, result)) return result;
  work.change = q1 - state.q;
  const bool conserves = plan.rule == StepRule::energy_momentum;
  if (conserves) set_working_change(equations.problem(), work.newton.data, work.change, work.working);
  if (equations.contact())
    result.pressing_gain = equations.contact()->pressing_gain(conserves ? work.working : work.change);
  const double rate = 1.0 / dt;
  work.mean = rate * work.change;
  find_end_velocity(equations, plan, state, work);
  if (euler && options.adaptive)
    find_pressure_gains(equations.problem(), work.newton.data, equations.assembler(), work.velocity, work.pressure);
  const double contact_loss = account(equations, parameters, plan, state, q1, work, result);
  equations.find_joint_wrenches(work.newton.data);
  enter_stops(equations.problem(), q1, state);
  VectorX& acceleration = work.mean;
  acceleration = rate * (work.velocity - state.v);
  if (options.tolerance) result.errors = estimated_errors(equations, newton, options, plan, predictor, work);
  work.difference = rate * work.change;
  predictor.record({state.time + 0.5 * dt, h, dt, plan.slot}, state.v, work.difference, acceleration,
                   equations.mass().rows);
  const bool moves = holds && moves_bodies(model, prescribed.held, plan, state);
  const bool rebounds = work.rebounds.find(equations);
  if (Contact* contact = equations.contact()) result.dissipated -= contact->accept(state, std::max(contact_loss, 0.0));
  advance(equations, plan, q1, work, state);
  if (moves) add_support_impulse(equations, parameters, plan, state, work, result);
  if (rebounds) add_rebounds(equations, parameters, plan, contact_loss, state, work, result);
  if (const HandForces* hands = equations.hands())
    result.support_work -= hands->accept(prescribed.supports, work.after, state);
  result.accepted = true;
  return result;
}

}  // namespace withe
