#pragma once
/// A tube with a thin wall about a smooth axis, open at both ends.
///
/// The wall is the set of points within its half thickness of the middle surface: the points at the distance R from the
/// axis. The distance of a point at rho from the axis is |R - rho|, and beyond an end, by z, the distance from the rim,
/// sqrt((rho - R)^2 + z^2). So rims are round, and rods touch the wall from inside and from outside.
///
/// The axis consists of quadratic Bezier curves with continuous directions. With p(t) and its derivatives, the nearest
/// point of x is where f(t) = (p - x) . p' is zero, and the second derivative of rho with e = (x - p) / rho is
///   (1 - e e^T - p' p'^T / f') / rho,   f' = |p'|^2 - (x - p) . p''.

#include <vector>

#include "geometry/shape.hpp"

namespace withe {

class Tube final : public Shape {
 public:
  /// `ends`: where the curves of the axis begin and end, one more than curves; `middles`: their middle control points;
  /// `inner`: radius of the channel; `wall`: thickness of the wall. Throws std::invalid_argument for numbers that
  /// describe no tube.
  Tube(const std::vector<Vec3d>& ends, const std::vector<Vec3d>& middles, double inner, double wall);

  ShapeDistance distance(const Vec3d& x) const override;
  double radius() const override { return 0.5 * wall_; }
  double channel() const override { return inner_; }

 private:
  /// p(t) = start + t (2 along + t bend), t in [0, 1]
  struct Curve {
    Vec3d start, along, bend;
  };
  /// A sphere about the curves from `first` to before `end`, and which two spheres are within it.
  struct Ball {
    Vec3d centre;
    double radius;
    int first, end, left, right;
  };
  struct Nearest {
    int curve = -1;
    double t = 0, square = 0;
  };
  int add_ball(int first, int end);
  Nearest nearest(const Vec3d& x) const;

  std::vector<Curve> curves_;
  std::vector<Ball> balls_;  ///< the first is about all
  double inner_, wall_;
};

}  // namespace withe
