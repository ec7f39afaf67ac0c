#pragma once
/// A ring that a rod passes through: it holds the rod across, and leaves it free along itself.
///
/// The rod is the quadratic B-spline of its nodes, with the edges as tangents at their middles. About node 1, between
/// the middles of the edges from 0 to 1 and from 1 to 2,
///   c(a) = (1 - a)^2 / 2 x0 + (1/2 + a - a^2) x1 + a^2 / 2 x2,   s(a) = s1 - l0 (1 - a)^2 / 2 + l1 a^2 / 2,
/// for 0 <= a <= 1, with s the arc length at rest of node 1 and l the lengths at rest of its edges. c, c', s and s' are
/// continuous from piece to piece. Beside the first and the last node of a rod c is half an edge, straight. The rod
/// passes the ring, at p, where it is nearest,
///   (c - p) . c' = 0,   r = c - p,
/// and a follows from the nodes: D da = -(c' . dc + r . dc'), with D = c' . c' + r . c''. Then
///   E = k r . r / 2 + k u^2 / 2,   u = s0 - fed - slip - s,
/// the second part where something holds the rod along itself: a drive that feeds it, or friction. The first has
/// k w_i r as its gradient by node i, of weight w_i, since a makes it least: a force across the rod.
///
/// Coulomb's friction of the ring is |T| <= mu N, with T = k u and N = k |r|, and slip follows, so that |T| is at that
/// limit (return mapping, as in forces/hand.hpp). A drive slips beyond its own limit.

#include <cmath>

#include "common/dual.hpp"
#include "geometry/vec3.hpp"

namespace withe {

/// What of a rod is about one of its nodes.
struct RingPiece {
  int node[3] = {-1, -1, -1};  ///< -1: none
  double arc = 0;              ///< of the node in the middle [m]
  double length[2] = {};       ///< of the edges before and after it [m]

  bool first() const { return node[0] < 0; }
  bool last() const { return node[2] < 0; }
  double low() const { return first() ? 0.5 : 0.0; }
  double high() const { return last() ? 0.5 : 1.0; }
};

/// w, its first, or its second derivative by a.
template <class Scalar>
struct RingWeights {
  Scalar value[3], slope[3];
  double bend[3];
};

template <class Scalar>
RingWeights<Scalar> ring_weights(const RingPiece& piece, const Scalar& a) {
  if (piece.first()) return {{Scalar(0.0), 1.5 - a, a - 0.5}, {Scalar(0.0), Scalar(-1.0), Scalar(1.0)}, {}};
  if (piece.last()) return {{0.5 - a, 0.5 + a, Scalar(0.0)}, {Scalar(-1.0), Scalar(1.0), Scalar(0.0)}, {}};
  const Scalar b = 1.0 - a;
  return {{0.5 * b * b, 0.5 + a * b, 0.5 * a * a}, {-b, b - a, a}, {1.0, -2.0, 1.0}};
}

/// s and s'
template <class Scalar>
Scalar ring_arc(const RingPiece& piece, const Scalar& a) {
  if (piece.first()) return piece.arc + piece.length[1] * (a - 0.5);
  if (piece.last()) return piece.arc + piece.length[0] * (a - 0.5);
  const Scalar b = 1.0 - a;
  return piece.arc + 0.5 * (piece.length[1] * a * a - piece.length[0] * b * b);
}
template <class Scalar>
Scalar ring_arc_slope(const RingPiece& piece, const Scalar& a) {
  if (piece.first()) return Scalar(piece.length[1]);
  if (piece.last()) return Scalar(piece.length[0]);
  return piece.length[0] + (piece.length[1] - piece.length[0]) * a;
}

/// a of an arc length on a piece [m].
inline double ring_place(const RingPiece& piece, double arc) {
  if (piece.first()) return 0.5 + (arc - piece.arc) / piece.length[1];
  if (piece.last()) return 0.5 + (arc - piece.arc) / piece.length[0];
  const double l = piece.length[0], more = piece.length[1] - l, s = arc - piece.arc + 0.5 * l;
  return 2.0 * s / (l + std::sqrt(l * l + 2.0 * more * s));
}

template <class Scalar>
struct RingCurve {
  Vec3<Scalar> across, along;  ///< r [m], c' [m]
  Vec3<Scalar> bend;           ///< c'' [m]
  Scalar stiff;                ///< D [m^2]
};

template <class Scalar>
RingCurve<Scalar> ring_curve(const RingWeights<Scalar>& w, const Vec3<Scalar> (&x)[3], const Vec3d& p) {
  const Vec3<Scalar> zero{Scalar(0.0), Scalar(0.0), Scalar(0.0)};
  RingCurve<Scalar> c{{Scalar(-p.x), Scalar(-p.y), Scalar(-p.z)}, zero, zero, Scalar(0.0)};
  for (int i = 0; i < 3; ++i) {
    c.across += w.value[i] * x[i];
    c.along += w.slope[i] * x[i];
    c.bend += Scalar(w.bend[i]) * x[i];
  }
  c.stiff = dot(c.along, c.along) + dot(c.across, c.bend);
  return c;
}

/// What holds the rod along itself.
struct RingHold {
  double stiffness = 0;  ///< k [N/m]
  bool holds = false;    ///< along the rod
  double origin = 0;     ///< s0 - fed - slip [m]
  double friction = 0, limit = INFINITY;
};

template <class Scalar>
struct RingForce {
  Scalar tension;         ///< T [N]
  double way = 0;         ///< u [m]
  double share = 1;       ///< of k u that is left
  double energy = 0;      ///< [J]
  Vec3<Scalar> by[3];     ///< gradient by the nodes [N]
};

/// At a place that may change with the nodes; `passes`: not at an end of the rod, whose rest the ring lacks.
template <class Scalar>
RingForce<Scalar> ring_force(const RingPiece& piece, const RingHold& hold, const Vec3<Scalar> (&x)[3], const Vec3d& p,
                             const Scalar& a, bool passes) {
  using std::sqrt;
  const RingWeights<Scalar> w = ring_weights(piece, a);
  const RingCurve<Scalar> c = ring_curve(w, x, p);
  const Scalar square = dot(c.across, c.across);
  RingForce<Scalar> out{};
  out.energy = 0.5 * hold.stiffness * value_of(square);
  for (int i = 0; i < 3; ++i) out.by[i] = (hold.stiffness * w.value[i]) * c.across;
  if (!hold.holds || !passes) return out;
  const Scalar u = hold.origin - ring_arc(piece, a);
  Scalar limit = hold.limit;
  if (hold.friction > 0.0)
    limit = value_of(square) > 0.0 ? (hold.friction * hold.stiffness) * sqrt(square) : Scalar(0.0);
  out.way = value_of(u);
  out.tension = hold.stiffness * u;
  const double size = std::abs(value_of(out.tension)), most = value_of(limit);
  if (size > most) {
    out.share = most / size;
    out.tension = out.way > 0.0 ? limit : -1.0 * limit;
  }
  out.energy += 0.5 * hold.stiffness * out.way * out.way;
  const Scalar per = out.tension * ring_arc_slope(piece, a) / c.stiff;
  for (int i = 0; i < 3; ++i) out.by[i] += per * (w.value[i] * c.along + w.slope[i] * c.across);
  return out;
}

}  // namespace withe
