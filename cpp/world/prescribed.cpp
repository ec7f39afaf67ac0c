#include <algorithm>
#include <cmath>
#include <utility>

#include "common/check.hpp"
#include "model/edge_vectors.hpp"
#include "run/drive.hpp"
#include "world/implementation.hpp"

namespace withe {

CustomForces World::Implementation::custom_forces(double time, const VectorX& q, const VectorX& v,
                                                  bool derivatives) const {
  MatrixX3 positions(model.node_count, 3), velocities(model.node_count, 3);
  for (int i = 0; i < model.node_count; ++i) {
    positions.row(i) = node_position(model, q, i);
    velocities.row(i) = node_vector(model, v, i);
  }
  CustomForces now = callbacks.force(time, positions, velocities, derivatives);
  check_custom_forces(model, now);
  return now;
}

/// Notes the actuation that the state came with, before it changes.
void World::Implementation::note_actuation() {
  if (!actuation_changed) actuation_before = actuation_of(parameters);
  actuation_changed = true;
}

/// The state has moved with the present shapes; those that have come to their end are at rest from now on.
void World::Implementation::retire_ramps() {
  actuation_changed = false;
  for (NaturalRamp& ramp : ramps) {
    ramp.curvature.retire(state.time);
    ramp.twist.retire(state.time);
    ramp.stretch.retire(state.time);
  }
}

Prescribed World::Implementation::at_rest() const {
  Prescribed out;
  put_custom_force(out);
  return out;
}

void World::Implementation::note(const CustomForces& now) {
  custom_force = now.forces;
  if (description.custom_moments) custom_moments = now.moments;
}

void World::Implementation::find_custom_force(double time, const VectorX& q, const VectorX& v) {
  note(custom_forces(time, q, v, false));
}

/// Custom forces of a step of dt are those where the scheme's own forces act.
void World::Implementation::prescribe_custom(double dt, Prescribed& out) {
  if (!description.has_custom_force) return;
  if (callbacks.force && description.custom_implicit && options.integrator != Integrator::verlet) {
    out.respond = [this, time = force_time(state.time, dt)](const VectorX& q, const VectorX& v, bool derivatives) {
      CustomForces now = custom_forces(time, q, v, derivatives);
      note(now);
      return now;
    };
    return;
  }
  if (callbacks.force) find_custom_force_of_step(dt, out);
  put_custom_force(out);
}

CustomResponse World::Implementation::custom_response_at_rest(double time) const {
  if (!callbacks.force) return nullptr;
  return [this, time](const VectorX& q, const VectorX& v, bool derivatives) {
    CustomForces now = custom_forces(time, q, VectorX::Zero(v.size()), derivatives);
    now.by_velocity.resize(0, 0);
    return now;
  };
}

void World::Implementation::prescribe_custom_at_rest(double time, Prescribed& out) {
  put_custom_force(out);
  CustomResponse at_rest = custom_response_at_rest(time);
  if (!at_rest) return;
  out.respond = [this, at_rest = std::move(at_rest)](const VectorX& q, const VectorX& v, bool derivatives) {
    CustomForces now = at_rest(q, v, derivatives);
    note(now);
    return now;
  };
}

/// Forces at the start of a step would feed a spring's oscillation, by 1 + (w dt)^2 / 2 a step. At q0 + (dt / 2) v0,
/// which under the midpoint rule is q1 - (dt / 2) v1 as well, they leave the step symmetric in time, of second order,
/// and stable for a spring of frequency w < 2 / dt, however stiff the rod that it pulls at: its matrix has the
/// determinant 1 and the trace 2 - (w dt)^2. Backward Euler's at the predicted end damp, for w < sqrt(4/3) / dt.
/// Verlet's end is known.
void World::Implementation::find_custom_force_of_step(double dt, Prescribed& out) {
  VectorX &q = systems.work.z, &v = systems.work.velocity;
  if (options.integrator == Integrator::verlet) {
    if (!state.acceleration_current) find_custom_force(state.time, state.q, state.v);
    put_custom_force(out);
    begin_verlet(systems.scheme(), parameters, out, dt, state, systems.work);
    find_custom_force(state.time + dt, q, v);
    return;
  }
  const Assembler& assembler = systems.scheme().assembler();
  const double time = force_time(state.time, dt);
  const auto hold = [&] {
    assembler.project(v);
    assembler.add_held_change(state.q, out.held.q, 1.0 / dt, v);
  };
  v = state.v;
  hold();
  q = state.q + (time - state.time) * v;
  if (conserving()) {
    extrapolate_velocity(state, time, v);
    hold();
  }
  find_custom_force(time, q, v);
}

void World::Implementation::put_custom_force(Prescribed& out) const {
  if (description.has_custom_force) out.custom = applied_forces(model, custom_force, custom_moments);
}

}  // namespace withe
