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

}  // namespace withe
