#include "run/running.hpp"

#include <algorithm>

#include "geometry/rotation.hpp"

namespace withe {

double ramp_fraction(double time, double start, double end) {
  if (time >= end) return 1.0;
  return std::clamp((time - start) / (end - start), 0.0, 1.0);
}

SupportPose SupportMotion::pose_at(double time) const {
  const double s = shift.fraction(time), turned = turn.fraction(time);
  return {(1.0 - s) * from_position + s * to_position,
          rotation_exp(turned * rotation_log(to_rotation * from_rotation.transpose())) * from_rotation,
          fed_before + feed_rate * (time - feeds_since)};
}

void SupportMotion::put(const SupportPose& pose) {
  position = pose.position;
  rotation = pose.rotation;
  fed = pose.fed;
}

std::vector<SupportPose> poses_of(const std::vector<SupportMotion>& motions) {
  std::vector<SupportPose> poses;
  for (const SupportMotion& m : motions) poses.push_back(m.pose());
  return poses;
}

ObstacleWay ObstacleMotion::at(double time) const {
  const double share = shift.fraction(time), turned = turn.fraction(time);
  return {(1.0 - share) * from.shift + share * to.shift, (1.0 - turned) * from.turn + turned * to.turn};
}

}  // namespace withe
