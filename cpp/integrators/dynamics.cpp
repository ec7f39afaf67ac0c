#include "integrators/dynamics.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/timer.hpp"
#include "integrators/step_parts.hpp"

namespace withe {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// By how much the energy in stretching an edge of stiffness 1 N grows beyond the work of the axial force of a step
/// [J], that in its middle or at its end. An edge under pressure that turns gains by the latter: it gives way by l0 (1
/// - cos).
double stretch_gain(double before, double after, double across, double rest, bool at_end) {
  const double l0 = std::sqrt(before), l1 = std::sqrt(after);
  if (at_end) return (l0 * l1 - across) / l1 - 0.5 * (before + after - 2.0 * across) / rest;
  const double middle = 0.5 * std::sqrt(std::max(before + after + 2.0 * across, 0.0));
  return middle > 0.0 ? 0.5 * (l1 - l0) * (l1 + l0 - 2.0 * middle) / middle : 0.0;
}

/// Axial forces at the start of a step [N]: where the mixed method sets out from, for those of an extrapolated motion,
/// whose edges turn along straight lines and so stretch, mean nothing.
void start_axial_force(const Equations& equations, const VectorX& q, VectorX& out) {
  const Model& model = equations.model();
  out.resize(model.edge_count);
  for (int e = 0; e < model.edge_count; ++e) {
    const int a = model.node_dof[at(model.edge_tail[at(e)])], b = model.node_dof[at(model.edge_head[at(e)])];
    double square = 0.0;
    for (int i = 0; i < model.dimension; ++i) square += (q(b + i) - q(a + i)) * (q(b + i) - q(a + i));
    out(e) = equations.elastic.stretch_stiffness(e) * (std::sqrt(square) / model.edge_length(e) - 1.0);
  }
}

/// Adds to `work.move` what supports do within a part of the step. Where that is more than the edges next to them bear,
/// the others follow as they would by the linear step.
void follow_supports(Equations& equations, const Newton& newton, double part, const State& state, StepWorkspace& work) {
  const Assembler& assembler = equations.assembler();
  if (newton.leaves_alone(part * assembler.greatest_held_change(state.q, work.held.q))) {
    assembler.add_held_change(state.q, work.held.q, part, work.move);
    return;
  }
  VectorX& held = work.difference;
  held.setZero(state.q.size());
  assembler.add_held_change(state.q, work.held.q, part, held);
  const double bearable = newton.cap(held);
  if (bearable < 1.0) {
    Evaluation& e = work.newton.evaluation;
    work.newton.factor.owner = nullptr;
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

/// Where surfaces stop or turn round, friction jumps within a slip far smaller than an iteration, and Newton's method
/// goes to and fro across it. So the slip over which it grows is made great first, and small little by little: what
/// sticks slips in proportion to it, which leads from one solution to the next.
NewtonResult solve_eased(Equations& equations, const Newton& newton, bool mixed, double h, StepWorkspace& work) {
  constexpr std::array<double, 7> kEasing{8192.0, 4096.0, 512.0, 64.0, 16.0, 4.0, 1.0};
  constexpr int kMost = 20;  // iterations
  NewtonResult found;
  VectorX& last = work.velocity;
  int spent = 0;
  for (std::size_t k = 0; k < kEasing.size(); ++k) {
    if (k > 1) {
      work.move = ((kEasing[k] - kEasing[k - 1]) / (kEasing[k - 1] - kEasing[k - 2])) * (work.z - last);
      last = work.z;
      work.z += equations.allowed(work.z, work.move) * work.move;
    } else {
      last = work.z;
    }
    equations.contact()->ease(kEasing[k]);
    found = newton.solve(equations, work.z, nullptr, kMost, work.newton, mixed, h);
    spent += found.iterations;
    if (!found.converged) break;
  }
  equations.contact()->ease(1.0);
  found.iterations = spent;
  return found;
}

/// Finds the inner configuration, `work.z`: from the extrapolated motion first; where that is too far off, from a
/// steady one, or from rest, whose first iteration is the linear step. A step that is repeated since contact was too
/// soft sets out from where it led.
NewtonResult find_inner(Equations& equations, const Newton& newton, const Options& options, const StepPlan& plan,
                        double h, const State& state, const Predictor& predictor, StepWorkspace& work) {
  struct Start {
    std::size_t number;  // among FactorRecord::starts
    bool moving, accelerated, mixed, eased = false;
  };
  NewtonResult found;
  int spent = 0;
  const int points = predictor.points(plan.slot);
  // Where edges turn by a radian in an energy-momentum step, the mixed method may circle for ever: then the plain one
  // comes first for a while.
  const bool circling = plan.rule == StepRule::energy_momentum;
  FactorRecord& known = work.newton.factor;
  const bool mixed = !circling || known.plain_solves == 0;
  if (circling && !mixed) --known.plain_solves;
  constexpr int kWait = 16;
  std::array<Start, 5> starts{{{0, true, true, mixed},
                               {1, true, false, mixed},
                               {2, false, false, mixed},
                               {3, true, false, !mixed},
                               {4, false, false, mixed, true}}};
  // Where surfaces stick, a motion that lets them slip leads far off, and from rest Newton's method finds its way soon,
  // or else mostly within a shorter step.
  const bool frictional = equations.contact() && equations.contact()->frictional();
  const bool eases = frictional && equations.contact()->eases();
  if (frictional) std::swap(starts[1], starts[2]);
  if (eases) std::rotate(starts.begin() + 2, starts.end() - 1, starts.end());
  const int few = std::min(12, options.max_iterations);
  if (work.repeated) {
    work.z = work.deep;
    start_axial_force(equations, work.z, work.newton.axial_force);
    found = newton.solve(equations, work.z, nullptr, std::min(24, options.max_iterations), work.newton, mixed, h);
    if (found.converged) return found;
    spent = found.iterations;
  }
  for (const Start& start : starts) {
    if (start.eased && !eases) continue;
    if (start.accelerated && (points == 0 || work.repeated)) continue;
    // From rest always; where friction lets surfaces jump, others only while they help.
    const bool sure = start.number == 2 || (!start.accelerated && !(frictional && options.adaptive));
    StartRecord& record = known.starts[start.number];
    if (!sure && record.skipped()) continue;
    if (start.accelerated) {
      predictor.extrapolate(state.time + 0.5 * plan.dt, points, work.mean);
      work.move = h * state.v + (h * h) * work.mean;
    } else {
      work.move = (start.moving ? h : 0.0) * state.v;
    }
    equations.assembler().project(work.move);
    work.move *= newton.cap(work.move);
    if (equations.contact()) equations.contact()->hold_sticking(state, work.move);
    follow_supports(equations, newton, h / plan.dt, state, work);
    work.z = state.q + work.move * equations.allowed(state.q, work.move);
    const bool trial = start.accelerated || (circling && start.mixed && start.moving);
    const int limit = trial ? few : options.max_iterations;
    start_axial_force(equations, state.q, work.newton.axial_force);
    // Starts that surfaces cut short soon converge in one scene, and lead nowhere in another.
    const bool impatient = trial && known.cut.waits > 0;
    found = start.eased ? solve_eased(equations, newton, start.mixed, h, work)
                        : newton.solve(equations, work.z, nullptr, limit, work.newton, start.mixed, h, impatient);
    spent += found.iterations;
    if (trial && found.cut && !known.cut.skipped()) known.cut.note(found.converged);
    if (!sure) record.note(found.converged);
    if (found.converged) {
      if (circling && mixed && !start.mixed) known.plain_solves = kWait;
      break;
    }
  }
  found.iterations = spent;
  return found;
}

/// How far a force that acts over a step moves things [m]: filtered by (M / h^2 + K)^-1, so that modes which the step
/// does not resolve, and which it therefore leaves bounded, count for as little as they move [Hosea and Shampine 1996].
double moved_by(VectorX& force, Equations& equations, const Newton& newton, double h, StepWorkspace& work) {
  equations.assembler().project(force);
  const FactorRecord& factor = work.newton.factor;
  if (factor.owner != &equations || factor.interval != std::abs(h)) {
    // Nothing moved, and no matrix was made.
    force = (h * h) * force.cwiseProduct(equations.mass().inverse);
    return newton.displacement(force);
  }
  equations.assembler().solver().solve({force.data(), static_cast<std::size_t>(force.size())});
  return newton.displacement(force);
}

/// Estimated error of the step just taken [m]: dt^2 / 2 times the mean acceleration (backward Euler), or
/// c dt^(p + 1) times its derivative of order p - 1: c = 1/12 for midpoint, p = 2; for fourth-order steps, p = 4,
/// c = |sum g^5| / 80 over their parts g, whose own errors of the third power cancel. The latter is known at the last
/// part, and 0 before.
///
/// Such errors add up to a shift in phase, and that to no more than a mode's amplitude a is: of frequency w over T,
/// min(2 a, a c (w dt)^p w T). The two meet at (w dt)^(p + 1) = 2 dt / (c T); p + 1 running means leave slower modes as
/// they are and take that power of the ratio off faster ones.
double estimated_error(Equations& equations, const Newton& newton, const Options& options, const StepPlan& plan,
                       Predictor& predictor, StepWorkspace& work) {
  VectorX& error = work.assumed;
  const VectorX& acceleration = work.mean;
  if (plan.rule == StepRule::backward_euler) {
    work.difference = 0.5 * acceleration;
    multiply(equations.model(), equations.mass(), work.difference, error);
    return moved_by(error, equations, newton, plan.dt, work);
  }
  double dt = plan.dt, constant = 1.0 / 12.0;
  int order = 2;
  const VectorX* whole = &acceleration;
  if (options.integrator == Integrator::fourth_order) {
    const double part = kFourthOrderParts[static_cast<std::size_t>(plan.slot)];
    if (plan.slot == 0) work.whole_acceleration.setZero(acceleration.size());
    work.whole_acceleration += part * acceleration;
    if (plan.slot + 1 < static_cast<int>(kFourthOrderParts.size())) return 0.0;
    dt = plan.dt / part;
    order = 4;
    constant = kFourthOrderError;
    whole = &work.whole_acceleration;
  }
  constexpr double kCaution = 2.0;  // fast modes are taken to shift so much further
  const double cut = std::pow(kCaution * 2.0 * dt / (constant * options.duration.value_or(1.0)), 1.0 / (order + 1));
  predictor.differentiate(order - 1, -std::expm1(-cut), dt, *whole, work.difference);
  const double h = 0.5 * plan.dt;
  work.difference *= constant * std::pow(dt, order + 1) / (h * h);
  multiply(equations.model(), equations.mass(), work.difference, error);
  return moved_by(error, equations, newton, h, work);
}

/// Velocity at the end of a step of what supports hold. They have no dynamics of their own, and midpoint's 2 v - v0
/// would ring for ever: their mean velocities of this step and the last are carried on, to second order, but where they
/// jump.
void find_held_velocity(const Model& model, const StepPlan& plan, const State& state, StepWorkspace& work) {
  VectorX& v = work.held_velocity;
  v = (work.held.q - state.q) / plan.dt;
  if (plan.rule == StepRule::backward_euler || state.motion.known == 0) return;
  constexpr double kJump = 0.75;  // of it; from rest at an even acceleration, the second step is 2/3 faster
  const double share = 0.5 * plan.dt / (state.time + 0.5 * plan.dt - state.motion.time[0]);
  for (const Constraint& c : model.constraints) {
    const Vector3 now = c.held(v), gain = now - c.held(state.motion.velocity[0]);
    if (gain.norm() <= kJump * now.norm()) v.segment(c.first, c.size) += share * gain.head(c.size);
  }
}

/// Finds the fluid's force for a step of dt: that on velocities as they are taken to be within the step, to the order
/// of the scheme, at the positions that go with them. Under the midpoint rules those of the last two steps are carried
/// on: velocities at their ends would ring on stiff modes, and the guess with them.
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
  equations.assembler().add_held_change(state.q, work.held.q, 1.0 / dt, v);
  q = state.q;
  if (!euler) q += 0.5 * dt * v;
  return solve_flow(equations, q, v, work.newton.counters);
}

void remember_motion(const VectorX& q1, double dt, State& state) {
  Motion& motion = state.motion;
  motion.velocity[1].swap(motion.velocity[0]);
  motion.velocity[0] = (q1 - state.q) / dt;
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

Turning turning(const Model& model, const State& state, const VectorX& q, const double* stretch_stiffness,
                bool at_end) {
  double smallest = 1.0, gain = 0.0;
  for (int e = 0; e < model.edge_count; ++e) {
    const int a = model.node_dof[at(model.edge_tail[at(e)])], b = model.node_dof[at(model.edge_head[at(e)])];
    double across = 0.0, before = 0.0, after = 0.0;
    for (int i = 0; i < model.dimension; ++i) {
      const double d0 = state.q(b + i) - state.q(a + i), d1 = q(b + i) - q(a + i);
      across += d0 * d1;
      before += d0 * d0;
      after += d1 * d1;
    }
    const double square = across * std::abs(across) / (before * after);  // of the cosine, with its sign
    if (!std::isfinite(square)) return {INFINITY, INFINITY};
    smallest = std::min(smallest, square);
    if (stretch_stiffness)
      gain += stretch_stiffness[e] * stretch_gain(before, after, across, model.edge_length(e), at_end);
  }
  return {std::acos(std::copysign(std::sqrt(std::min(std::abs(smallest), 1.0)), smallest)), gain};
}

void book_work(Equations& equations, const Parameters& parameters, const VectorX& change, StepResult& result) {
  if (equations.loaded()) result.load_work = equations.load_work(change);
  const bool in_fluid = equations.model().description.fluid.model != FluidModel::none;
  if (parameters.dragged || parameters.viscous || in_fluid) result.dissipated = equations.dissipated(change);
}

void book_supports(const Equations& equations, const VectorX& v0, const VectorX& v1, double dt, StepWorkspace& work,
                   StepResult& result) {
  VectorX& full_residual = work.newton.evaluation.full_residual;
  VectorX& momentum = work.difference;  // by how much it grows
  work.z = v1 - v0;
  multiply(equations.model(), equations.mass(), work.z, momentum);
  for (const Constraint& c : equations.model().constraints) {
    const Vector3 gain = c.held(momentum), assumed = c.held(work.assumed);
    const Vector3 force = c.held(full_residual) - assumed, mean = 0.5 * (c.held(v0) + c.held(v1));
    result.support_work += force.dot(c.part(work.change)) + gain.dot(mean);
    full_residual.segment(c.first, c.size) += (gain / dt - assumed).head(c.size);
  }
}

bool solve_flow(Equations& equations, const VectorX& q, const VectorX& v, Counters& counters) {
  const Timer timer(counters.fluid_time);
  return equations.begin_flow(q, v);
}

StepResult implicit_step(Equations& equations, const Newton& newton, const Options& options,
                         const Parameters& parameters, const StepPlan& plan, State& state, Predictor& predictor,
                         StepWorkspace& work) {
  StepResult result;
  const Model& model = equations.model();
  const Assembler& assembler = equations.assembler();
  const bool euler = plan.rule == StepRule::backward_euler;
  const double dt = plan.dt, h = euler ? dt : 0.5 * dt;
  if (!work.held.reachable) return result;
  equations.begin(state, parameters, h, plan.rule == StepRule::energy_momentum, euler ? Inner::end : Inner::middle);
  if (equations.contact() && equations.contact()->blocked()) return result;
  if (!begin_flow(equations, dt, euler, state, work)) return result;
  if (!model.constraints.empty()) {
    find_held_velocity(model, plan, state, work);
    equations.held_acceleration = (work.held_velocity - state.v) / dt;
  }
  result.newton = find_inner(equations, newton, options, plan, h, state, predictor, work);
  if (!result.newton.converged) return result;
  VectorX& q1 = work.move;
  if (euler)
    q1 = work.z;
  else
    q1 = 2.0 * work.z - state.q;
  const double* watched = plan.rule == StepRule::energy_momentum ? nullptr : equations.elastic.stretch_stiffness.data();
  const Turning turned = turning(model, state, q1, watched, euler);
  result.largest_turn = turned.largest;
  if (!q1.allFinite() || !(result.largest_turn <= 1.5)) return result;
  result.stretch_gain = turned.stretch_gain;
  if (Contact* contact = equations.contact()) {
    // Iterates pass through nothing, but they may find a way around what a rod would have met.
    work.change = work.z - state.q;
    if (equations.allowed(state.q, work.change) < 1.0) return result;
    contact->update(q1);
    result.too_deep = contact->too_deep();
    if (result.too_deep) {
      work.deep = work.z;
      return result;
    }
  }
  work.change = q1 - state.q;
  const VectorX& working = plan.rule == StepRule::energy_momentum ? equations.working_change(work.change) : work.change;
  if (equations.contact()) result.pressing_gain = equations.contact()->pressing_gain(working);
  work.mean = work.change / dt;
  VectorX& v1 = work.velocity;
  if (euler)
    v1 = work.mean;
  else
    v1 = 2.0 * work.mean - state.v;
  if (plan.rule == StepRule::energy_momentum) equations.set_turning_velocities(work.change, dt, v1);
  assembler.project(v1);
  if (!model.constraints.empty()) assembler.add_held_part(work.held_velocity, 1.0, v1);
  book_work(equations, parameters, working, result);
  double contact_loss = 0.0;
  if (const Contact* contact = equations.contact()) {
    const double by_obstacles = contact->obstacle_work();
    contact_loss = equations.contact_loss(working, by_obstacles);
    result.dissipated += contact_loss;
    result.support_work += by_obstacles;
  }
  if (!model.constraints.empty()) {
    work.assumed = equations.inertia();
    if (plan.rule == StepRule::energy_momentum)
      equations.set_working_rows(work.change, work.newton.evaluation.full_residual);
    book_supports(equations, state.v, v1, dt, work, result);
  }
  VectorX& acceleration = work.mean;
  acceleration = (v1 - state.v) / dt;
  if (options.tolerance) result.error = estimated_error(equations, newton, options, plan, predictor, work);
  predictor.record(state.time + 0.5 * dt, plan.slot, acceleration, equations.mass().rows, work.assumed);
  if (Contact* contact = equations.contact())
    result.dissipated -= contact->accept(state, Keep::energy, std::max(contact_loss, 0.0));
  if (!model.planar()) compute_configuration(model, state, q1, work.after);
  if (state.motion.velocity[0].size() != 0) remember_motion(q1, dt, state);
  accept_configuration(model, q1, work.after, state);
  state.v = v1;
  state.acceleration = acceleration;
  state.time += dt;
  result.accepted = true;
  return result;
}

}  // namespace withe
