#pragma once
/// Unknowns that supports hold at given poses.

#include <vector>

#include "run/running.hpp"

namespace withe {

/// Finds the held unknowns where supports have given poses.
void hold(const Model& model, const Moving& now, const std::vector<SupportPose>& supports, HeldTarget& target);

}  // namespace withe
