#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/check.hpp"
#include "common/text.hpp"
#include "forces/tendon.hpp"
#include "geometry/rotation.hpp"
#include "model/edge_vectors.hpp"
#include "run/end_corrections.hpp"
#include "run/frames.hpp"
#include "run/grips.hpp"
#include "run/step_watch.hpp"
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
  check_reversible(parameters);
  if (description.contact.overlap == Overlap::separate) separate();
  check_overlap();
  if (options.integrator == Integrator::verlet) {
    plan.stable_step = stable_step(systems.scheme(), parameters, at_rest(), state, systems.work);
    require(options.time_step <= plan.stable_step,
            "time_step must not exceed the stable step of the explicit scheme, " + text(plan.stable_step) + " s, got " +
                text(options.time_step) + " s");
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
      plan(other.plan),
      plan_current(other.plan_current),
      plane_left_by(other.plane_left_by),
      statistics(other.statistics),
      separated(other.separated),
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
  make_plan();
}

void World::Implementation::remake_equations() {
  model.description.loads = description.loads;
  spatial_twin.reset();
  systems.build(model, options);
  systems.forget_matrix();
  reaction_current = false;
  state.acceleration_current = false;
  make_plan();
}

namespace {}  // namespace

void World::Implementation::leave_plane(const std::string& why) {
  require(!options.planar.value_or(false), why + " leaves the plane of the scene: build the scene with planar=False");
  spatial = true;
  plane_left_by = why;
  rebuild(Rebuild::running);
}

void World::Implementation::add_contact_notes() {
  const ContactDescription& contact = description.contact;
  if (!contact.any()) {
    plan.notes.emplace_back("no contact: no broad phase");
    return;
  }
  if (!contact.obstacles.empty())
    plan.notes.push_back(std::to_string(contact.obstacles.size()) +
                         " obstacle(s): their terms stay between neighbouring nodes");
  plan.notes.push_back(contact.rods ? "rods touch each other: they are coupled only where they are near"
                                    : "rods do not touch each other: no broad phase");
  if (contact.rods) add_coarse_notes();
  if (separated > 0.0)
    plan.notes.push_back("rods that overlapped as drawn were moved apart, by up to " + std::to_string(separated) +
                         " m: they are stressed there");
  if (!systems.scheme().contact()->frictional()) plan.notes.emplace_back("no friction: contact stays symmetric");
  if (options.integrator == Integrator::verlet && systems.scheme().contact()->regularises())
    plan.notes.emplace_back(
        "static friction limits explicit steps to about slip_tolerance / (7.5 mu) "
        "times the mass of a node over its contact force, which is unknown before the "
        "run");
}

/// Warns of rods whose edges are longer than they are thick: to contact they are chains of straight pieces.
void World::Implementation::add_coarse_notes() {
  for (std::size_t r = 0; r < description.rods.size(); ++r) {
    const VectorX& radius = description.rods[r].contact_radius;
    if (radius.size() == 0 || !(radius.minCoeff() > 0.0)) continue;
    const int first = model.rod_first_edge[r];
    const double ratio = (model.edge_length.segment(first, radius.size()).array() / (2.0 * radius.array())).maxCoeff();
    if (ratio <= 1.0 + 1e-9) continue;
    plan.notes.push_back("warning: edges of rod '" + description.rods[r].name + "' are " + text(ratio) +
                         " times as long as the rod is thick, and touch as straight pieces: more nodes "
                         "make contact smooth");
  }
}

std::string World::Implementation::fluid_note() const {
  switch (description.fluid.model) {
    case FluidModel::resistive:
      return "fluid: resistive-force theory, implicit; rods do not interact through the "
             "fluid";
    case FluidModel::stokeslets:
      return "fluid: regularized Stokeslet segments couple all " + std::to_string(model.node_count) +
             " nodes, once a step by conjugate gradients; the matrix of the steps does not "
             "change";
    case FluidModel::none:
      break;
  }
  return "no fluid: its terms are left out";
}

void World::Implementation::make_plan() {
  plan_current = true;
  const double stable = plan.stable_step;
  plan = Plan{};
  plan.stable_step = stable;
  plan.planar = model.planar();
  plan.unknowns = model.dof_count;
  plan.solver =
      options.integrator == Integrator::verlet ? "none (explicit)" : systems.scheme().assembler().solver().name();
  auto& notes = plan.notes;
  if (model.planar()) {
    plan.plane_normal = model.plane->normal;
    notes.push_back(
        "planar: 2 unknowns a node, no twist; a scene that could buckle out of its "
        "plane stays in its plane (build(planar=False) to force 3D)");
  } else {
    notes.push_back("3D: " + (options.planar.has_value() && !*options.planar ? std::string("planar=False")
                              : spatial                                      ? std::string("the scene left its plane")
                                                                             : model.plane_reason));
  }
  if (!plane_left_by.empty()) notes.push_back("left the plane while running: " + plane_left_by);
  for (const std::string& reason : systems.scheme().asymmetries()) notes.push_back("unsymmetric Jacobian: " + reason);
  if (parameters.held_lumped)
    notes.emplace_back(
        "fourth order, and a support has moved: the mass of edges that supports hold sits at their nodes");
  if (!parameters.dragged) notes.push_back("no drag: its terms are left out");
  notes.push_back(fluid_note());
  if (!parameters.viscous) notes.push_back("no viscosity: its terms are left out");
  for (const std::string& note : systems.scheme().notes()) notes.push_back(note);
  if (description.loads.empty()) notes.push_back("no loads but gravity");
  add_contact_notes();
  for (const std::string& note : step_notes(model, options, parameters)) notes.push_back(note);
  notes.push_back("kernels: " + std::string(name_of(instruction_set())) +
                  (instruction_set() == InstructionSet::baseline ? ", 2 numbers at once" : ", 4 numbers at once"));
}

}  // namespace withe
