#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/check.hpp"
#include "common/text.hpp"
#include "forces/tendon.hpp"
#include "geometry/rotation.hpp"
#include "model/edge_vectors.hpp"
#include "run/checks.hpp"
#include "run/end_corrections.hpp"
#include "run/frames.hpp"
#include "run/grips.hpp"
#include "run/separation.hpp"
#include "run/transfer.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

/// Explicit steps would have to be shorter for the narrow contact of light loads.
SceneDescription described_for(SceneDescription scene, const Options& options) {
  if (options.integrator == Integrator::verlet) scene.contact.light = 1.0;
  return scene;
}

}  // namespace

World::Implementation::Implementation(SceneDescription scene, Options choice)
    : description(described_for(std::move(scene), choice)), drawn_contact(description.contact), options(choice) {
  require(options.time_step > 0.0 && std::isfinite(options.time_step), "time_step must be positive and finite");
  rebuild(Rebuild::first);
  check_reversible(model, options, parameters);
  if (description.contact.overlap == Overlap::separate && contact())
    separated = separate(model, parameters, options, state);
  check_overlap(model, parameters, state, contact());
  if (options.integrator == Integrator::verlet) {
    stable_explicit_step = stable_step(systems.scheme(), parameters, at_rest(), state, systems.work);
    require(options.time_step <= stable_explicit_step,
            "time_step must not exceed the stable step of the explicit scheme, " + text(stable_explicit_step) +
                " s, got " + text(options.time_step) + " s");
  }
}

World::Implementation::Implementation(const Implementation& other) : Implementation(other, Unbuilt{}) {
  systems.build(model, options);
}

World::Implementation::Implementation(const Implementation& other, Unbuilt /*unused*/)
    : Running(other),
      description(other.description),
      drawn_contact(other.drawn_contact),
      options(other.options),
      model(other.model),
      plane_left_by(other.plane_left_by),
      statistics(other.statistics),
      separated(other.separated),
      stable_explicit_step(other.stable_explicit_step),
      spatial(other.spatial),
      warnings(other.warnings) {
  systems.work.newton.counters = other.systems.work.newton.counters;
  listen();
}

void World::Implementation::listen() {
  systems.work.newton.poll = [this] {
    if (interrupted.exchange(false)) throw Interrupted();
    if (callbacks.poll) callbacks.poll();
  };
}

/// The model for the supports that are active. Released ones keep their row until another takes it, but hold nothing.
Model World::Implementation::model_of_active(Rebuild why) {
  SceneDescription active = description;
  active.supports.clear();
  std::vector<std::size_t> index;
  for (std::size_t s = 0; s < description.supports.size(); ++s) {
    if (s < model.supports.size() && !model.supports[s].active) continue;
    active.supports.push_back(description.supports[s]);
    index.push_back(s);
  }
  Model fresh = build_model(active, spatial ? std::optional<bool>(false) : options.planar);
  if (why == Rebuild::running && !model.planar() && fresh.planar()) {
    spatial = true;  // what kept the drawing from being planar is gone, but the state need not be in the plane
    fresh = build_model(active, false);
  }
  std::vector<Support> all(description.supports.size());
  for (std::size_t s = 0; s < all.size(); ++s) all[s].description = description.supports[s];
  for (std::size_t k = 0; k < index.size(); ++k) all[index[k]] = fresh.supports[k];
  fresh.supports = all;
  return fresh;
}

/// Drops what has the sizes of the old model.
void World::Implementation::drop_scratch() {
  systems.drop_scratch();
  spatial_twin.reset();
  listen();
  energy_scratch = EnergyScratch{};
  predictor.clear();
}

/// The state as it is drawn.
void World::Implementation::begin_as_drawn() {
  parameters = initial_parameters(model);
  parameters.lumped = options.integrator == Integrator::verlet;
  state = initial_state(model);
  ramps.assign(description.rods.size(), NaturalRamp{});
  motions.assign(description.supports.size(), SupportMotion{});
  custom_force = MatrixX3::Zero(model.node_count, 3);
  custom_moments = MatrixX3::Zero(description.custom_moments ? model.node_count : 0, 3);
  for (std::size_t s = 0; s < motions.size(); ++s) {
    motions[s].position = motions[s].from_position = motions[s].to_position =
        node_position(model, state.q, model.supports[s].node);
    if (model.supports[s].is_hand()) grasp(model, configuration(), static_cast<int>(s), state, motions);
  }
  note_drawn_actuation();
}

/// Notes where rods are not drawn as they are free of stress, or tendons pull from the start.
void World::Implementation::note_drawn_actuation() {
  constexpr double kRounded = 1e-9;  // [rad] of a stencil
  const Actuation now = actuation_of(parameters);
  actuation_before = relaxed_actuation(model, parameters, configuration());
  double apart = 0.0;
  for (std::size_t r = 0; r < now.curvature.size(); ++r) {
    if (now.twist[r].size() == 0) continue;
    const VectorX& voronoi = model.rod_voronoi[r];
    const MatrixX2 bent = now.curvature[r] - actuation_before.curvature[r];
    const VectorX twisted = now.twist[r] - actuation_before.twist[r];
    apart = std::max({apart, (voronoi.asDiagonal() * bent).cwiseAbs().maxCoeff(),
                      voronoi.cwiseProduct(twisted).cwiseAbs().maxCoeff()});
  }
  actuation_changed = apart > kRounded || !now.tension.isZero(0.0);
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
  const double before = kinetic_energy(old, mass, from.v);
  update_derived(model, parameters);
  relax_frames(model, parameters, is_new, state);
  if (why == Rebuild::running) {
    regrip(model, held_before, motions, state);
    keep_moments(old, elastic, configuration(), model, parameters);
  }
  set_mass(model, parameters, mass);
  ledger.support_work += kinetic_energy(model, mass, state.v) - before;
}

/// Builds the model for the present supports and plane; a running state is carried over.
void World::Implementation::rebuild(Rebuild why) {
  account_for_settings();
  if (tape) tape->refuse("supports were added or removed during the run, or the scene left its plane");
  const double stored = why == Rebuild::running ? elastic_energy(model, parameters, state, energy_scratch) : 0.0;
  Model fresh = model_of_active(why);
  drop_scratch();
  const Model old = std::exchange(model, std::move(fresh));
  systems.build(model, options);
  if (why == Rebuild::first)
    begin_as_drawn();
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
