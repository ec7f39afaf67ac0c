/// What is pressed by what does not yield ends in an error that names it.

#include "integrators/squeezed.hpp"

#include <algorithm>

#include "common/text.hpp"
#include "world/implementation.hpp"

namespace withe {

/// Refuses a place of supports in which what they hold is inside something that does not yield either. `q`: where they
/// shall be, and all else as it is.
void World::Implementation::check_squeezed(Equations& system, const VectorX& q, double dt) {
  if (!system.contact() || model.constraints.empty()) return;
  system.begin(state, parameters, StepRule::statics, 0.0);
  system.contact()->update(q);
  const int found = squeezed_contact(system, work.change);
  if (found >= 0) fail_squeezed(system, found, dt);
}

void World::Implementation::fail_squeezed(const Equations& system, int contact, double dt) const {
  const Touching& t = system.contact()->contacts()[contact];
  const double depth = t.pair.radii() - t.proximity.distance, share = 100.0 * depth / t.pair.small_radius();
  const auto rod_of = [&](int edge) { return "rod '" + description.rods[at(model.edge_rod[at(edge)])].name + "'"; };
  const std::string other =
      t.pair.key.b < 0 ? "'" + description.contact.obstacles[at(-1 - t.pair.key.b)].name + "'" : rod_of(t.pair.key.b);
  const int node = model.edge_tail[at(t.pair.key.a)];
  const Place place = place_of_node(t.proximity.points.s > 0.5 ? model.edge_head[at(t.pair.key.a)] : node);
  throw ConvergenceFailure(
      rod_of(t.pair.key.a) + " is pressed " + text(depth) + " m into " + other + ", " + text(share, 2) +
          " % of its contact radius," + place.words + " (time " + text(state.time, 6) + " s, step " + text(dt) +
          " s), by what does not yield: neither does what holds it, nor that, and no force between them is right; the "
          "world is left in its last accepted state. Move the support less far, hold the rod by what yields, such as a "
          "spring, or where it does not touch, or take a smaller contact_radius",
      state.time, dt, place.rod, place.node, 0.0);
}

}  // namespace withe
