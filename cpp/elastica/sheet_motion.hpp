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

/// Coulomb's law for a sheet that lies as a rigid body behind its lift-off point: |T| <= friction (R + weight of
/// what lies).
struct SheetFriction {
  double coefficient = 0;
  double sheet_length = 0;  ///< [Lgb]
};

/// Moves the tip as move_sheet does, and lets the sheet slide where its forces would exceed friction. `slide` is how
/// far it has slid back, away from where its tip lay [Lgb]; poses are those of the tip in the frame of the floor. False
/// where no equilibrium is within reach, the sheet snaps, and where nothing of it lies any more.
bool drag_sheet(const SheetPose& pose, const SheetFriction& friction, double& slide, SheetMotionData& data);

}  // namespace withe
