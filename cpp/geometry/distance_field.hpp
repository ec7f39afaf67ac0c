#pragma once
/// A solid given by its signed distance on a grid.
///
/// Between the points of the grid the distance is a cubic B-spline, whose second derivatives are continuous. Beyond
/// the grid it grows in proportion to the way from there.

#include <array>
#include <vector>

#include "geometry/shape.hpp"

namespace withe {

class DistanceField final : public Shape {
 public:
  /// `coefficients`: those of the spline, the last index fastest, with one more on each side than the grid has points;
  /// `points`: numbers of points; `origin`: first point; `spacing`: between points. Throws std::invalid_argument for
  /// numbers that describe no grid.
  DistanceField(std::vector<double> coefficients, const std::array<int, 3>& points, const Vec3d& origin,
                const Vec3d& spacing);

  ShapeDistance distance(const Vec3d& x) const override;
  double radius() const override { return 0.0; }
  double channel() const override;

 private:
  std::vector<double> coefficients_;
  std::array<int, 3> points_;
  Vec3d origin_, spacing_;
};

}  // namespace withe
