#pragma once
/// A rod as the smooth curve of geometry/rod_spline.hpp.

#include <algorithm>
#include <vector>

#include "common/types.hpp"
#include "geometry/rod_spline.hpp"

namespace withe {

struct RodCurve {
  std::vector<int> nodes;      ///< in the order of the rod
  std::vector<double> arc;     ///< arc length of each node [m]
  std::vector<double> length;  ///< length of the edge after each node; the last node of an open rod has none [m]
  bool closed = false;
  double whole = 0;  ///< [m]

  int pieces() const { return static_cast<int>(nodes.size()); }
  /// Pieces of a closed rod continue periodically.
  SplinePiece piece(int i) const;
  /// Place of an arc length [m].
  SplinePlace place(double at) const;
  double arc_at(const SplinePlace& place) const { return spline_arc(piece(place.piece), place.along); }
  /// From one place to another: the difference in arc length [m], exact however small it is.
  double arc_between(const SplinePlace& from, const SplinePlace& to) const;
};

/// Nodes of a piece from a point in space, none beyond the ends of the rod. `position` returns that of a node.
template <class Positions>
void place_nodes(const SplinePiece& piece, const Positions& position, const Vector3& from, Vec3<double> (&x)[3]) {
  for (int i = 0; i < 3; ++i) {
    if (piece.node[i] < 0) {
      x[i] = {0.0, 0.0, 0.0};
      continue;
    }
    const Vector3 d = position(piece.node[i]) - from;
    x[i] = {d.x(), d.y(), d.z()};
  }
}

template <class Positions>
SplinePoint<double> point_at(const RodCurve& curve, const SplinePlace& place, const Positions& position,
                             const Vector3& from) {
  const SplinePiece piece = curve.piece(place.piece);
  Vec3<double> x[3];
  place_nodes(piece, position, from, x);
  return spline_point(spline_weights(piece, place.along), x);
}

/// c there less c at another place [m], exact however near they are: c is of second order on each piece.
template <class Positions>
Vec3<double> way_between(const RodCurve& curve, const SplinePlace& from, const SplinePlace& to,
                         const Positions& position) {
  const bool ahead = from.piece != to.piece ? from.piece < to.piece : from.along < to.along;
  Vec3<double> way{0.0, 0.0, 0.0};
  SplinePlace now = from;
  for (;;) {
    const SplinePiece piece = curve.piece(now.piece);
    const double end = now.piece == to.piece ? to.along : ahead ? piece.high() : piece.low();
    const SplinePlace middle{now.piece, 0.5 * (now.along + end), false};
    way += (end - now.along) * point_at(curve, middle, position, Vector3::Zero()).along;
    if (now.piece == to.piece) return way;
    now.piece += ahead ? 1 : -1;
    now.along = ahead ? curve.piece(now.piece).low() : curve.piece(now.piece).high();
  }
}

/// Zero of r . c' on one piece, between two places on it with opposite signs.
inline double nearest_on_piece(const SplinePiece& piece, const Vec3<double> (&x)[3], double low, double high) {
  const auto off = [&](double a) { return spline_point(spline_weights(piece, a), x); };
  double a = 0.5 * (low + high);
  constexpr int kMost = 100;
  constexpr double kClose = 4e-16;
  for (int i = 0; i < kMost; ++i) {
    const SplinePoint<double> c = off(a);
    if (c.off == 0.0) return a;
    (c.off < 0.0 ? low : high) = a;
    double next = a - c.off / c.off_slope;
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    if (std::abs(next - a) <= kClose) return next;
    a = next;
  }
  return a;
}

/// Place of a curve that is nearest to a point, as near to `start` as it gets without going away from it; at a place
/// that is no number where a closed rod never is. `position`: of a node in space.
template <class Positions>
SplinePlace nearest_place(const RodCurve& curve, SplinePlace start, const Positions& position, const Vector3& from) {
  start.beyond = false;
  double along = start.along;
  int ahead = 0;
  for (int passed = 0; passed <= curve.pieces(); ++passed) {
    const SplinePiece piece = curve.piece(start.piece);
    Vec3<double> x[3];
    place_nodes(piece, position, from, x);
    const auto off = [&](double a) { return spline_point(spline_weights(piece, a), x).off; };
    if (passed == 0) {
      along = std::clamp(along, piece.low(), piece.high());
      const double now = off(along);
      if (now == 0.0) return {start.piece, along, false};
      if (!std::isfinite(now)) break;
      ahead = now < 0.0 ? 1 : -1;
    }
    const double end = ahead > 0 ? piece.high() : piece.low();
    if (ahead * off(end) >= 0.0) {
      start.along = ahead > 0 ? nearest_on_piece(piece, x, along, end) : nearest_on_piece(piece, x, end, along);
      return start;
    }
    if (ahead > 0 ? piece.last() : piece.first()) {
      const SplinePoint<double> there = spline_point(spline_weights(piece, end), x);
      return {start.piece, end - there.off / there.off_slope, true};
    }
    start.piece += ahead;
    along = ahead > 0 ? curve.piece(start.piece).low() : curve.piece(start.piece).high();
  }
  start.along = NAN;
  return start;
}

}  // namespace withe
