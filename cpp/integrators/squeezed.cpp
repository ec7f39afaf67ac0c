#include "integrators/squeezed.hpp"

#include <algorithm>

#include "contact/pressing.hpp"

namespace withe {
namespace {

/// Of a distance's slope, what may lie on free unknowns where none of them can relieve it: the curve of a rod passes a
/// little beside its nodes.
constexpr double kFree = 0.05;

}  // namespace

int squeezed_contact(const Equations& equations, VectorX& scratch) {
  const Contact* contact = equations.contact();
  if (contact == nullptr || equations.model().constraints.empty()) return -1;
  for (int i = 0; i < contact->count(); ++i) {
    const Touching& t = contact->contacts()[i];
    if (t.lagged >= 0 || !(t.pair.radii() - t.proximity.distance > kDeepest * t.pair.small_radius())) continue;
    double slope[12];
    int dofs[kContactUnknowns];
    distance_slope(t, slope);
    contact->unknowns(i, dofs);
    scratch.setZero(equations.model().dof_count);
    for (int k = 0; k < 12; ++k)
      if (dofs[k] >= 0) scratch(dofs[k]) += slope[k];
    const double all = scratch.norm();
    equations.assembler().project(scratch);
    if (scratch.norm() <= kFree * all) return i;
  }
  return -1;
}

}  // namespace withe
