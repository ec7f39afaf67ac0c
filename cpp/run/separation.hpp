#pragma once
/// Rods that are drawn inside each other, or inside an obstacle, are moved apart before a simulation starts.

#include "integrators/options.hpp"
#include "model/state.hpp"

namespace withe {

/// Moves overlapping rods apart in a scene with contact, and returns the greatest displacement [m]; 0 if none overlap.
double separate(const Model& model, const Parameters& parameters, const Options& options, State& state);

}  // namespace withe
