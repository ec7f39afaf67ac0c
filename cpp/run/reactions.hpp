#pragma once
/// Reactions of supports from the residual of the last solve.

#include <span>
#include <vector>

#include "run/running.hpp"
#include "steps/joint_wrenches.hpp"

namespace withe {

/// Turns rows of frames that supports hold from forces on Cayley increments into moments. `turn`: share of the step's
/// turn at which the forces act. The residual of a frame's unknowns is J(w)^T moment, w the turn there.
void make_frame_moments(const Model& model, const VectorX& held, double turn, Found& found);

/// Reaction of a support on the rod in the last evaluation: about its node, that of a hand about the origin. `held`:
/// the rows of the residual that supports hold.
Wrench reaction_of(const Model& model, const Found& found, int support, const VectorX& held);

/// From the point of the carrier to that of the moving part of a sliding joint, as its forces act in the last
/// evaluation [m]. `in_middle`: true if they act in the middle of a step. `joint`: number of the joint.
Vector3 slide_displacement(const Model& model, const Found& found, const State& state, int joint, bool in_middle);
/// Force and moment of the other parts at a joint on those of `side`, by the wrenches on all its parts. Throws
/// std::invalid_argument where they do not give it: rods on both sides, or supports.
Wrench wrench_of_side(const Model& model, const std::vector<JointPart>& parts, std::span<const Wrench> wrenches,
                      const std::vector<RodPass>& side);

}  // namespace withe
