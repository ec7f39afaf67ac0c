#pragma once
/// Maps derivatives by held unknowns to derivatives by poses of supports.

#include "steps/hand_forces.hpp"

namespace withe {

/// Derivatives of a scalar by poses of supports, zero for released supports, and by positions of obstacles.
struct PoseAdjoint {
  MatrixX3 positions;  ///< per support [1/m]
  MatrixX3 rotations;  ///< per support, by a rotation vector [1/rad]
  MatrixX3 obstacles;  ///< per obstacle, by its position [1/m]
};

/// Derivatives by quantities in their drawn place: held unknowns, and at the start of a run all unknowns.
struct DrawnAdjoint {
  MatrixX3 nodes;      ///< per node [1/m]
  MatrixX3 edge_turn;  ///< per edge, by how its directors are turned about it, as a rotation vector [1/rad]
};

/// `by` has derivatives by all unknowns. Of the free ones only nodes and edges count, because frames keep their drawn
/// orientation.
DrawnAdjoint by_drawing(const Model& model, const VectorX& q, const VectorX& by);

/// Poses of hands per support, and their grasped points.
struct HandsHeld {
  const std::vector<SupportPose>& poses;
  const std::vector<HandState>& grasped;
};

/// Maps derivatives by positions of obstacles from the axes of the unknowns (`ObstaclePlace`) to those of space.
MatrixX3 by_places(const Model& model, const MatrixX3& obstacles);

/// `held` is in coordinates of the state, in which the unknowns are q. `by_hands` has additional derivatives by hands,
/// and for yielding hands all of them.
PoseAdjoint by_poses(const Model& model, const VectorX& q, const VectorX& held, const HandAdjoint& by_hands,
                     const HandsHeld& hands);

}  // namespace withe
