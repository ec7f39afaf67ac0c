#pragma once
/// Which edges of a rod a hand touches, and where a ring is on it.

#include "model/model.hpp"

namespace withe {

/// Finds what a hand touches, whose support is otherwise resolved. Throws std::invalid_argument where that is off the
/// rod.
void find_touched(const Model& model, Support& hand);

}  // namespace withe
