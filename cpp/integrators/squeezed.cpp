#include "integrators/squeezed.hpp"

#include <algorithm>
#include <cmath>

#include "contact/pressing.hpp"
#include "steps/carried_parts.hpp"

namespace withe {
namespace {

/// Slope of a distance on free unknowns, over the whole slope, where no free unknown can relieve the contact: the curve
/// of a rod passes a little beside its nodes.
constexpr double kMaxFreeSlope = 0.05;
/// The same where only a warning follows: beside the middle of an edge, normals of the curve are oblique by up to that.
constexpr double kMaxFreeSlopeOfWarning = 0.2;

/// Depth over the smaller radius: surfaces that are drawn touching are less deep in each other, by rounding in files.
constexpr double kMaxDrawnDepth = 1e-4;

/// Depth of two surfaces in each other beyond `allowed`, a share of the smaller radius [m].
double excess(const Touching& t, double allowed) {
  return t.pair.radii() - t.proximity.distance - allowed * t.pair.scale;
}

/// Derivative of a distance by the free unknowns; returns the size of the whole slope.
double free_slope(const Equations& equations, int contact, VectorX& out) {
  double slope[12];
  int dofs[kContactUnknowns];
  distance_slope(equations.contact()->contacts()[contact], slope);
  equations.contact()->unknowns(contact, dofs);
  out.setZero(equations.model().dof_count);
  for (int k = 0; k < 12; ++k)
    if (dofs[k] >= 0) out(dofs[k]) += slope[k];
  const double all = out.norm();
  if (!equations.model().carried.empty()) {  // contacts of bodies are on nodes that these carry
    VectorX magnitude = VectorX::Zero(out.size());
    fold_rows(equations.problem(), equations.contact()->contacts().q(), out, magnitude);
  }
  equations.assembler().project(out);
  return all;
}

/// Contact opposite to another one. A motion that relieves the first contact presses on the opposite one by the share
/// `c`. If the sum of their depths is too great, no motion relieves both. The opposite contact is found on the unknowns
/// that move the first contact most, which are few.
int opposite_contact(const Equations& equations, int contact, double allowed, double free, const VectorX& slope,
                     VectorX& other) {
  const ContactSet& set = equations.contact()->contacts();
  Eigen::Index steepest = 0;
  const double size = slope.norm(), most = slope.cwiseAbs().maxCoeff(&steepest);
  for (int j = 0; j < set.count() && most > 0.0; ++j) {
    if (j == contact || set[j].lagged >= 0 || set[j].pair.rod_a != set[contact].pair.rod_a) continue;
    int dofs[kContactUnknowns];
    equations.contact()->unknowns(j, dofs);
    if (equations.model().carried.empty() && std::find(dofs, dofs + 12, steepest) == dofs + 12) continue;
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
    if (t.lagged >= 0 || !(excess(t, kMaxDepth) > 0.0)) continue;
    const double all = free_slope(equations, i, slope);
    if (slope.norm() <= kMaxFreeSlope * all) return {i};
    if (const int against = opposite_contact(equations, i, kMaxDepth, kMaxFreeSlope, slope, other); against >= 0)
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
    if (t.lagged >= 0 || obstacle(t) == 0 || contact->has_given_stiffness(t.pair) || !(excess(t, kMaxDrawnDepth) > 0.0))
      continue;
    if (free_slope(equations, i, slope); slope.norm() == 0.0) continue;
    if (const int against = opposite_contact(equations, i, kMaxDrawnDepth, kMaxFreeSlopeOfWarning, slope, other);
        against >= 0)
      return {i, against};
  }
  return {};
}

}  // namespace withe
