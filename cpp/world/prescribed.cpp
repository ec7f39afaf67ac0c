#include <utility>

#include "run/custom_drive.hpp"
#include "world/implementation.hpp"

namespace withe {

/// Notes the actuation that the state came with, before it changes.
void World::Implementation::note_actuation() {
  if (!actuation_changed) actuation_before = actuation_of(parameters);
  actuation_changed = true;
}

/// The state has moved with the present shapes; those that have come to their end are at rest from now on.
void World::Implementation::retire_ramps() {
  actuation_changed = false;
  for (NaturalRamp& ramp : ramps.natural) {
    ramp.curvature.retire(state.time);
    ramp.twist.retire(state.time);
    ramp.stretch.retire(state.time);
  }
  std::erase_if(ramps.numbers, [this](const NumberRamp& ramp) { return state.time >= ramp.span.end; });
}

/// Custom forces of a step of dt are those where the scheme's own forces act.
void World::Implementation::prescribe_custom(double dt, Prescribed& out) {
  if (!description.has_custom_force) return;
  if (callbacks.force && description.custom_implicit && options.integrator != Integrator::verlet) {
    custom().put_response(force_time(options, state.time, dt), out);
    return;
  }
  if (callbacks.force) find_custom_force_of_step(dt, out);
  custom().put(out);
}

/// Forces at the start of a step would feed a spring's oscillation, by 1 + (w dt)^2 / 2 a step. Therefore they are
/// taken at q0 + (dt / 2) v0, which under the midpoint rule is q1 - (dt / 2) v1 as well. The step is then symmetric in
/// time and of second order. It is stable for a spring of frequency w < 2 / dt, however stiff the rod is that the
/// spring pulls: its matrix has the determinant 1 and the trace 2 - (w dt)^2. Under backward Euler, forces at the
/// predicted end damp for w < sqrt(4/3) / dt. The end of a Verlet step is known.
void World::Implementation::find_custom_force_of_step(double dt, Prescribed& out) {
  VectorX &q = systems.work.z, &v = systems.work.velocity;
  if (options.integrator == Integrator::verlet) {
    if (!state.acceleration_current) custom().find(state.time, state.q, state.v);
    custom().put(out);
    begin_verlet(systems.scheme(), parameters, out, dt, state, systems.work);
    custom().find(state.time + dt, q, v);
    return;
  }
  const Assembler& assembler = systems.scheme().assembler();
  const double time = force_time(options, state.time, dt);
  const auto hold = [&] {
    assembler.project(v);
    assembler.add_held_change(state.q, out.held.q, 1.0 / dt, v);
  };
  v = state.v;
  hold();
  q = state.q + (time - state.time) * v;
  if (acts_in_middle(options.integrator)) {
    extrapolate_velocity(state, time, v);
    hold();
  }
  custom().find(time, q, v);
}

}  // namespace withe
