#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <utility>

#include "model/model.hpp"

namespace withe {
namespace {

constexpr double kTolerance = 1e-10;

bool isotropic(const RodDescription& rod) {
  return ((rod.bend_stiffness.col(0) - rod.bend_stiffness.col(1)).array().abs() <=
          kTolerance * rod.bend_stiffness.col(0).array().abs())
      .all();
}

/// From the centreline to a guide of a tendon, as drawn [m].
Vector3 guide_arm(const SceneDescription& scene, const TendonDescription& tendon, std::size_t guide) {
  const auto& [rod, edge, place] = tendon.guides[guide];
  if (tendon.guides[guide].on_body()) return Vector3::Zero();
  const RodDescription& of = scene.rods[static_cast<std::size_t>(rod)];
  const auto e = static_cast<std::size_t>(edge);
  const Vector3 d1 = of.directors.row(edge),
                t = (scene.positions.row(of.nodes[(e + 1) % of.nodes.size()]) - scene.positions.row(of.nodes[e]))
                        .normalized();
  const Vector2 offset = tendon.offsets.row(static_cast<Eigen::Index>(guide));
  return offset.x() * d1 + offset.y() * t.cross(d1);
}

/// Length of the longest rod [m].
double size_of(const SceneDescription& scene) {
  double size = 0.0;
  for (const RodDescription& rod : scene.rods) size = std::max(size, rod.rest_lengths.sum());
  return size;
}

/// Collects unit directions that must lie in the plane.
void collect_directions(const SceneDescription& scene, std::vector<Vector3>& directions) {
  const auto add = [&](const Vector3& v, double scale) {
    if (v.norm() > kTolerance * scale) directions.push_back(v.normalized());
  };
  for (const RodDescription& rod : scene.rods) {
    const Vector3 start = scene.positions.row(rod.nodes.front());
    const double size = rod.rest_lengths.sum();
    for (int node : rod.nodes) add(Vector3(scene.positions.row(node).transpose()) - start, 1e3 * size);
    add(start - Vector3(scene.positions.row(scene.rods.front().nodes.front()).transpose()), 1e3 * size);
  }
  for (const BodyDescription& body : scene.bodies) {
    const Vector3 corner = scene.positions.row(scene.rods.front().nodes.front());
    std::vector<int> points = body.carried;
    points.push_back(body.node);
    for (int node : points) add(Vector3(scene.positions.row(node).transpose()) - corner, 1e3 * size_of(scene));
  }
  for (const TendonDescription& tendon : scene.tendons)
    for (std::size_t g = 0; g < tendon.guides.size(); ++g) add(guide_arm(scene, tendon, g), 0.0);
  add(scene.gravity, 0.0);
  for (const LoadDescription& load : scene.loads)
    if (!load.added && !is_axial(load.kind))
      for (const auto& value : load.values.rowwise()) add(value.transpose(), 0.0);
}

/// True if an obstacle meets rods in a plane as its cut by the plane does. Such obstacles are a plane that is normal to
/// the plane of the rods, and a capsule whose axis lies in the plane of the rods or crosses it at a right angle.
bool fits(const ObstacleDescription& o, const Vector3& corner, const Vector3& normal) {
  if (o.kind == ObstacleKind::plane) return std::abs(o.other.dot(normal)) < 1e-9;
  if (o.kind == ObstacleKind::shape) return false;
  const double start = (o.point - corner).dot(normal), end = (o.other - corner).dot(normal);
  const double size = 1e-9 * (o.radius + (o.other - o.point).norm());
  if (std::abs(start) <= size && std::abs(end) <= size) return true;
  const Vector3 axis = o.other - o.point;
  return axis.cross(normal).norm() <= size && start * end < 0.0;
}

/// Plane across a line, for a straight scene whose revolute joints or torsion springs turn about an axis across it.
std::optional<Vector3> turning_across(const SceneDescription& scene, const Vector3& line) {
  std::vector<Vector3> axes;
  for (const JointDescription& joint : scene.joints)
    for (const JointLink& link : joint.links)
      if (!link.slides) axes.push_back(link.axis);
  for (const TorsionDescription& torsion : scene.torsions) axes.push_back(torsion.axis);
  for (const Vector3& axis : axes)
    if (const Vector3 across = axis.cross(line); across.norm() > 0.5) return across.normalized();
  return std::nullopt;
}

/// The normal of the plane that directions span; none, with the reason, if they span no plane.
std::optional<Vector3> normal_of(const SceneDescription& scene, bool asked, std::vector<Vector3>& directions,
                                 std::string& reason) {
  Matrix3 spread = Matrix3::Zero();
  for (const Vector3& d : directions) spread += d * d.transpose();
  spread /= static_cast<double>(std::max<std::size_t>(directions.size(), 1));
  Eigen::JacobiSVD<Matrix3> svd(spread, Eigen::ComputeFullU);
  if (svd.singularValues()(1) < 1e-20 && asked) {
    // A straight scene lies in many planes: the plane in which joints or torsion springs turn is chosen, or that of the
    // first director.
    directions.push_back(turning_across(scene, directions.front()).value_or(scene.rods.front().directors.row(0)));
    spread += directions.back() * directions.back().transpose();
    svd.compute(spread, Eigen::ComputeFullU);
  }
  if (svd.singularValues()(1) < 1e-20) {
    reason = "a straight scene lies in no plane of its own";
    return std::nullopt;
  }
  Vector3 normal = svd.matrixU().col(2);
  // The two directions that differ most give the normal to rounding, where the mean above gives it to its root.
  double best = 0.0;
  for (const Vector3& d : directions) {
    const Vector3 candidate = directions.front().cross(d);
    if (candidate.norm() > best) {
      best = candidate.norm();
      normal = candidate.normalized();
    }
  }
  for (const Vector3& d : directions)
    if (std::abs(d.dot(normal)) > kTolerance * 100 * d.norm()) {
      reason = scene.tendons.empty() ? "rods, gravity and forces do not share a plane"
                                     : "rods, gravity, forces and tendons do not share a plane";
      return std::nullopt;
    }
  return normal;
}

/// Directors and tangent of a rod's first edge, as columns.
Matrix3 first_frame(const SceneDescription& scene, const RodDescription& rod) {
  const Vector3 d1 = rod.directors.row(0);
  const Vector3 t = (scene.positions.row(rod.nodes[1]) - scene.positions.row(rod.nodes[0])).normalized();
  Matrix3 axes;
  axes << d1, t.cross(d1), t;
  return axes;
}

/// Why a rod leaves the plane in which its nodes are; empty: it does not.
std::string why_off_plane(const SceneDescription& scene, const RodDescription& rod, const Vector3& normal) {
  if ((rod.natural_twist.array() != 0.0).any()) return "rod '" + rod.name + "' has natural twist";
  for (Eigen::Index e = 0; e < rod.directors.rows(); ++e) {
    const double c = std::abs(Vector3(rod.directors.row(e)).dot(normal));
    if (!isotropic(rod) && c > 1e-9 && c < 1.0 - 1e-9)
      return "the section of rod '" + rod.name + "' lies at an angle to the plane";
  }
  // Directors must keep their angle to the plane, or the rod is drawn with twist.
  for (Eigen::Index e = 1; e < rod.directors.rows(); ++e)
    if (std::abs((rod.directors.row(e) - rod.directors.row(0)).dot(normal)) > 1e-8)
      return "rod '" + rod.name + "' is drawn with twist";
  const Matrix3 axes = first_frame(scene, rod);
  const Vector2 p(axes.col(1).dot(normal), -axes.col(0).dot(normal));
  for (Eigen::Index s = 0; s < rod.natural_curvature.rows(); ++s) {
    const Vector2 k = rod.natural_curvature.row(s);
    if (std::abs(k(0) * p(1) - k(1) * p(0)) > 1e-8 * k.norm())
      return "the natural curvature of rod '" + rod.name + "' leaves the plane";
  }
  return "";
}

/// True if a direction is the plane's normal or lies in the plane, so that mirroring at the plane does not change it.
bool is_mirrored(const Vector3& direction, const Vector3& normal) {
  constexpr double kAngle = 1e-9;
  return std::abs(direction.dot(normal)) <= kAngle * direction.norm() ||
         direction.cross(normal).norm() <= kAngle * direction.norm();
}

/// True if something turns a revolute joint about an axis in the plane.
bool turns_out(const JointLink& link, const Vector3& normal) {
  return (link.moment != 0.0 || link.rest_angle != 0.0) && std::abs(link.axis.dot(normal)) < 0.5;
}

/// True if a link turns bodies against each other.
bool turns_body(const JointDescription& joint, const JointLink& link) {
  return joint.body_of(static_cast<std::size_t>(link.parent)) >= 0 &&
         joint.body_of(static_cast<std::size_t>(link.child)) >= 0;
}

/// Axes of a hand that yields, as columns, before it moves. A rod in a plane keeps the angles of its directors to it.
Matrix3 hand_axes(const SceneDescription& scene, const SupportDescription& support) {
  if (support.hand.posed) return support.hand.rotation;
  return first_frame(scene, scene.rods[static_cast<std::size_t>(support.pass.rod)]);
}

/// True if the springs of a hand push planar motion out of the plane: unless the normal is an axis of both stiffnesses.
bool leans(const SceneDescription& scene, const SupportDescription& support, const Vector3& normal) {
  const HandDescription& hand = support.hand;
  if (support.kind != SupportKind::hand || !hand.yields || hand.slides) return false;
  const Matrix3 axes = hand_axes(scene, support);
  for (int first : {0, 3}) {
    const Vector3 k{hand.stiffness[static_cast<std::size_t>(first)],
                    hand.stiffness[static_cast<std::size_t>(first + 1)],
                    hand.stiffness[static_cast<std::size_t>(first + 2)]};
    const Vector3 pull = axes * k.cwiseProduct(axes.transpose() * normal);
    if (pull.cross(normal).norm() > 1e-9 * k.maxCoeff()) return true;
  }
  return false;
}

/// Reason why a part of the scene leaves the plane; empty if none does.
std::string why_off_plane(const SceneDescription& scene, const Vector3& normal) {
  const auto across = [&](const Vector3& v) { return v.cross(normal).norm() > kTolerance * 100 * v.norm(); };
  for (const JointDescription& joint : scene.joints)
    for (const JointLink& link : joint.links)
      if (link.slides && std::abs(link.axis.dot(normal)) > 1e-9)
        return "a sliding joint leaves the plane";
      else if (!is_mirrored(link.axis, normal))
        return "the axis of a revolute joint lies at an angle to the plane";
      else if (!link.slides && turns_out(link, normal))
        return "a revolute joint is driven out of the plane";
      else if (!link.slides && turns_body(joint, link) && std::abs(link.axis.dot(normal)) < 0.5)
        return "a body turns about an axis in the plane";
  for (const TorsionDescription& torsion : scene.torsions)
    if (across(torsion.axis)) return "the axis of a torsion spring lies at an angle to the plane";
  for (const LoadDescription& load : scene.loads)
    for (const auto& value : load.values.rowwise())
      if (!load.added && is_axial(load.kind) && across(value.transpose()))
        return "a moment turns, or a pressure pushes, out of the plane";
  for (const RodDescription& rod : scene.rods)
    if (std::string reason = why_off_plane(scene, rod, normal); !reason.empty()) return reason;
  for (const BodyDescription& body : scene.bodies) {
    const Vector3 moment = body.inertia * normal;
    if (moment.cross(normal).norm() > 1e-9 * body.inertia.norm())
      return "no principal axis of body '" + body.name + "' is normal to the plane";
  }
  for (const SupportDescription& support : scene.supports) {
    const Vector3 image = support.free * normal;
    if ((image - normal * normal.dot(image)).norm() > 1e-9) return "a support may slide out of the plane";
    if (!support.axis.isZero() && !is_mirrored(support.axis, normal))
      return "the axis of a clamp lies at an angle to the plane";
    if (leans(scene, support, normal)) return "the axes of a hand lie at an angle to the plane";
  }
  const Vector3 corner = scene.positions.row(scene.rods.front().nodes.front());
  for (const ObstacleDescription& o : scene.contact.obstacles)
    if (!fits(o, corner, normal)) return "an obstacle reaches out of the plane";
  return "";
}

}  // namespace

std::optional<Plane> find_plane(const SceneDescription& scene, std::optional<bool> asked, std::string& reason) {
  if (scene.rods.empty()) {
    reason = "bodies without rods move in space";
    return std::nullopt;
  }
  if (std::any_of(scene.rods.begin(), scene.rods.end(), [](const RodDescription& rod) { return rod.is_surface(); })) {
    reason = "bodies with surfaces that touch move in space";
    return std::nullopt;
  }
  // A user who requests a plane must keep such forces in it.
  const bool sure = asked.value_or(false);
  if (scene.has_custom_force && !sure) {
    reason = "a custom force may point anywhere";
    return std::nullopt;
  }
  for (const LoadDescription& load : scene.loads)
    if (load.varies && !load.added && !sure) {
      reason = "a load that varies may leave any plane";
      return std::nullopt;
    }
  std::vector<Vector3> directions;
  collect_directions(scene, directions);
  const std::optional<Vector3> found = normal_of(scene, sure, directions, reason);
  if (!found) return std::nullopt;
  const Vector3& normal = *found;
  if (std::string why = why_off_plane(scene, normal); !why.empty()) {
    reason = std::move(why);
    return std::nullopt;
  }
  Plane plane;
  plane.normal = normal;
  plane.origin = scene.positions.row(scene.rods.front().nodes.front());
  plane.origin = normal * normal.dot(plane.origin);
  plane.first = directions.front() - normal * normal.dot(directions.front());
  plane.first.normalize();
  plane.second = normal.cross(plane.first);
  return plane;
}

}  // namespace withe
