#include "elastica/sheet_solution.hpp"

#include "elastica/sheet_stability.hpp"

namespace withe {

SheetSolution describe_sheet(const SheetShape& shape, const SheetProblem::Path& path) {
  const SheetExtremes extremes = sheet_extremes(shape, path);
  SheetSolution found;
  found.x = tip_back(path);
  found.z = tip_up(path);
  found.angle = tip_angle(path);
  found.suspended = path.values[2];
  found.normal_force = path.values[0];
  found.tangential_force = path.values[1];
  found.tip_moment = path.nodes.back()[1];
  found.max_curvature = extremes.largest_curvature;
  found.stable = sheet_is_stable(shape, path);
  found.valid = found.normal_force > 0 && extremes.smallest_angle > -1e-9 && extremes.lowest > -1e-9;
  return found;
}

}  // namespace withe
