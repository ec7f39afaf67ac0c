#pragma once
/// Rods and obstacles of a scene where they are: ends, unknowns and closest points of two surfaces.

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "contact/surfaces.hpp"
#include "geometry/segment_distance.hpp"

namespace withe {

/// Closest points of two surfaces.
struct Proximity {
  ClosestPoints points;         ///< for a curve only its s
  CurveDistance<double> curve;  ///< for a curve
  Vec3d normal{};               ///< from b to a
  double distance = 0;          ///< distance of the centrelines, or of a centreline and the obstacle [m]
  double outside = 0;           ///< distance of a point's foot from the outline of a face, in its plane [m]
  bool beyond = false;          ///< true of surfaces that do not begin to touch here: others do in their place

  /// A lower bound of the distance from surfaces that may touch [m].
  double apart() const { return std::max(distance, outside); }
};

/// The point of an edge that touches a face, and the vector to it from its foot.
ClosestPoints face_points(const ContactPair& pair, const Vec3d (&x)[4]);

struct Bodies {
  const Model* model = nullptr;
  std::vector<Obstacle> obstacles;

  const Obstacle& obstacle(const ContactPair& pair) const {
    return obstacles[static_cast<std::size_t>(-1 - pair.key.b)];
  }
  /// True if a pair is one with a plane, which has no other side.
  bool flat(const ContactPair& pair) const { return pair.key.b < 0 && obstacle(pair).kind == ObstacleKind::plane; }
  /// Sets the present positions of obstacles; returns the greatest displacement [m].
  double place(std::span<const ObstaclePlace> places);
  /// Ends of edges, or of an obstacle. For a piece of a curve, its nodes and no others.
  void end_points(const ContactPair& pair, const VectorX& q, Vec3d (&x)[4]) const;
  /// Unknowns of a pair at q (points of an obstacle have none).
  void values(const ContactPair& pair, const VectorX& q, double (&x)[kContactUnknowns]) const;
  /// Distance of a piece of a curve from its obstacle, or from the obstacle's place before its `drift`.
  CurveDistance<double> piece_distance(const ContactPair& pair, const VectorX& q, const Vec3d& drift = {}) const;
  /// Distance of two surfaces; for surfaces beyond reach, a lower bound of the distance only. `whole`: also the
  /// closest points of these too.
  Proximity proximity(const ContactPair& pair, const VectorX& q, bool whole = false) const;
};

/// The longest way of a node; NaN where one is. `change`: any expression of a change of q, which is not stored.
template <class Change>
double farthest(const Model& model, const Eigen::MatrixBase<Change>& change) {
  double most = 0.0;
  for (int dof : model.node_dof) {
    double square = 0.0;
    for (int k = dof; k < dof + model.dimension; ++k) square += change(k) * change(k);
    if (std::isnan(square)) return square;
    most = std::max(most, square);
  }
  return std::sqrt(most);
}

}  // namespace withe
