#pragma once
/// Read-outs of a scene, in world coordinates. `c` is the configuration of the state.

#include "model/model.hpp"
#include "model/state.hpp"

namespace withe {

struct Momentum {
  Vector3 linear = Vector3::Zero();   ///< [kg m/s]
  Vector3 angular = Vector3::Zero();  ///< about the origin [kg m^2/s]
};

/// Positions of every node [m].
MatrixX3 positions(const Model& model, const State& state);
/// Velocities of every node [m/s].
MatrixX3 velocities(const Model& model, const State& state);
/// Directors of the edges of a rod; each row has d1, d2 and t.
MatrixX9 directors(const Model& model, const Configuration& c, int rod);
/// Curvatures of the smooth rod, per stencil [1/m].
MatrixX2 curvatures(const Model& model, const Parameters& parameters, const Configuration& c, int rod);
/// Twists of a rod, per stencil [rad/m].
VectorX twists(const Model& model, const Configuration& c, int rod);
/// Length of a tendon from its first guide to its last [m].
double tendon_length(const Model& model, const Parameters& parameters, const State& state, const Configuration& c,
                     int tendon);
/// Positions of a tendon's guides [m].
MatrixX3 tendon_points(const Model& model, const State& state, const Configuration& c, int tendon);
/// Angle of what turns from how it is drawn, whole turns counted [rad].
double joint_angle(const Model& model, const State& state, int joint);
/// Angular velocity of each edge about its tangent [rad/s].
VectorX spins(const Model& model, const State& state, int rod);
/// Axial force of an edge [N].
double edge_tension(const Model& model, const Parameters& parameters, const Configuration& c, int edge);
/// The part of a revolute joint that turns. Throws std::invalid_argument where there is none.
const JointAngle& checked_joint(const Model& model, int joint);
/// Rate of a revolute joint by the angular velocities of the edges on either side [rad/s].
double joint_rate(const Model& model, const State& state, const Configuration& c, int joint);

/// Linear momentum P and angular momentum J. They are the derivatives of the kinetic energy by a velocity common to
/// all, and by an angular velocity about the origin.
///   P = sum of (M v) over nodes,  J = sum of x x (M v) + sum of I omega t over edges + sum of I w over joints' frames.
/// In a plane edges do not spin, and frames turn about its normal. A hinge's angle is relative: it adds nothing.
Momentum momentum(const Model& model, const Parameters& parameters, const State& state);

}  // namespace withe
