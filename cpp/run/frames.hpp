#pragma once
/// Orientations and rates of the frames of joints and clamps in a running scene, and their hinges.

#include <vector>

#include "elasticity/elements.hpp"
#include "model/model.hpp"

namespace withe {

/// Rotation of a frame from the drawn axes.
Matrix3 frame_rotation(const Model& model, const State& state, int frame);
/// Angular velocity of an edge, by its nodes and its spin [rad/s].
Vector3 angular_velocity(const Model& model, const State& state, const Configuration& c, int edge);

/// Gives each of some frames the orientation that stresses its halves least, with the edges where they are.
void relax_frames(const Model& model, const Parameters& parameters, const std::vector<bool>& which, State& state);
/// Relaxes frames as `relax_frames` does, as far as nothing holds them, where edges were set that are attached to them.
/// In a plane the frames that hinges have beside them are relaxed at the same time.
void relax_joints(const Model& model, const Parameters& parameters, const std::vector<bool>& is_set, State& state);
/// Turns frames at the rate at which the edges at them turn, in the mean, where one of these edges was set. Hinges turn
/// at the rate that is left about their axes.
void turn_frames(const Model& model, const std::vector<bool>& is_set, State& state);

}  // namespace withe
