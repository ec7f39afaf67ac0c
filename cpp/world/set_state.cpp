#include <algorithm>
#include <cmath>

#include "common/check.hpp"
#include "run/checks.hpp"
#include "run/placing.hpp"
#include "world/implementation.hpp"

namespace withe {

void World::set_state(const std::vector<RodState>& rods, std::optional<double> time) {
  for (const RodState& rod : rods) check_shapes(implementation_->model, rod);
  require(!time || std::isfinite(*time), "time must be finite");
  // On a copy, so that what is refused changes nothing.
  auto fresh = std::make_unique<Implementation>(accounted());
  fresh->systems.recall(implementation_->systems.lagged());
  fresh->callbacks = implementation_->callbacks;
  for (const RodState& rod : rods)
    if (leaves_plane(fresh->model, fresh->state, rod)) {
      fresh->leave_plane("a state of rod '" + fresh->description.rods[at(rod.rod)].name + "'");
      break;
    }
  if (time) fresh->state.time = *time;
  fresh->place(rods);
  implementation_ = std::move(fresh);
}

void World::Implementation::place(const std::vector<RodState>& rods) {
  if (const std::vector<bool> moved = place_rods(model, parameters, rods, *this); !moved.empty()) {
    renew_contacts(moved);
    forget_motion();
    systems.forget_matrix();
  }
  set_rates(model, rods, state);
  forget_motion();
}

/// Finds the contacts of moved rods again; all other contacts continue.
void World::Implementation::renew_contacts(const std::vector<bool>& moved) {
  Contact* contact = systems.scheme().contact();
  if (!contact) return;
  const auto is_moved = [&](int edge) { return edge >= 0 && moved[at(model.edge_rod[at(edge)])]; };
  std::erase_if(state.contacts, [&](const ContactRecord& r) { return is_moved(r.key.a) || is_moved(r.key.b); });
  systems.forget_contacts();
  contact->initialise(state, parameters);
  check_overlap(model, parameters, state, contact);
}

void World::Implementation::forget_motion() {
  state.acceleration.setZero();
  state.acceleration_current = false;
  predictor.clear();
  state.motion.known = 0;
  first_energy.reset();
  reaction_current = false;
}

}  // namespace withe
