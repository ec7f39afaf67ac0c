#include "elastica/sheet_motion.hpp"

#include <cmath>

namespace withe {

namespace {

constexpr double kLeastShare = 1.0 / 256;  // of a way between two poses on which a sheet is dragged

bool move_to(TipTarget target, const SheetPose& from, const SheetPose& to, SheetMotionData& data,
             double least = kLeastShare) {
  data.problem.target = target;
  return follow(data.solver, data.problem, least, data.path, data.trial,
                [&](double share, SheetProblem::Path& /*guess*/) {
                  for (std::size_t i = 0; i < 3; ++i) data.problem.goal[i] = from[i] + share * (to[i] - from[i]);
                });
}

SheetPose pose_of(const SheetProblem::Path& path) { return {tip_back(path), tip_up(path), tip_angle(path)}; }

}  // namespace

void set_sheet_forces(const SheetShape& shape, const SheetForces& forces, SheetMotionData& data) {
  data.problem.shape = shape;
  data.path.values = forces;
  data.path.nodes.assign(1, {});
  for (int k = 0; k < SheetProblem::kSegments; ++k) data.path.nodes.push_back(across_segment(shape, data.path, k));
}

bool move_sheet(const SheetPose& pose, SheetMotionData& data, double least_share) {
  return move_to(TipTarget::pose, pose_of(data.path), pose, data, least_share);
}

bool drag_sheet(const SheetPose& pose, const SheetFriction& friction, double& slide, SheetMotionData& data) {
  const SheetProblem::Path before = data.path;
  const SheetPose from = pose_of(before);
  const auto excess = [&] {
    const auto& [up, forward, length] = data.path.values;
    return std::abs(forward) - friction.coefficient * (up + friction.sheet_length - length);
  };
  const bool stuck = move_to(TipTarget::pose, from, {pose[0] - slide, pose[1], pose[2]}, data);
  if (stuck && excess() <= 0) return true;
  // Where it would stick it has no equilibrium, or one beyond friction: it slides as its forces push it.
  const double sign = (stuck ? data.path.values[1] : before.values[1]) > 0 ? 1.0 : -1.0;
  data.problem.friction = sign * friction.coefficient;
  data.problem.sheet_length = friction.sheet_length;
  if (!stuck) data.path = before;
  if (!move_to(TipTarget::sliding, pose_of(data.path), pose, data)) return false;
  const double slid = pose[0] - tip_back(data.path) - slide;
  slide += slid;
  return sign * slid > -1e-9;  // friction that would push a sheet along is no friction: what was found lies past a snap
}

}  // namespace withe
