#include "elastica/sheet_motion.hpp"

#include <cmath>

namespace withe {

namespace {

constexpr double kLeastShare = 1.0 / 256;  // smallest share of a motion between two poses, for dragged sheets

bool move_to(const SheetPose& from, const SheetPose& to, SheetMotionData& data, double least = kLeastShare) {
  data.problem.target = TipTarget::pose;
  return follow(data.solver, data.problem, least, data.path, data.trial,
                [&](double share, SheetProblem::Path& /*guess*/) {
                  for (std::size_t i = 0; i < 3; ++i) data.problem.goal[i] = from[i] + share * (to[i] - from[i]);
                });
}

/// Moves height and angle to those of a pose, while the ratio of forces approaches the friction coefficient (with its
/// sign). A sheet that is held beyond friction is thus released gradually.
bool slide_to(const SheetPose& from, const SheetPose& to, double friction, double sheet_length, SheetMotionData& data,
              double least = kLeastShare) {
  const double lies = lying_weight(data.problem.shape.width, data.path, sheet_length);
  const double before = data.path.values[1] / (data.path.values[0] + lies);
  data.problem.target = TipTarget::sliding;
  data.problem.sheet_length = sheet_length;
  return follow(data.solver, data.problem, least, data.path, data.trial,
                [&](double share, SheetProblem::Path& /*guess*/) {
                  for (std::size_t i = 0; i < 3; ++i) data.problem.goal[i] = from[i] + share * (to[i] - from[i]);
                  data.problem.friction = before + share * (friction - before);
                });
}

SheetPose pose_of(const SheetProblem::Path& path) { return {tip_back(path), tip_up(path), tip_angle(path)}; }

}  // namespace

void set_sheet_forces(const SheetShape& shape, const SheetForces& forces, SheetMotionData& data) {
  data.problem.shape = shape;
  data.path.values = forces;
  set_nodes(shape, data.path);
}

bool move_sheet(const SheetPose& pose, SheetMotionData& data, double least_share) {
  return move_to(pose_of(data.path), pose, data, least_share);
}

bool drag_sheet(const SheetPose& pose, const SheetFriction& friction, double& slide, SheetMotionData& data) {
  const SheetProblem::Path before = data.path;
  const SheetPose from = pose_of(before);
  const auto excess = [&] {
    const double lies = lying_weight(data.problem.shape.width, data.path, friction.sheet_length);
    return std::abs(data.path.values[1]) - friction.coefficient * (data.path.values[0] + lies);
  };
  const auto some_lies = [&] { return data.path.values[2] < friction.sheet_length; };
  const bool stuck = move_to(from, {pose[0] - slide, pose[1], pose[2]}, data);
  if (stuck && excess() <= 0) return some_lies();
  // If a sticking sheet has no equilibrium, or one beyond friction, it slides in the direction of its forces.
  const double sign = (stuck ? data.path.values[1] : before.values[1]) > 0 ? 1.0 : -1.0;
  if (!stuck) data.path = before;
  if (!slide_to(pose_of(data.path), pose, sign * friction.coefficient, friction.sheet_length, data)) return false;
  const double slid = pose[0] - tip_back(data.path) - slide;
  slide += slid;
  // Friction cannot drive the motion of a sheet: such a solution is beyond a snap.
  return sign * slid > -1e-9 && some_lies();
}

}  // namespace withe
