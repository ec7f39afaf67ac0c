#pragma once
/// A ring that a rod passes through: it holds the rod across, and lets it slide.
///
/// The rod is the smooth curve c of geometry/rod_spline.hpp. Its nearest point to the ring at p is its place in the
/// ring,
///   r = c - p,   r . c' = 0,   so that with the nodes   D da = -(c' . dc + r . dc').
/// The ring has the energy
///   E = k r . r / 2 + k u^2 / 2,   u = s0 - fed - slip - s.
/// The second part exists only if friction, or a drive that feeds the rod, holds the rod along itself. `fed` is the
/// rest length that has moved towards the end of the rod since the rod passed the ring at s0. On node i, with weights
/// w_i in c and w_i' in c', the force is minus
///   dE/dx_i = k w_i r + T (s' / D) (w_i c' + w_i' r),   T = k u,
/// because the first part of E is minimal with respect to a. Without friction the force is perpendicular to the rod. E
/// does not depend on the axes of the ring, so the forces have no moment about p.
///
/// A ring on a rigid body is a point p that the body carries. E depends on x_i - p alone, so that the force on p is the
/// opposite of the sum of those on the nodes, and its derivatives follow from theirs.
///
/// T pulls the rod back by P = T s' |c'| / D (by T itself if the rod is not stretched). Friction holds up to
/// |P| = mu k |r| [Coulomb], and a drive up to its force limit. Beyond the limit the slip grows so that P stays at the
/// limit (return mapping, as in forces/hand.hpp).

#include <cmath>

#include "common/dual.hpp"
#include "geometry/rod_spline.hpp"

namespace withe {

struct Ring {
  double stiffness = 0;           ///< k [N/m]
  bool holds = false;             ///< along the rod
  double friction = 0;            ///< mu [-]
  double force_limit = INFINITY;  ///< greatest force of a drive [N]
  double rounding = 0;            ///< bound of the rounding error of u [m]

  bool slips() const { return friction > 0.0 || std::isfinite(force_limit); }
};

template <class Scalar>
struct RingForce {
  Scalar tension;      ///< T [N]
  double elastic = 0;  ///< k u [N]
  Vec3<Scalar> by[3];  ///< generalised forces, minus those on the nodes [N]
};

/// T within its limit, at a point where the curve is nearest.
template <class Scalar>
Scalar ring_tension(const Ring& ring, const Scalar& u, const Scalar& arc_slope, const SplinePoint<Scalar>& c) {
  using std::sqrt;
  const Scalar elastic = ring.stiffness * u;
  if (!ring.slips()) return elastic;
  Scalar most(ring.force_limit);
  if (ring.friction > 0.0) {
    const Scalar square = dot(c.across, c.across);
    most = value_of(square) > 0.0 ? (ring.friction * ring.stiffness) * sqrt(square) : Scalar(0.0);
  }
  const Scalar limit = most * c.off_slope / (arc_slope * sqrt(dot(c.along, c.along)));
  // Without pressure the limit is zero, and the sign of the rounding error of u would decide whether the rod slips.
  if (std::abs(value_of(elastic)) <= value_of(limit) + ring.stiffness * ring.rounding) return elastic;
  return value_of(elastic) > 0.0 ? limit : -1.0 * limit;
}

/// At a place, whose a changes with the nodes; `origin`: s0 - fed - slip.
template <class Scalar>
RingForce<Scalar> ring_force(const Ring& ring, const SplinePiece& piece, const Scalar& a, double origin,
                             const Vec3<Scalar> (&x)[3]) {
  const SplineWeights<Scalar> w = spline_weights(piece, a);
  const SplinePoint<Scalar> c = spline_point(w, x);
  RingForce<Scalar> out{};
  for (int i = 0; i < 3; ++i) out.by[i] = (ring.stiffness * w.value[i]) * c.across;
  if (!ring.holds) return out;
  const Scalar slope = spline_arc_slope(piece, a), u = origin - spline_arc(piece, a);
  out.elastic = ring.stiffness * value_of(u);
  out.tension = ring_tension(ring, u, slope, c);
  const Scalar per = out.tension * slope / c.off_slope;
  for (int i = 0; i < 3; ++i) out.by[i] += per * (w.value[i] * c.along + w.slope[i] * c.across);
  return out;
}

/// a of the nearest point as the nodes move: its value is given.
template <class Scalar>
Scalar following_place(const SplinePiece& piece, double a, const Vec3<Scalar> (&x)[3]) {
  const SplinePoint<Scalar> c = spline_point(spline_weights(piece, Scalar(a)), x);
  return a - (c.off - value_of(c.off)) / value_of(c.off_slope);
}

}  // namespace withe
