#include "integrators/squeezed.hpp"

#include <algorithm>
#include <cmath>

#include "contact/pressing.hpp"

namespace withe {
namespace {

/// Of a distance's slope, what may lie on free unknowns where none of them can relieve it: the curve of a rod passes a
/// little beside its nodes.
constexpr double kFree = 0.05;
/// The same where a warning is all that follows: beside the middle of an edge, normals of the curve are a little
/// aslant.
constexpr double kNearlyFree = 0.2;

/// Depth at which surfaces are drawn touching, to rounding, over the smaller radius.
constexpr double kTouching = 1e-4;

/// Depth of two surfaces in each other beyond `allowed`, a share of the smaller radius [m].
double excess(const Touching& t, double allowed) {
  return t.pair.radii() - t.proximity.distance - allowed * t.pair.small_radius();
}

/// How a distance changes with the unknowns that are free; returns the size of the whole slope.
double free_slope(const Equations& equations, int contact, VectorX& out) {
  double slope[12];
  int dofs[kContactUnknowns];
  distance_slope(equations.contact()->contacts()[contact], slope);
  equations.contact()->unknowns(contact, dofs);
  out.setZero(equations.model().dof_count);
  for (int k = 0; k < 12; ++k)
    if (dofs[k] >= 0) out(dofs[k]) += slope[k];
  const double all = out.norm();
  equations.assembler().project(out);
  return all;
}

/// What relieves one contact presses on the other by the share `c`: neither is relieved where the sum of their depths
/// is too great, whatever moves. Such a contact moves what moves the first most, which few do.
int opposite_contact(const Equations& equations, int contact, double allowed, double free, const VectorX& slope,
                     VectorX& other) {
  const ContactSet& set = equations.contact()->contacts();
  Eigen::Index steepest = 0;
  const double size = slope.norm(), most = slope.cwiseAbs().maxCoeff(&steepest);
  for (int j = 0; j < set.count() && most > 0.0; ++j) {
    if (j == contact || set[j].lagged >= 0 || set[j].pair.rod_a != set[contact].pair.rod_a) continue;
    int dofs[kContactUnknowns];
    equations.contact()->unknowns(j, dofs);
    if (std::find(dofs, dofs + 12, steepest) == dofs + 12) continue;
    free_slope(equations, j, other);
    const double c = size / std::max(other.norm(), 1e-300);
    if ((slope + c * other).norm() <= free * size && excess(set[contact], allowed) + c * excess(set[j], allowed) > 0.0)
      return j;
  }
  return -1;
}

}  // namespace

Squeezed squeezed_contact(const Equations& equations, VectorX& slope, VectorX& other) {
  const Contact* contact = equations.contact();
  if (contact == nullptr) return {};
  for (int i = 0; i < contact->count(); ++i) {
    const Touching& t = contact->contacts()[i];
    if (t.lagged >= 0 || !(excess(t, kDeepest) > 0.0)) continue;
    const double all = free_slope(equations, i, slope);
    if (slope.norm() <= kFree * all) return {i};
    if (const int against = opposite_contact(equations, i, kDeepest, kFree, slope, other); against >= 0)
      return {i, against};
  }
  return {};
}

Squeezed opposite_contacts(const Equations& equations, VectorX& slope, VectorX& other) {
  const Contact* contact = equations.contact();
  if (contact == nullptr) return {};
  const ContactSet& set = contact->contacts();
  const auto obstacle = [](const Touching& t) { return std::min(t.pair.key.b, 0); };
  const auto is_other = [&](const Touching& t) { return obstacle(t) < 0 && obstacle(t) != obstacle(*set.begin()); };
  if (set.count() == 0 || std::none_of(set.begin(), set.end(), is_other)) return {};
  for (int i = 0; i < set.count(); ++i) {
    const Touching& t = set[i];
    if (t.lagged >= 0 || obstacle(t) == 0 || contact->has_given_stiffness(t.pair) || !(excess(t, kTouching) > 0.0))
      continue;
    if (free_slope(equations, i, slope); slope.norm() == 0.0) continue;
    if (const int against = opposite_contact(equations, i, kTouching, kNearlyFree, slope, other); against >= 0)
      return {i, against};
  }
  return {};
}

}  // namespace withe
