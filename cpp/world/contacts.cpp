#include <string>

#include "common/check.hpp"
#include "common/text.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

Vector3 in_space(const Model& model, const Vec3d& v, bool is_point) {
  if (!model.planar()) return to_eigen(v);
  const Plane& p = *model.plane;
  return v.x * p.first + v.y * p.second + (is_point ? p.origin : Vector3(Vector3::Zero()));
}

/// Whether a node of one edge is where one of the other is, to rounding.
bool nodes_meet(const Model& model, const VectorX& q, int a, int b) {
  const int first[2] = {model.edge_tail[at(a)], model.edge_head[at(a)]},
            second[2] = {model.edge_tail[at(b)], model.edge_head[at(b)]};
  for (int i : first)
    for (int j : second)
      if ((node_position(model, q, i) - node_position(model, q, j)).norm() <= 1e-9 * model.length_scale) return true;
  return false;
}

}  // namespace

ContactTable World::contacts() const {
  const Implementation& self = *implementation_;
  ContactTable table;
  table.bodies.resize(0, 5);
  table.numbers.resize(0, 14);
  const Contact* contact = self.systems.scheme().contact();
  if (contact == nullptr) return table;
  const Model& model = self.model;
  const std::vector<ContactReport> reports = contact->report(self.state, self.parameters);
  const auto rows = static_cast<Eigen::Index>(reports.size());
  table.bodies.resize(rows, 5);
  table.numbers.resize(rows, 14);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const ContactReport& r = reports[static_cast<std::size_t>(i)];
    const int rod_a = model.edge_rod[at(r.key.a)], rod_b = r.key.b < 0 ? r.key.b : model.edge_rod[at(r.key.b)];
    table.bodies.row(i) << rod_a, r.key.a - model.rod_first_edge[at(rod_a)], rod_b,
        r.key.b < 0 ? -1 : r.key.b - model.rod_first_edge[at(rod_b)], r.sticking ? 1 : 0;
    const Vector3 point = in_space(model, r.point, true), normal = in_space(model, r.normal, false),
                  friction = in_space(model, r.friction, false);
    table.numbers.row(i) << r.distance, r.gap, point.transpose(), normal.transpose(), r.force, friction.transpose(),
        r.s, r.t;
  }
  return table;
}

/// Refuses a drawing in which surfaces are inside each other; bodies that a step has pressed together are.
void World::Implementation::check_overlap() const {
  const Contact* contact = systems.scheme().contact();
  if (contact == nullptr) return;
  const ContactReport* deepest = nullptr;
  const std::vector<ContactReport> reports = contact->report(state, parameters);
  const bool bars = description.contact.law == ContactLaw::barrier;  // which is infinite where surfaces touch
  double depth = bars ? 0.0 : kMaxDepth, overlap = 0.0;
  const auto bodies = [&](const ContactKey& key) {
    return std::pair(model.edge_rod[at(key.a)], key.b < 0 ? key.b : model.edge_rod[at(key.b)]);
  };
  for (const ContactReport& r : reports) {
    const auto goes_on = [&](const ContactRecord& record) { return bodies(record.key) == bodies(r.key); };
    if (std::any_of(state.contacts.begin(), state.contacts.end(), goes_on)) continue;
    const double radius = r.key.b < 0
                              ? contact->surfaces().radius(r.key.a)
                              : std::min(contact->surfaces().radius(r.key.a), contact->surfaces().radius(r.key.b));
    const double drawn = bars ? -r.gap : r.drawn_depth();
    if (drawn <= depth * radius && !(bars && r.gap <= 0.0)) continue;
    depth = drawn / radius;
    overlap = drawn;
    deepest = &r;
  }
  if (deepest == nullptr) return;
  const auto name = [&](int edge) {
    const int rod = model.edge_rod[at(edge)];
    return "edge " + std::to_string(edge - model.rod_first_edge[at(rod)]) + " of rod '" +
           description.rods[at(rod)].name + "'";
  };
  const std::string other = deepest->key.b < 0 ? "'" + description.contact.obstacles[at(-1 - deepest->key.b)].name + "'"
                                               : name(deepest->key.b);
  const bool meet = deepest->key.b >= 0 && nodes_meet(model, state.q, deepest->key.a, deepest->key.b);
  const std::string advice =
      description.contact.overlap == Overlap::separate
          ? std::string(" m at the start and cannot be moved apart") +
                (model.planar() && deepest->key.b >= 0 ? " within their plane: build with planar=False, " : ": ") +
                "draw them apart, or leave the pair out with ignore_contact"
          : std::string(" m at the start: ") + (meet ? "join the nodes that meet there, " : "") +
                "draw them apart, leave the pair out with ignore_contact, or use "
                "enable_contact(overlap='separate')";
  require(false, name(deepest->key.a) + " and " + other + " overlap by " + text(0.0 + overlap) + advice);
}

}  // namespace withe
