#pragma once
/// The pixels of an edge of the skeleton as a smooth line.

#include <algorithm>

#include "vision/skeleton_graph.hpp"

namespace withe {

/// Positions and directions along an edge, by index of the pixel. Indices beyond its ends refer to the ends. The edge
/// must outlive the line.
class SkeletonLine {
 public:
  explicit SkeletonLine(const SkeletonEdge& edge) : points_(edge.points), closed_(edge.nodes[0] < 0) {}

  int count() const { return static_cast<int>(points_.size()); }
  bool closed() const { return closed_; }
  double half_width(int i) const { return point(i).half_width; }
  /// Mean of five pixels.
  Vector2 position(int i) const {
    Vector2 sum = Vector2::Zero();
    for (int k = -2; k <= 2; ++k) sum += point(i + k).position();
    return sum / 5;
  }
  /// Unit vector over ten pixels.
  Vector2 tangent(int i) const {
    const Vector2 way = point(i + 5).position() - point(i - 5).position();
    return way.norm() > 0 ? Vector2(way.normalized()) : Vector2(1, 0);
  }
  /// To the left of the tangent: where a positive cross product with it points to.
  Vector2 normal(int i) const {
    const Vector2 along = tangent(i);
    return {-along.y(), along.x()};
  }

 private:
  const SkeletonPoint& point(int i) const {
    const int n = count();
    const int at = closed_ ? (i % n + n) % n : std::clamp(i, 0, n - 1);
    return points_[static_cast<std::size_t>(at)];
  }
  const std::vector<SkeletonPoint>& points_;
  bool closed_;
};

}  // namespace withe
