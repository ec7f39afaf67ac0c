#include <algorithm>
#include <cmath>
#include <utility>

#include "integrators/step_parts.hpp"
#include "steps/elastic_forces.hpp"

namespace withe {
namespace {

/// Forces of the last evaluation over mass, for free unknowns.
void set_acceleration(const Equations& equations, const StepWorkspace& work, VectorX& acceleration) {
  acceleration = -work.newton.data.full_residual.cwiseProduct(equations.mass().inverse);
  equations.assembler().project(acceleration);  // a held node has one mass in all directions
}

/// Forces over mass at q, with velocity v in drag, viscosity, friction and the spin couple. Anchors have followed the
/// way from `before`.
void explicit_acceleration(Equations& equations, const Parameters& parameters, const Prescribed& prescribed, double dt,
                           const State& before, const State& state, const VectorX& v, StepWorkspace& work,
                           VectorX& acceleration) {
  work.from = state;  // one that reaches q over dt with velocity v
  work.from.q -= dt * v;
  work.from.v = v;
  equations.begin(work.from, parameters, StepRule::verlet, dt, prescribed);
  if (Contact* contact = equations.contact(); contact && contact->anchored())
    contact->begin(before, parameters, dt, Pressing::still, prescribed.obstacles);
  if (equations.flows() && !solve_flow(equations, state.q, v, work.newton.counters)) {
    acceleration.setConstant(state.q.size(), std::nan(""));
    return;
  }
  equations.evaluate(state.q, false, nullptr, work.newton.data);
  set_acceleration(equations, work, acceleration);
}

/// Accelerations with inertia alone against motion: `work.next` at q = work.z, with accelerations there, velocities
/// being work.velocity. Returns by how much edges turn at most [rad].
double free_acceleration(Equations& equations, const Parameters& parameters, const Prescribed& prescribed,
                         const State& state, StepWorkspace& work) {
  State& next = work.next;
  if (next.q.size() != state.q.size()) next = state;  // once: members that an explicit step keeps, and memory
  const double turn = advance(equations.model(), state, work.z, work.newton.data.configuration, next);
  equations.begin(next, parameters, StepRule::verlet, 0.0, prescribed);
  equations.evaluate_forces(work.velocity, work.newton.data);
  set_acceleration(equations, work, next.acceleration);
  return turn;
}

/// The same under contact, or where anything takes energy from the motion.
double resisted_acceleration(Equations& equations, const Parameters& parameters, const Prescribed& prescribed,
                             double dt, const State& state, StepWorkspace& work) {
  const Model& model = equations.model();
  const double turn = largest_turn(model, state.q, work.z);
  if (!(turn <= 1.5)) return turn;
  State& next = work.next;
  next = state;
  if (!model.planar()) compute_configuration(model, state, work.z, work.after);
  accept_configuration(model, work.z, work.after, next);
  explicit_acceleration(equations, parameters, prescribed, dt, state, next, work.velocity, work, next.acceleration);
  return turn;
}

/// 2 / omega, omega^2 the greatest eigenvalue of the last matrix over mass, less `shift`; by power iteration.
double undamped_step(const Equations& equations, double shift) {
  const LinearSolver& solver = equations.assembler().solver();
  const VectorX scale = equations.mass().inverse.cwiseSqrt();
  VectorX x(scale.size()), y(scale.size());
  for (Eigen::Index i = 0; i < x.size(); ++i)
    x(i) = std::sin(1.0 + 7.0 * static_cast<double>(i)) + (i % 2 ? 1.0 : -1.0);
  equations.assembler().project(x);
  double greatest = 0.0;
  for (int k = 0; k < 300; ++k) {
    const double norm = x.norm();
    if (norm == 0.0) break;
    x = scale.cwiseProduct(x / norm);
    solver.multiply({x.data(), static_cast<std::size_t>(x.size())}, {y.data(), static_cast<std::size_t>(y.size())});
    y -= shift * equations.mass().rows.cwiseProduct(x);
    x = scale.cwiseProduct(y);
    equations.assembler().project(x);
    const double value = x.norm();
    if (k > 20 && std::abs(value - greatest) < 1e-5 * value) {
      greatest = value;
      break;
    }
    greatest = std::max(greatest, value);
  }
  return greatest > 0.0 ? 2.0 / std::sqrt(greatest) : INFINITY;
}

}  // namespace

double advance(const Model& model, const State& state, const VectorX& q, Configuration& configuration, State& next) {
  if (!model.planar()) return std::acos(std::min(advance_configuration(model, state, q, configuration, next), 1.0));
  compute_configuration(model, state, q, configuration);
  next.q = q;
  return largest_turn(model, state.q, q);
}

void find_acceleration(Equations& equations, const Parameters& parameters, const Prescribed& prescribed, double dt,
                       State& state, StepWorkspace& work) {
  if (state.acceleration_current) return;
  explicit_acceleration(equations, parameters, prescribed, dt, state, state, state.v, work, state.acceleration);
  if (equations.loaded()) equations.load_force(work.newton.data, state.load_force);
  if (const Contact* contact = equations.contact()) contact->friction_force(state.friction_force);
  state.acceleration_current = true;
}

void begin_verlet(Equations& equations, const Parameters& parameters, const Prescribed& prescribed, double dt,
                  State& state, StepWorkspace& work) {
  find_acceleration(equations, parameters, prescribed, dt, state, work);
  VectorX &half = work.mean, &q1 = work.z, &v1 = work.velocity;
  half = state.v + 0.5 * dt * state.acceleration;
  equations.assembler().project(half);
  equations.assembler().add_held_change(state.q, prescribed.held.q, 1.0 / dt, half);
  q1 = state.q + dt * half;
  // Drag, viscosity and the spin couple want the velocity at the end; a predicted one is second order.
  v1 = half + 0.5 * dt * state.acceleration;
}

StepResult verlet_step(Equations& equations, const Parameters& parameters, const Prescribed& prescribed, double dt,
                       State& state, StepWorkspace& work) {
  StepResult result;
  const Model& model = equations.model();
  if (!prescribed.held.reachable) return result;
  begin_verlet(equations, parameters, prescribed, dt, state, work);
  const VectorX &half = work.mean, &q1 = work.z;
  State& next = work.next;
  const bool resisted = equations.contact() || equations.dissipates(parameters);
  result.largest_turn = resisted ? resisted_acceleration(equations, parameters, prescribed, dt, state, work)
                                 : free_acceleration(equations, parameters, prescribed, state, work);
  if (!(result.largest_turn <= 1.5)) return result;
  next.v = half + 0.5 * dt * next.acceleration;
  if (!std::isfinite(next.v.squaredNorm())) return result;
  work.change = q1 - state.q;
  add_work(equations, parameters, work.change, work, result);
  if (equations.loaded()) {
    // The mean of the forces at both ends, as velocities are.
    equations.load_force(work.newton.data, next.load_force);
    result.load_work = 0.5 * (state.load_force + next.load_force).dot(work.change);
  }
  if (Contact* contact = equations.contact()) {
    // Verlet conserves the contact energy on the whole, which the force at the end alone does not show.
    contact->friction_force(next.friction_force);
    result.dissipated += contact->mean_friction_loss(work.change, state.friction_force, next.friction_force);
    result.support_work += contact->obstacle_work();
    contact->remember(next);
  }
  if (!model.constraints.empty()) {
    work.assumed.setZero(model.dof_count);
    add_support_work(equations, state.v, next.v, dt, dt, work, result);
  }
  next.acceleration_current = true;
  next.time = state.time + dt;
  std::swap(state, next);
  result.newton.converged = true;
  result.accepted = true;
  return result;
}

double stable_step(Equations& equations, const Parameters& parameters, const Prescribed& prescribed, const State& state,
                   StepWorkspace& work) {
  equations.begin(state, parameters, StepRule::statics, 0.0, prescribed);
  equations.evaluate(state.q, true, nullptr, work.newton.data);
  double dt = undamped_step(equations, 0.0);
  // The eigenvalue falls while a step grows, at most as one over it: each round halves the logarithm of the error.
  for (int k = 0; k < 20 && std::isfinite(dt); ++k) {
    const double h = 0.25 * dt;
    work.from = state;  // with its velocities: friction resists less at a higher slip velocity
    work.from.q -= h * state.v;
    equations.begin(work.from, parameters, StepRule::verlet, h, prescribed);
    if (Contact* contact = equations.contact()) contact->begin(work.from, parameters, dt, Pressing::still);
    equations.evaluate(state.q, true, nullptr, work.newton.data, {.regularisation = 0.25});
    const double before = std::exchange(dt, undamped_step(equations, 1.0 / (h * h)));
    if (std::abs(dt - before) < 1e-3 * dt) break;
  }
  return dt;
}

}  // namespace withe
