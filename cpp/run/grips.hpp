#pragma once
/// Poses of supports that take hold of a rod, and what hands hold.

#include <vector>

#include "run/running.hpp"

namespace withe {

/// Motion of a support that has just been put on, where it holds what is there.
SupportMotion standing(const Model& model, const State& state, const Configuration& c, const Support& support);
/// Makes a hand hold the edges that it touches, in their present pose.
void grasp(const Model& model, const Configuration& c, int hand, State& state, std::vector<SupportMotion>& motions);
/// Makes hands hold nodes that another hand held before, at their present places. `held_before`: nodes per support.
void regrip(const Model& model, const std::vector<std::vector<int>>& held_before,
            const std::vector<SupportMotion>& motions, State& state);

}  // namespace withe
