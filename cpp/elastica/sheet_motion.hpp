#pragma once
/// A sheet whose tip is held at a pose: its equilibrium for given forces, and its slide while the pose changes.
///
/// If the moment at the tip is free, three numbers name an equilibrium: the forces R, T of the floor at lift-off and
/// the suspended length. They pose an initial value problem. Continuation from a known equilibrium reaches a pose
/// (x, z, theta) of the tip.

#include <array>
#include <vector>

#include "elastica/sheet_solution.hpp"

namespace withe {

/// R, T [w Lgb] and the suspended length [Lgb].
using SheetForces = std::array<double, 3>;
/// x, z [Lgb] as of TipTarget::position, theta.
using SheetPose = std::array<double, 3>;

/// Caller's scratch; `path` is the present equilibrium.
struct SheetMotionData {
  ShootingSolver<SheetProblem> solver;
  SheetProblem problem;
  SheetProblem::Path path, trial;
};

/// Makes data.path the equilibrium of given forces, by integration from the lift-off point.
void set_sheet_forces(const SheetShape& shape, const SheetForces& forces, SheetMotionData& data);

/// Moves the tip from its place in data.path to a pose. Returns false if the motion ends before: at a snap, or at the
/// smallest increment, `least_share` of the motion.
bool move_sheet(const SheetPose& pose, SheetMotionData& data, double least_share = 1.0 / 16);

/// Coulomb's law for a sheet whose part behind the lift-off point lies like a rigid body: |T| <= friction (R + weight
/// of this part).
struct SheetFriction {
  double coefficient = 0;
  double sheet_length = 0;  ///< [Lgb]
};

/// Moves the tip like move_sheet, and lets the sheet slide if its forces would exceed friction. `slide`: distance that
/// the sheet has slid back, away from the place where its tip lay [Lgb]. Poses are poses of the tip in the frame of the
/// floor. Returns false if no equilibrium is within reach (the sheet snaps), or if no part of the sheet lies on the
/// floor.
bool drag_sheet(const SheetPose& pose, const SheetFriction& friction, double& slide, SheetMotionData& data);

}  // namespace withe
