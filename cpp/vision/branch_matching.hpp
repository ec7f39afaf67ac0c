#pragma once
/// Which branches continue which through a zone: the pairs with the least bending energy.

#include <utility>
#include <vector>

#include "vision/crossing_zones.hpp"

namespace withe {

/// Bending energy of the least bent line from one branch into another [1/px]: a beam of unit stiffness clamped at both
/// ends, 2/L (a^2 + a b + b^2) for a chord of length L and the signed angles a and b between chord and ends. Cables
/// that are bent before and after a crossing are bent inside it too, so three quarters of the energy are counted from
/// the curvatures k1 and k2 of the two branches: a is then less by L (k1/3 + k2/6), b more by L (k1/6 + k2/3).
double bending_energy(const Branch& from, const Branch& to);

struct Matching {
  std::vector<std::pair<int, int>> pairs;  ///< of branches; those left over end here
  double energy = 0;                       ///< [1/px]; infinite where none was found, or there are too many branches
  double second = 0;                       ///< of the second best
  double plain = 0;                        ///< energy if to touch were as likely as to cross
  double second_plain = 0;                 ///< the least of any other matching
};

/// The best way to pair branches; one more stays single where their number is odd, others only at the price of a sharp
/// turn. `waist` is the half width of the mask at its narrowest place between them [px].
Matching match_branches(const std::vector<Branch>& branches, double waist);

}  // namespace withe
