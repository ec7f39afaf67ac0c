#include "integrators/dynamics.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace withe {
namespace {

/// Largest angle between the source tangents and those of a configuration; > pi/2 where an edge points back.
double largest_turn(const Model& model, const Configuration& before, const Configuration& after) {
  double smallest = 1.0;
  for (int e = 0; e < model.edge_count; ++e) {
    const auto i = static_cast<std::size_t>(e);
    smallest = std::min(smallest, dot(before.edge[i].tangent, after.edge[i].tangent));
  }
  return std::acos(std::clamp(smallest, -1.0, 1.0));
}

/// Work of loads, drag and viscosity over the step, with the forces that acted in it.
void book_work(const Equations& equations, const Parameters& parameters, StepResult& result) {
  if (!equations.loads().pieces.empty() || (equations.custom_force.array() != 0.0).any())
    result.load_work = equations.load_force().dot(result.change);
  if (parameters.dragged || parameters.viscous) result.dissipated = -equations.dissipative_force().dot(result.change);
}

/// Held unknowns move as they are told, so their inertia is what changes their velocity, not what the scheme's formula
/// (`assumed`) says: mends the reactions, and gives the supports' work, exact in the kinetic energy.
void book_supports(const Equations& equations, const VectorX& assumed, const VectorX& v0, const VectorX& v1, double dt,
                   VectorX& full_residual, StepResult& result) {
  const Assembler& assembler = equations.assembler();
  const VectorX held = assembler.held_part(full_residual - assumed);
  const VectorX held0 = assembler.held_part(v0), held1 = assembler.held_part(v1);
  result.support_work = held.dot(result.change) + 0.5 * equations.mass.dot(held1.cwiseAbs2() - held0.cwiseAbs2());
  full_residual += equations.mass.cwiseProduct(held1 - held0) / dt - assembler.held_part(assumed);
}

/// Forces over mass at q, with velocity v in drag, viscosity and the spin couple.
VectorX explicit_acceleration(Equations& equations, const Parameters& parameters, double dt, const State& state,
                              const VectorX& q, const VectorX& v, State& from, NewtonWorkspace& work) {
  from = state;  // one that reaches q over dt with velocity v
  from.q = q - dt * v;
  from.v = v;
  equations.begin(from, parameters, dt, false);
  equations.evaluate(q, false, nullptr, work.evaluation);
  VectorX force = -work.evaluation.full_residual;
  equations.assembler().project(force);
  return force.cwiseQuotient(equations.mass.cwiseMax(1e-300));
}

}  // namespace

StepResult implicit_step(Equations& equations, const Newton& newton, const Options& options,
                         const Parameters& parameters, double dt, const HeldTarget& held, State& state,
                         NewtonWorkspace& work) {
  StepResult result;
  const Model& model = equations.model();
  const bool euler = options.integrator == Integrator::backward_euler;
  const double h = euler ? dt : 0.5 * dt;
  equations.begin(state, parameters, h, options.integrator == Integrator::energy_momentum);
  if (!held.reachable) return result;
  const VectorX held_change = equations.assembler().held_part(held.q - state.q);
  // From the extrapolated motion first; where that is too far off, from less and less of it.
  struct Start {
    double velocity, acceleration;
    bool mixed;
  };
  VectorX z;
  int spent = 0;
  // An acceleration that outweighs the velocity belongs to ringing, not to the motion.
  const bool smooth = h * newton.displacement(state.acceleration) < 0.5 * newton.displacement(state.v);
  const bool mixed = options.integrator != Integrator::energy_momentum;
  for (const Start& start :
       {Start{1.0, 1.0, mixed}, Start{1.0, 0.0, mixed}, Start{1.0, 0.0, !mixed}, Start{0.0, 0.0, true}}) {
    if (start.acceleration > 0.0 && !smooth) continue;
    VectorX move = h * (start.velocity * state.v + (start.acceleration * h) * state.acceleration);
    equations.assembler().project(move);
    z = state.q + move * newton.cap(move) + (h / dt) * held_change;
    const int limit = start.acceleration > 0.0 ? std::min(12, options.max_iterations) : options.max_iterations;
    result.newton = newton.solve(equations, z, nullptr, limit, work, start.mixed);
    spent += result.newton.iterations;
    if (result.newton.converged) break;
  }
  result.newton.iterations = spent;
  if (!result.newton.converged) return result;
  const VectorX q1 = euler ? z : VectorX(2.0 * z - state.q);
  Configuration before, after;
  compute_configuration(model, state, state.q, before);
  compute_configuration(model, state, q1, after);
  if (!q1.allFinite() || !after.length.allFinite()) return result;
  result.largest_turn = largest_turn(model, before, after);
  if (result.largest_turn > 1.5) return result;
  result.change = q1 - state.q;
  const VectorX mean = result.change / dt;
  VectorX v1 = euler ? mean : VectorX(2.0 * mean - state.v);
  // Held unknowns have no dynamics of their own: midpoint's 2 v - v0 would ring for ever.
  VectorX free_part = v1;
  equations.assembler().project(free_part);
  v1 = free_part + equations.assembler().held_part(mean);
  const VectorX acceleration = (v1 - state.v) / dt;
  const VectorX jerk = acceleration - state.acceleration;
  result.error = euler ? 0.5 * dt * dt * newton.displacement(acceleration) : dt * dt / 12.0 * newton.displacement(jerk);
  book_work(equations, parameters, result);
  if (!model.constraints.empty()) {
    const VectorX assumed = equations.mass.cwiseProduct((z - state.q) / (h * h) - state.v / h);
    book_supports(equations, assumed, state.v, v1, dt, work.evaluation.full_residual, result);
  }
  accept_configuration(model, q1, after, state);
  state.v = v1;
  state.acceleration = acceleration;
  state.time += dt;
  result.accepted = true;
  return result;
}

StepResult verlet_step(Equations& equations, const Parameters& parameters, double dt, const HeldTarget& held,
                       State& state, NewtonWorkspace& work) {
  StepResult result;
  const Model& model = equations.model();
  if (!held.reachable) return result;
  const VectorX q0 = state.q;
  State from;
  if (!state.acceleration_current)
    state.acceleration = explicit_acceleration(equations, parameters, dt, state, q0, state.v, from, work);
  VectorX half = state.v + 0.5 * dt * state.acceleration;
  equations.assembler().project(half);
  half += equations.assembler().held_part(held.q - q0) / dt;
  const VectorX q1 = q0 + dt * half;
  Configuration before, after;
  compute_configuration(model, state, q0, before);
  compute_configuration(model, state, q1, after);
  if (!q1.allFinite() || !after.length.allFinite()) return result;
  result.largest_turn = largest_turn(model, before, after);
  if (result.largest_turn > 1.5) return result;
  // Forces want the frames at q1 itself: measured from the start of the step, the turn of direct transport would come
  // in at first order, with nothing to cancel it.
  State next = state;
  accept_configuration(model, q1, after, next);
  // Drag, viscosity and the spin couple want the velocity at the end; a predicted one is second order.
  const VectorX arriving = half + 0.5 * dt * state.acceleration;
  next.acceleration = explicit_acceleration(equations, parameters, dt, next, next.q, arriving, from, work);
  next.acceleration_current = true;
  next.v = half + 0.5 * dt * next.acceleration;
  if (!next.v.allFinite()) return result;
  result.change = q1 - q0;
  book_work(equations, parameters, result);
  if (!model.constraints.empty())
    book_supports(equations, VectorX::Zero(model.dof_count), state.v, next.v, dt, work.evaluation.full_residual,
                  result);
  next.time += dt;
  state = std::move(next);
  result.newton.converged = true;
  result.accepted = true;
  return result;
}

double stable_step(Equations& equations, const Parameters& parameters, const State& state, NewtonWorkspace& work) {
  equations.begin(state, parameters, 0.0, false);
  equations.evaluate(state.q, true, nullptr, work.evaluation);
  const LinearSolver& solver = equations.assembler().solver();
  const VectorX scale = equations.mass.cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
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

}  // namespace withe
