#pragma once
/// Contact of an obstacle with the smooth curve of a rod, in pieces, one about each node.
///
/// About an inner node 1 between nodes 0 and 2, and between the middles of both its edges, the curve is
///   c(s) = m + s u + (s^2 / 2) k,   s in [-1/2, 1/2],
///   m = x1,   u = (x2 - x0) / 2,   k = x0 - 2 x1 + x2.
/// It is the quadratic B-spline of the nodes (m = x1 + k / 8), moved by k / 8 to pass through the nodes. The B-spline
/// has the edges as tangents at their middles, so directions are continuous from piece to piece. On an evenly bent rod
/// the curve is the arc through the nodes, up to the fourth power of an edge's length. Elsewhere pieces meet up to an
/// eighth of the third difference of the nodes. A rod that lies flat touches at its nodes, each with the load that is
/// lumped there. Moments of |x| about a node, as of a spinning stick, are then those of the trapezoidal rule. A curve
/// nearer to the edges, m = x1 + k / 24, would have the arc length of the edges, but would spread the load of a node to
/// both neighbours. Beside the last node of a rod the piece is half an edge, straight, with s = 0 at the node. A plane
/// touches only its ends, and so only the node, because the other end belongs to the previous piece.
///
/// The distance delta of an obstacle from c is computed at both ends of a piece and in its middle. Elsewhere it is the
/// parabola through these values, g0 + g1 s + g2 s^2 / 2. The distance of the piece is
///   D = min over s of g0 + g1 s + (s^2 / 2) phi(g2),   phi(g) = (g + sqrt(g^2 + 4 a^2)) / 2.
/// The function phi, with a small length a, prevents a jump of s between both ends of a piece that lies along the
/// obstacle. D and its gradient are continuous. All distances are in m.
///
/// Choice of a: consider a piece whose pressure is proportional to its depth, p - g1 s at a tilt g1. Its resultant acts
/// at s = -g1 / (12 p), and for a = 12 p this is the place where D is evaluated. At a larger tilt, the ends of the
/// piece are farther by a / 8 = 3 p / 2 than drawn. On half an edge, whose s is twice as long, a is a fourth of that.

#include "contact/obstacle.hpp"

namespace withe {

/// The linear maps of a piece: c(s) = sum_i (middle_i + slope_i s + bend_i s^2 / 2) x_i, s in [low, low + 1].
struct CurveWeights {
  int nodes, edges;
  double middle[3], slope[3], bend[3];
  double share[2], share_slope[2];  ///< shares of each edge's rotation at s
  double low;
  double value_by[3], slope_by[3];  ///< g0 and g1 of the three distances; g2 is 4 (1, -2, 1) of them

  double high() const { return low + 1.0; }
  double sample(int j) const { return low + 0.5 * j; }
  /// Share of its edge at which s is.
  double along(double s) const { return edges > 1 ? (s > 0.0 ? s : 1.0 + s) : middle[1] + s * slope[1]; }
  double at(int node, double s) const { return middle[node] + s * (slope[node] + 0.5 * s * bend[node]); }
};
inline constexpr double kBendBy[3] = {4.0, -8.0, 4.0};
inline constexpr CurveWeights kCurveInside{.nodes = 3,
                                           .edges = 2,
                                           .middle = {0.0, 1.0, 0.0},
                                           .slope = {-0.5, 0.0, 0.5},
                                           .bend = {1.0, -2.0, 1.0},
                                           .share = {0.5, 0.5},
                                           .share_slope = {-1.0, 1.0},
                                           .low = -0.5,
                                           .value_by = {0.0, 1.0, 0.0},
                                           .slope_by = {-1.0, 0.0, 1.0}};
inline constexpr CurveWeights kCurveStart{.nodes = 2,
                                          .edges = 1,
                                          .middle = {1.0, 0.0, 0.0},
                                          .slope = {-0.5, 0.5, 0.0},
                                          .bend = {},
                                          .share = {1.0, 0.0},
                                          .share_slope = {},
                                          .low = 0.0,
                                          .value_by = {1.0, 0.0, 0.0},
                                          .slope_by = {-3.0, 4.0, -1.0}};
inline constexpr CurveWeights kCurveEnd{.nodes = 2,
                                        .edges = 1,
                                        .middle = {0.0, 1.0, 0.0},
                                        .slope = {-0.5, 0.5, 0.0},
                                        .bend = {},
                                        .share = {1.0, 0.0},
                                        .share_slope = {},
                                        .low = -1.0,
                                        .value_by = {0.0, 0.0, 1.0},
                                        .slope_by = {1.0, -4.0, 3.0}};
/// A point of an edge by itself, at a share of its length.
constexpr CurveWeights point_of_edge(double share) {
  return {.nodes = 2,
          .edges = 1,
          .middle = {1.0 - share, share, 0.0},
          .slope = {},
          .bend = {},
          .share = {1.0, 0.0},
          .share_slope = {},
          .low = -0.5,
          .value_by = {0.0, 1.0, 0.0},
          .slope_by = {}};
}
/// The first and the last node, and the middle of a ball, whose edge is too short to show.
inline constexpr CurveWeights kCurveFirst = point_of_edge(0.0), kCurveLast = point_of_edge(1.0),
                              kCurveMiddle = point_of_edge(0.5);

/// One piece; its second node and edge are the next ones along the rod.
struct CurvePiece {
  const CurveWeights* weights = nullptr;  ///< null: a straight edge in place of a curve
  int node[3] = {-1, -1, -1}, edge[2] = {-1, -1};
  double least_bend = 0;  ///< a
};

template <class Scalar>
struct CurveDistance {
  PointDistance<Scalar> sample[3];
  Scalar slope, bend, stiff, s, distance;  ///< g1, g2, phi, where, and how near
  bool free = false;                       ///< s is not at an end

  /// phi' and phi''
  double bend_share() const { return value_of(stiff) / root(); }
  double bend_change(double a) const { return 2.0 * a * a / (root() * root() * root()); }

 private:
  double root() const { return 2.0 * value_of(stiff) - value_of(bend); }
};

template <class Scalar>
Vec3<Scalar> curve_point(const CurveWeights& w, const Vec3<Scalar>* x, const Scalar& s) {
  Vec3<Scalar> c{Scalar(0.0), Scalar(0.0), Scalar(0.0)};
  for (int i = 0; i < w.nodes; ++i) {
    const Scalar weight = w.middle[i] + s * (w.slope[i] + 0.5 * w.bend[i] * s);
    c += weight * x[i];
  }
  return c;
}

/// c'(s)
template <class Scalar>
Vec3<Scalar> curve_direction(const CurveWeights& w, const Vec3<Scalar>* x, const Scalar& s) {
  Vec3<Scalar> u{Scalar(0.0), Scalar(0.0), Scalar(0.0)};
  for (int i = 0; i < w.nodes; ++i) u += (w.slope[i] + w.bend[i] * s) * x[i];
  return u;
}

/// Distance of a piece whose three distances, g1 and g2 are known, and g0.
template <class Scalar>
void set_distance(const CurvePiece& piece, const Scalar& value, CurveDistance<Scalar>& d) {
  using std::sqrt;
  const CurveWeights& w = *piece.weights;
  d.stiff = 0.5 * (d.bend + sqrt(d.bend * d.bend + 4.0 * piece.least_bend * piece.least_bend));
  d.s = -d.slope / d.stiff;
  const double s = value_of(d.s);
  d.free = s > w.low && s < w.high();
  if (!d.free) d.s = Scalar(s > w.low ? w.high() : w.low);
  d.distance = value + d.s * (d.slope + 0.5 * d.stiff * d.s);
}

/// Distance of a piece from a plane; `height` has the heights of its nodes above the plane, or is null. Distances are
/// linear in the heights.
template <class Scalar>
CurveDistance<Scalar> plane_distance(const CurvePiece& piece, const Obstacle& o, const Scalar (&height)[3]) {
  const CurveWeights& w = *piece.weights;
  CurveDistance<Scalar> d;
  Scalar value = 0.0, slope = 0.0, bend = 0.0;
  for (int i = 0; i < 3; ++i) {
    value += w.middle[i] * height[i];
    slope += w.slope[i] * height[i];
    bend += w.bend[i] * height[i];
  }
  for (int j = 0; j < 3; ++j) {
    const double s = w.sample(j);
    d.sample[j].distance = value + s * (slope + (0.5 * s) * bend);
    d.sample[j].normal = {Scalar(o.other.x), Scalar(o.other.y), Scalar(o.other.z)};
  }
  d.slope = slope;
  d.bend = bend;
  set_distance(piece, value, d);
  return d;
}

/// Distance of a piece with nodes x from an obstacle, or from the obstacle's place before its `drift`.
template <class Scalar>
CurveDistance<Scalar> curve_distance(const CurvePiece& piece, const Obstacle& o, const Vec3<Scalar>* x,
                                     const Vec3d& drift = {}) {
  const CurveWeights& w = *piece.weights;
  if (o.kind == ObstacleKind::plane) {
    Scalar height[3] = {};
    for (int i = 0; i < w.nodes; ++i) height[i] = height_above(o, x[i], drift);
    return plane_distance(piece, o, height);
  }
  CurveDistance<Scalar> d;
  Scalar value = 0.0;
  d.slope = d.bend = Scalar(0.0);
  for (int j = 0; j < 3; ++j) {
    d.sample[j] = distance_to(o, curve_point(w, x, Scalar(w.sample(j))), drift);
    value += w.value_by[j] * d.sample[j].distance;
    d.slope += w.slope_by[j] * d.sample[j].distance;
    d.bend += kBendBy[j] * d.sample[j].distance;
  }
  set_distance(piece, value, d);
  return d;
}

/// Derivatives by the nodes: of D, of g1 and g2, and of s.
struct CurveSlopes {
  double distance[9], slope[9], bend[9], s[9];
};
CurveSlopes curve_slopes(const CurvePiece& piece, const CurveDistance<double>& d);

/// Adds `factor` times the second derivative of D to `hessian`, a square of rows `stride` long.
void add_curve_hessian(const CurvePiece& piece, const Obstacle& o, const CurveDistance<double>& d,
                       const CurveSlopes& slopes, double factor, int stride, double* hessian);

}  // namespace withe
