#pragma once
/// Motions and forces that are prescribed for a step from outside, as a value.

#include <functional>
#include <vector>

#include "forces/custom_forces.hpp"
#include "model/state.hpp"

namespace withe {

/// Held unknowns at the end of a step.
struct HeldTarget {
  VectorX q;                  ///< undefined for free unknowns
  double turn = 0, spin = 0;  ///< greatest turn of a frame in space, of an edge about itself, within the step [rad]
  bool reachable = true;      ///< false if a frame would have to turn by half a turn within the step
};

/// Position and orientation of a support.
struct SupportPose {
  Vector3 position = Vector3::Zero();      ///< [m]
  Matrix3 rotation = Matrix3::Identity();  ///< columns: its axes
  double fed = 0.0;                        ///< length fed by the drive of a ring [m]
};

/// Custom forces as the equations take them.
struct AppliedForces {
  VectorX force;                 ///< per unknown [N]
  std::vector<Vector3> moments;  ///< per node, in world axes [N m]; empty: none
};

/// Custom forces at configuration q and velocities v.
using CustomResponse = std::function<CustomForces(const VectorX& q, const VectorX& v, bool derivatives)>;

/// Must outlive every problem that begins with it. An empty member means: as at the start of the step.
struct Prescribed {
  HeldTarget held;
  std::vector<SupportPose> supports;     ///< at the end of the step
  std::vector<ObstaclePlace> obstacles;  ///< at the end of the step
  AppliedForces custom;                  ///< custom forces that act throughout the step; empty: none
  CustomResponse respond;                ///< custom forces that are solved for; if it is set, `custom` does not act

  /// Supports and obstacles rest; no custom force acts.
  static const Prescribed& nothing();
};

}  // namespace withe
