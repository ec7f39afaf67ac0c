#pragma once
/// Obstacles, and how far points are from them.

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "common/dual.hpp"
#include "geometry/shape.hpp"
#include "model/model.hpp"

namespace withe {

inline constexpr Vec3d kUnitVectors[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

/// An obstacle in the axes of the unknowns (in a plane: its two, and zero).
struct Obstacle {
  ObstacleKind kind = ObstacleKind::plane;
  Vec3d point{}, other{};  ///< `other` of a plane is its normal
  double radius = 0;
  const Shape* shape = nullptr;  ///< in axes from `point` on
};

/// A point beside an obstacle.
template <class Scalar>
struct PointDistance {
  Scalar distance;      ///< from a plane, the middle of a sphere or the axis of a capsule; or that of `Shape` [m]
  Vec3<Scalar> normal;  ///< its gradient
  bool beside = false;  ///< a capsule's axis, between its ends
  Vec3d place{};        ///< the point, in the axes of a shape [m]
};

/// Height above a plane that is taken back by `drift`.
template <class Scalar>
Scalar height_above(const Obstacle& plane, const Vec3<Scalar>& x, const Vec3d& drift = {}) {
  const Vec3d &n = plane.other, from = plane.point - drift;
  return n.x * (x.x - Scalar(from.x)) + n.y * (x.y - Scalar(from.y)) + n.z * (x.z - Scalar(from.z));
}

/// `drift` is subtracted from the position of the obstacle.
template <class Scalar>
PointDistance<Scalar> distance_to(const Obstacle& o, const Vec3<Scalar>& x, const Vec3d& drift = {}) {
  using std::sqrt;
  const auto lift = [](const Vec3d& v) { return Vec3<Scalar>{Scalar(v.x), Scalar(v.y), Scalar(v.z)}; };
  PointDistance<Scalar> out;
  if (o.kind == ObstacleKind::plane) {
    out.normal = lift(o.other);
    out.distance = height_above(o, x, drift);
    return out;
  }
  if (o.kind == ObstacleKind::shape) {
    out.place = Vec3d{value_of(x.x), value_of(x.y), value_of(x.z)} - (o.point - drift);
    const ShapeDistance d = o.shape->distance(out.place);
    if constexpr (std::is_same_v<Scalar, double>) {
      out.distance = d.distance;
      out.normal = d.normal;
    } else {
      const Vec3<Scalar> change = x - lift({value_of(x.x), value_of(x.y), value_of(x.z)});
      const auto along = [&](const Vec3d& v) { return v.x * change.x + v.y * change.y + v.z * change.z; };
      out.distance = d.distance + along(d.normal);
      out.normal =
          lift(d.normal) + Vec3<Scalar>{along(d.change.row[0]), along(d.change.row[1]), along(d.change.row[2])};
    }
    return out;
  }
  Vec3<Scalar> way = x - lift(o.point - drift);
  const Vec3d axis = o.other - o.point;
  const double square = dot(axis, axis);
  if (square > 1e-18 * o.radius * o.radius) {
    const Scalar t = (1.0 / square) * dot(way, lift(axis));
    out.beside = value_of(t) > 0.0 && value_of(t) < 1.0;
    way = way - (out.beside ? t : Scalar(std::clamp(value_of(t), 0.0, 1.0))) * lift(axis);
  }
  out.distance = sqrt(dot(way, way));
  out.normal = (1.0 / (out.distance + 1e-300)) * way;
  return out;
}

/// Unit vector of the normal. The gradient of a field's spline has a length of about 1 only.
template <class Scalar>
Vec3<Scalar> direction_of(const Obstacle& o, const PointDistance<Scalar>& p) {
  using std::sqrt;
  if (o.kind != ObstacleKind::shape) return p.normal;
  return (1.0 / sqrt(dot(p.normal, p.normal))) * p.normal;
}

/// Turning of the normal as the point moves. A shape is evaluated once for all directions.
class NormalChange {
 public:
  NormalChange(const Obstacle& obstacle, const PointDistance<double>& point) : obstacle_(obstacle), point_(point) {
    if (of_shape()) by_ = obstacle.shape->distance(point.place).change;
  }

  /// The second derivative of the distance, times a change of the point.
  Vec3d of_normal(const Vec3d& change) const {
    if (obstacle_.kind == ObstacleKind::plane) return {};
    if (of_shape()) return {dot(by_.row[0], change), dot(by_.row[1], change), dot(by_.row[2], change)};
    Vec3d across = change - dot(point_.normal, change) * point_.normal;
    if (point_.beside) {
      const Vec3d axis = obstacle_.other - obstacle_.point;
      across -= (dot(axis, across) / dot(axis, axis)) * axis;
    }
    return (1.0 / std::max(point_.distance, 1e-300)) * across;
  }

  /// Change of `direction_of`.
  Vec3d of_direction(const Vec3d& change) const {
    const Vec3d turned = of_normal(change);
    if (!of_shape()) return turned;
    const double inverse = 1.0 / std::sqrt(dot(point_.normal, point_.normal));
    const Vec3d direction = inverse * point_.normal;
    return inverse * (turned - dot(direction, turned) * direction);
  }

 private:
  bool of_shape() const { return obstacle_.kind == ObstacleKind::shape; }

  const Obstacle& obstacle_;
  const PointDistance<double>& point_;
  Mat3<double> by_{};
};

}  // namespace withe
