#pragma once
/// Which edges of a rod a hand touches, and where a ring is on it.

#include "model/model.hpp"

namespace withe {

/// Finds the edges that a hand touches, for an otherwise resolved support. Throws std::invalid_argument if the hand is
/// not on the rod.
void find_touched(const Model& model, Support& hand);

}  // namespace withe
