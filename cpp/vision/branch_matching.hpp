#pragma once
/// Which branches continue which through a zone: the pairs with the least bending energy.

#include <utility>
#include <vector>

#include "vision/crossing_zones.hpp"

namespace withe {

/// Bending energy of the line with least bending from one branch into another [1/px]. The line is a beam of unit
/// stiffness that is clamped at both ends. Its energy is 2/L (a^2 + a b + b^2) for a chord of length L and the signed
/// angles a and b between the chord and the ends. Cables that are bent before and after a crossing are bent inside it
/// too. Three quarters of the energy therefore count from the curvatures k1 and k2 of the two branches: a decreases by
/// L (k1/3 + k2/6), and b increases by L (k1/6 + k2/3).
double bending_energy(const Branch& from, const Branch& to);

/// Place at t, from 0 to 1, of the cubic line from a point in one direction to another point, which it reaches in
/// another direction (unit vectors).
Vector2 way_place(const Vector2& from, const Vector2& leaving, const Vector2& to, const Vector2& arriving, double t);

struct Matching {
  std::vector<std::pair<int, int>> pairs;  ///< pairs of branches; other branches end here
  double energy = 0;                       ///< [1/px]; infinite if none was found or there are too many branches
  double second = 0;                       ///< energy of the second best matching
  double plain = 0;                        ///< energy if touching were as likely as crossing
  double second_plain = 0;                 ///< least plain energy of all other matchings
};

/// Finds the best way to pair branches. If their number is odd, one branch stays single. Further single branches cost
/// as much as a sharp turn. `waist` is the half width of the mask at its narrowest place between the branches [px].
Matching match_branches(const std::vector<Branch>& branches, double waist);

/// Energy of an end without partner: half of that of a turn of 90 degrees within a width [1/px].
double single_energy(double width);

struct PairCandidate {
  int a = -1;
  int b = -1;
  double energy = 0;
};

/// Pairs ends so that the sum of the energies of all pairs and of all single ends is least. `singles` holds the energy
/// of each end without partner. Only the six best candidates of each end are considered.
std::vector<std::pair<int, int>> pair_ends(const std::vector<double>& singles, std::vector<PairCandidate> candidates);

/// Pairs branches by least energy, without the assumptions about touching cables.
struct EndMatching {
  std::vector<std::pair<int, int>> pairs;
  double energy = 0;  ///< with the energy of single ends [1/px]
};
EndMatching match_ends(const std::vector<Branch>& branches);

}  // namespace withe
