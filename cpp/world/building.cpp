#include <algorithm>
#include <cmath>
#include <utility>

#include "common/check.hpp"
#include "common/text.hpp"
#include "model/edge_vectors.hpp"
#include "run/checks.hpp"
#include "run/end_corrections.hpp"
#include "run/frames.hpp"
#include "run/grips.hpp"
#include "run/separation.hpp"
#include "run/transfer.hpp"
#include "world/implementation.hpp"

namespace withe {
World::Implementation::Implementation(SceneDescription scene, Options choice)
    : Built(built_of(std::move(scene), choice)) {
  require(options.time_step > 0.0 && std::isfinite(options.time_step), "time_step must be positive and finite");
  rebuild(Rebuild::first);
  check_reversible(model, options, parameters);
  if (description.contact.overlap == Overlap::separate && contact())
    separated = separate(model, parameters, options, state);
  check_overlap(model, parameters, state, contact());
  if (options.integrator == Integrator::verlet) {
    stable_explicit_step = stable_step(systems.scheme(), parameters, custom().at_rest(), state, systems.work);
    require(options.time_step <= stable_explicit_step,
            "time_step must not exceed the stable step of the explicit scheme, " + text(stable_explicit_step) +
                " s, got " + text(options.time_step) + " s");
  }
}

World::Implementation::Implementation(const Implementation& other) : Implementation(other, Unbuilt{}) {
  systems.build(model, options);
}

World::Implementation::Implementation(const Implementation& other, Unbuilt /*unused*/)
    : Built(other), Running(other), statistics(other.statistics), warnings(other.warnings) {
  systems.work.newton.counters = other.systems.work.newton.counters;
  listen();
}

void World::Implementation::listen() {
  systems.work.newton.poll = [this] {
    if (interrupted.exchange(false)) throw Interrupted();
    if (callbacks.poll) callbacks.poll();
  };
}

/// The running state, of another model.
void World::Implementation::carry_over(const Model& old, Rebuild why) {
  const State from = state;
  std::vector<std::vector<int>> held_before;
  for (const Support& s : old.supports) held_before.push_back(s.nodes);
  std::vector<bool> is_new(at(model.frame_count), true);
  for (int f = 0; f < model.frame_count; ++f) is_new[at(f)] = known_half(model, f, old) < 0;
  state = transferred(old, from, model);
  // A motion that is prescribed in the course of a step may leave the plane: the step still returns to its start.
  if (why == Rebuild::running && kept.state.q.size() == old.dof_count) {
    kept.state = transferred(old, kept.state, model);
    kept.predictor.clear();
  } else {
    static_cast<Moving&>(kept) = Moving{};
  }
  ElasticCoefficients elastic;
  set_elastic(parameters, elastic);
  // Frames that come and go carry inertia, and a support may change where the mass of edges sits.
  MassMatrix mass;
  set_mass(old, parameters, mass);
  turn_bodies(old, parameters, from, mass);
  const double before = kinetic_energy(old, mass, from.v);
  update_derived(model, parameters);
  relax_frames(model, parameters, is_new, state);
  if (why == Rebuild::running) {
    regrip(model, held_before, motions, state);
    keep_moments(old, elastic, configuration(), model, parameters);
  }
  set_mass(model, parameters, mass);
  turn_bodies(model, parameters, state, mass);
  ledger.support_work += kinetic_energy(model, mass, state.v) - before;
}

/// Builds the model for the present supports and plane; a running state is carried over.
void World::Implementation::rebuild(Rebuild why) {
  account_for_settings();
  if (tape) tape->refuse("supports were added or removed during the run, or the scene left its plane");
  const double stored = why == Rebuild::running ? elastic_energy(model, parameters, state, energy_scratch) : 0.0;
  Model fresh = model_of_active(*this, why == Rebuild::running);
  systems.drop_scratch();
  spatial_twin.reset();
  listen();
  energy_scratch = EnergyScratch{};
  predictor.clear();
  const Model old = std::exchange(model, std::move(fresh));
  systems.build(model, options);
  if (why == Rebuild::first)
    begin_as_drawn(*this, *this, energy_scratch.configuration);
  else
    carry_over(old, why);
  description.uncorrected_ends = model.description.uncorrected_ends;
  // Half stencils go with the support that has held their frame.
  if (why == Rebuild::running) ledger.support_work += elastic_energy(model, parameters, state, energy_scratch) - stored;
  if (Contact* contact = systems.scheme().contact()) contact->initialise(state, parameters);
  reaction_current = false;
  plan_current = false;
}

void World::Implementation::remake_equations() {
  model.description.loads = description.loads;
  spatial_twin.reset();
  systems.build(model, options);
  systems.forget_matrix();
  reaction_current = false;
  state.acceleration_current = false;
  plan_current = false;
}

void World::Implementation::leave_plane(const std::string& why) {
  require(!options.planar.value_or(false), why + " leaves the plane of the scene: build the scene with planar=False");
  spatial = true;
  plane_left_by = why;
  rebuild(Rebuild::running);
}

}  // namespace withe
