#pragma once
/// A sheet whose tip is held at a pose: what comes of any three numbers, and how it slides while the pose changes.
///
/// With a free moment at the tip an equilibrium is named by the floor's forces R, T at lift-off and the suspended
/// length, and is an initial value problem; a pose (x, z, theta) of the tip is met by continuation from one that is
/// known.

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

/// Moves the tip from where data.path has it to a pose; false where the way ends before, which is a snap or a limit of
/// what was asked for: steps of less than a share of it are not tried.
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
