#pragma once
/// From derivatives by unknowns that supports hold to those by poses of supports.

#include "steps/hand_forces.hpp"

namespace withe {

/// Derivatives of a scalar by poses of supports, zero for those that are released, and by places of obstacles.
struct PoseAdjoint {
  MatrixX3 positions;  ///< per support [1/m]
  MatrixX3 rotations;  ///< per support, by a rotation vector [1/rad]
  MatrixX3 obstacles;  ///< per obstacle, by its position [1/m]
};

/// Derivatives by what is where it was drawn: what supports hold, and at the start of a run all.
struct DrawnAdjoint {
  MatrixX3 nodes;      ///< per node [1/m]
  MatrixX3 edge_turn;  ///< per edge, by how its directors are turned about it, as a rotation vector [1/rad]
};

/// `by`: of all unknowns; what supports do not hold counts of nodes and edges alone, as frames are where they are
/// drawn.
DrawnAdjoint by_drawing(const Model& model, const VectorX& q, const VectorX& by);

/// Hands, per support: where they are, and what they have grasped.
struct HandsHeld {
  const std::vector<SupportPose>& poses;
  const std::vector<HandState>& grasped;
};

/// By places of obstacles, `ObstaclePlace` being in the axes of the unknowns, in those of space.
MatrixX3 by_places(const Model& model, const MatrixX3& obstacles);

/// `held`: in coordinates of the state, in which the unknowns are q; `by_hands`: what comes besides, of yielding ones
/// all.
PoseAdjoint by_poses(const Model& model, const VectorX& q, const VectorX& held, const HandAdjoint& by_hands,
                     const HandsHeld& hands);

}  // namespace withe
