#pragma once
/// What steps add to energies beyond the work of their forces.

#include <vector>

#include "common/types.hpp"

namespace withe {

/// Per connected component of a scene, in a midpoint or backward Euler step: by how much its edges turn at most [rad],
/// and what its energies, kinetic and elastic, grow by beyond the work of the forces of the step [J].
struct ComponentGains {
  VectorX turn, energy;
  /// Where edges turn by no more than this [rad], and stretching gains no more than that [J], nothing else is looked
  /// at.
  double small_turn = 0;
  VectorX small_gain;
  std::vector<char> whole;  ///< whether all was looked at

  bool any_whole() const {
    for (const char each : whole)
      if (each) return true;
    return false;
  }
};

}  // namespace withe
