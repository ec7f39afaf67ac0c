#pragma once
/// A smooth curve through a chain of nodes: their quadratic B-spline, with the edges as tangents at their middles
/// [de Boor 1978, A Practical Guide to Splines, chapter IX].
///
/// Piece i lies about node i, between the middles of the edges before and after it, with x0, x1, x2 = nodes i - 1, i,
/// i + 1:
///   c(a) = (1 - a)^2 / 2 x0 + (1/2 + a - a^2) x1 + a^2 / 2 x2,   s(a) = s1 - l0 (1 - a)^2 / 2 + l1 a^2 / 2,
/// for 0 <= a <= 1, where s1 is the arc length at rest of the node, and l0, l1 are the rest lengths of the edges before
/// and after it. The functions c, c', s and s' are continuous from piece to piece. The first and last piece of an open
/// rod are straight and half an edge long (a from 1/2 or up to 1/2), and the curve continues straight beyond them.

#include <cmath>

#include "geometry/vec3.hpp"

namespace withe {

/// A piece of such a curve, at rest.
struct SplinePiece {
  int node[3] = {-1, -1, -1};  ///< -1: beyond the end of the rod
  double arc = 0;              ///< arc length at the middle node [m]
  double length[2] = {};       ///< lengths of the edges before and after it [m]

  bool first() const { return node[0] < 0; }
  bool last() const { return node[2] < 0; }
  double low() const { return first() ? 0.5 : 0.0; }
  double high() const { return last() ? 0.5 : 1.0; }
};

/// Place on a curve: the piece, and a on it.
struct SplinePlace {
  int piece = 0;
  double along = 0.5;
  bool beyond = false;  ///< an end of the rod

  bool operator==(const SplinePlace&) const = default;
};

/// Weights of the nodes in c, in c' and in c''.
template <class Scalar>
struct SplineWeights {
  Scalar value[3], slope[3];
  double bend[3];
};

template <class Scalar>
SplineWeights<Scalar> spline_weights(const SplinePiece& piece, const Scalar& a) {
  if (piece.first()) return {{Scalar(0.0), 1.5 - a, a - 0.5}, {Scalar(0.0), Scalar(-1.0), Scalar(1.0)}, {}};
  if (piece.last()) return {{0.5 - a, 0.5 + a, Scalar(0.0)}, {Scalar(-1.0), Scalar(1.0), Scalar(0.0)}, {}};
  const Scalar b = 1.0 - a;
  return {{0.5 * b * b, 0.5 + a * b, 0.5 * a * a}, {-b, b - a, a}, {1.0, -2.0, 1.0}};
}

/// s and s' [m].
template <class Scalar>
Scalar spline_arc(const SplinePiece& piece, const Scalar& a) {
  if (piece.first()) return piece.arc + piece.length[1] * (a - 0.5);
  if (piece.last()) return piece.arc + piece.length[0] * (a - 0.5);
  const Scalar b = 1.0 - a;
  return piece.arc + 0.5 * (piece.length[1] * (a * a) - piece.length[0] * (b * b));
}
template <class Scalar>
Scalar spline_arc_slope(const SplinePiece& piece, const Scalar& a) {
  if (piece.first()) return Scalar(piece.length[1]);
  if (piece.last()) return Scalar(piece.length[0]);
  return piece.length[0] + (piece.length[1] - piece.length[0]) * a;
}

/// a of an arc length on a piece [m].
inline double spline_along(const SplinePiece& piece, double arc) {
  if (piece.first()) return 0.5 + (arc - piece.arc) / piece.length[1];
  if (piece.last()) return 0.5 + (arc - piece.arc) / piece.length[0];
  const double l = piece.length[0], s = arc - piece.arc + 0.5 * l;
  return 2.0 * s / (l + std::sqrt(l * l + 2.0 * (piece.length[1] - l) * s));
}

/// A point of the curve from nodes that are given from a point p in space.
template <class Scalar>
struct SplinePoint {
  Vec3<Scalar> across;  ///< r = c - p [m]
  Vec3<Scalar> along;   ///< c' [m]
  Scalar off;           ///< r . c' [m^2], 0 where the curve is nearest to p
  Scalar off_slope;     ///< D = c' . c' + r . c'' [m^2], its derivative by a
};

template <class Scalar>
SplinePoint<Scalar> spline_point(const SplineWeights<Scalar>& w, const Vec3<Scalar> (&x)[3]) {
  const Scalar none(0.0);
  SplinePoint<Scalar> c{{none, none, none}, {none, none, none}, none, none};
  Vec3<Scalar> bend{none, none, none};
  for (int i = 0; i < 3; ++i) {
    c.across += w.value[i] * x[i];
    c.along += w.slope[i] * x[i];
    bend += Scalar(w.bend[i]) * x[i];
  }
  c.off = dot(c.across, c.along);
  c.off_slope = dot(c.along, c.along) + dot(c.across, bend);
  return c;
}

}  // namespace withe
