#pragma once
/// Result of one equilibrium of the suspended sheet.

#include "elastica/sheet.hpp"

namespace withe {

/// Angles in rad, lengths in Lgb, forces in w Lgb, moments in w Lgb^2.
struct SheetSolution {
  double x = 0, z = 0, angle = 0, suspended = 0;
  double normal_force = 0, tangential_force = 0;  ///< forces of the floor on the sheet at lift-off; forward is positive
  double max_curvature = 0;
  double tip_moment = 0;
  bool valid = false, stable = false;
};

/// `valid` if the floor pushes and no part of the sheet is below it.
SheetSolution describe_sheet(const SheetShape& shape, const SheetProblem::Path& path);

}  // namespace withe
