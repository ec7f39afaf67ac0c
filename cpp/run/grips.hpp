#pragma once
/// Poses of supports that take hold of a rod, and what hands hold.

#include <vector>

#include "run/running.hpp"

namespace withe {

/// Motion of a support that has just been put on, where it holds what is there.
SupportMotion standing(const Model& model, const State& state, const Configuration& c, const Support& support);
/// Has a hand hold what it touches as it is now.
void grasp(const Model& model, const Configuration& c, int hand, State& state, std::vector<SupportMotion>& motions);
/// Has hands hold, where they are now, nodes that another hand held before. `held_before`: nodes per support.
void regrip(const Model& model, const std::vector<std::vector<int>>& held_before,
            const std::vector<SupportMotion>& motions, State& state);

}  // namespace withe
