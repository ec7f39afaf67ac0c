/// Checks of a running scene that warn once, and the error of a step that fails.

#include "common/text.hpp"
#include "integrators/squeezed.hpp"
#include "run/places.hpp"
#include "run/squeeze.hpp"
#include "world/implementation.hpp"

namespace withe {

Warnings World::take_warnings() { return implementation_->warnings.take(); }

void World::Implementation::check_resolution() {
  if (!warnings.has_reported(Warning::mesh))
    warnings.report(Warning::mesh, unresolved_mesh(model, parameters, state, configuration()));
}

void World::Implementation::check_squeeze() {
  if (!warnings.has_reported(Warning::squeeze))
    warnings.report(Warning::squeeze, squeeze_warning(model, parameters, systems.scheme(), state, systems.work));
}

/// Refuses a place of supports in which what they hold is inside something that does not yield either. `q`: where they
/// shall be, and all else as it is.
void World::Implementation::check_squeezed(Equations& system, const Prescribed& given, const VectorX& q, double dt) {
  if (!system.contact()) return;
  system.begin(state, parameters, StepRule::statics, 0.0, given);
  system.contact()->update(q);
  if (const Squeezed found = squeezed_contact(system, systems.work.change, systems.work.mean))
    fail_squeezed(model, system, state, found, dt);
}

void World::Implementation::fail(const NewtonResult& r, double dt, const std::string& what,
                                 const std::string& hint) const {
  const bool slips = contact() && contact()->regularises();
  const Place place = place_of(model, r.worst_row);
  throw ConvergenceFailure(
      what + " (time " + text(state.time, 6) + " s" + (dt > 0.0 ? ", step " + text(dt) + " s" : "") + ", residual " +
          text(r.residual) + " N" + place.words + ")" + crushed_edge(model, state) +
          "; the simulation keeps its last accepted state. " +
          (hint.empty() ? what_to_try(model, options, parameters, state, configuration(), slips) : hint),
      state.time, dt, place.rod, place.node, r.residual);
}

void World::Implementation::begin_crossing_watch() {
  if (!description.contact.warns_of_crossings || description.rods.size() < 2 ||
      warnings.has_reported(Warning::crossing))
    return;
  if (!crossing_watch) crossing_watch = std::make_unique<CrossingWatch>(model);
  crossing_watch->begin(model, state.q);
}

void World::Implementation::check_crossings() {
  if (!crossing_watch || warnings.has_reported(Warning::crossing)) return;
  const auto [a, b] = crossing_watch->find(model, state.q);
  if (a < 0) return;
  const auto name = [&](int edge) { return name_of(model, model.edge_rod[at(edge)]); };
  const auto edge = [&](int e) { return std::to_string(e - model.rod_first_edge[at(model.edge_rod[at(e)])]); };
  warnings.report(Warning::crossing, "Without contact, " + name(a) + " and " + name(b) +
                                         " pass through each other, with edge " + edge(a) + " and edge " + edge(b) +
                                         " (time " + text(state.time, 6) +
                                         " s). Call scene.enable_contact() before scene.build(), or "
                                         "scene.enable_contact(rods=False) if they may pass through each other.");
  crossing_watch.reset();
}

}  // namespace withe
