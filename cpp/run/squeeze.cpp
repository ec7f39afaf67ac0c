#include "run/squeeze.hpp"

#include <algorithm>
#include <numbers>

#include "common/text.hpp"
#include "run/failure.hpp"
#include "run/places.hpp"

namespace withe {

std::string squeeze_warning(const Model& model, const Parameters& parameters, const Equations& system,
                            const State& state, StepWorkspace& work) {
  const SceneDescription& description = model.description;
  const Contact* contact = system.contact();
  if (!contact || description.contact.obstacles.size() < 2) return "";
  const Squeezed found = opposite_contacts(system, work.change, work.mean);
  if (!found) return "";
  const Touching &a = contact->contacts()[found.contact], &b = contact->contacts()[found.against];
  const auto other = [&](const Touching& t) {
    return t.pair.key.b < 0 ? "'" + description.contact.obstacles[at(-1 - t.pair.key.b)].name + "'"
                            : name_of(model, model.edge_rod[at(t.pair.key.b)]);
  };
  const int edge = a.pair.key.a;
  if (model.is_surface(edge)) return "";  // bodies have no modulus
  const double radius = contact->surfaces().radius(edge);
  const double modulus = parameters.edge_stretch(edge) / (std::numbers::pi * radius * radius);
  return "Rod '" + description.rods[at(model.edge_rod[at(edge)])].name + "' is squeezed between " + other(a) + " and " +
         other(b) + " (time " + text(state.time, 6) +
         " s). Both are rigid, so the force depends on the contact stiffness, which was "
         "not given. Use stiffness= of scene.enable_contact: half of Young's modulus "
         "times the edge length is " +
         text(0.5 * modulus * model.edge_arc(edge), 2) +
         " N/m here. Or press with a part that yields, such as a hand with stiffness=.";
}

void fail_squeezed(const Model& model, const Equations& system, const State& state, const Squeezed& squeezed,
                   double dt) {
  const SceneDescription& description = model.description;
  const ContactSet& set = system.contact()->contacts();
  const Touching& t = set[squeezed.contact];
  const double depth = t.pair.radii() - t.proximity.distance;
  const auto rod_of = [&](int edge) { return name_of(model, model.edge_rod[at(edge)]); };
  const auto other = [&](const ContactKey& key) {
    return key.b < 0 ? "'" + description.contact.obstacles[at(-1 - key.b)].name + "'" : rod_of(key.b);
  };
  const int node = model.edge_tail[at(t.pair.key.a)];
  const Place place = place_of_node(model, t.proximity.points.s > 0.5 ? model.edge_head[at(t.pair.key.a)] : node);
  const auto share = [&](double length) { return text(100.0 * length / t.pair.scale, 2); };
  const bool of_body = model.is_surface(t.pair.key.a);  // which the words begin with
  const std::string when =
      (of_body ? "" : place.words) + " (time " + text(state.time, 6) + " s, step " + text(dt) + " s)";
  std::string what = rod_of(t.pair.key.a);
  if (squeezed.against < 0) {
    what += " is pressed " + text(depth) + " m into " + other(t.pair.key) + ", " + share(depth) +
            " % of its contact radius," + when +
            ": support and obstacle are both rigid, so the force between them is not "
            "defined; the simulation keeps its last accepted state. Move the support less "
            "far, hold the rod by a spring or away from the contact, or use a smaller "
            "contact_radius";
  } else {
    const Touching& a = set[squeezed.against];
    const double both = depth + a.pair.radii() - a.proximity.distance;
    what += " is squeezed between " + other(t.pair.key) + " and " + other(a.pair.key) + ", which leave a gap " +
            text(both) + " m smaller than the " + (of_body ? "body" : "rod") + " is thick, " + share(both) +
            " % of its contact radius," + when +
            ": both are rigid, so the force between them is not defined; the simulation "
            "keeps its last accepted state. Move them less near to each other, press with "
            "a part that yields, such as a hand with stiffness= or a rod on springs, or "
            "use a smaller contact_radius";
  }
  throw ConvergenceFailure(what, state.time, dt, place.rod, place.node, 0.0);
}

}  // namespace withe
