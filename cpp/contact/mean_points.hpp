#pragma once
/// Points and direction by which two rods press on each other in a step.
///
/// Let (s0, t0) be the closest points at the start, at a distance D0, and (s1, t1) those at the end, at a distance D1.
/// The points (s, t) lie between them at a share b. Their vectors d0 and d1 from b to a, at the start and the end, obey
///   |d1|^2 - |d0|^2 = D1^2 - D0^2.
/// This equation is quadratic in b and has a solution from 0 to 1. No points are closer than the closest points, so the
/// left side is greater than the right side at b = 0, and less at b = 1. Let w be the weights of these points. A force
/// f w_i (d0 + d1) / (D0 + D1) on the nodes has three properties:
///   - It acts along the line between the points in the middle of the step, so it has no moment there.
///   - It does the work f (D1 - D0). As E is convex, this is never more than the contact energy supplies, however far
///     surfaces slide.
///   - It is perpendicular to the motion of surfaces that slide past each other (b = 1/2), so it does not brake them.

#include <cmath>

#include "contact/surfaces.hpp"
#include "geometry/segment_distance.hpp"

namespace withe {

template <class Scalar>
struct MeanPoints {
  Scalar weight[4];   ///< w
  Vec3<Scalar> ways;  ///< d0 + d1 [m]
  Scalar start, end;  ///< D0, D1 [m]
};

/// Closest points in a configuration, and the contribution of the weights of `closest_points` to D^2.
template <class Scalar>
struct PointsOfRods {
  Scalar s, t, spread, square;  ///< the last: D^2
  Vec3<Scalar> between, u, v;

  PointsOfRods(const ContactPair& pair, const ClosestPoints& known, const Vec3<Scalar> (&x)[4])
      : s(known.s), t(known.t), u(x[1] - x[0]), v(x[3] - x[2]) {
    const Vec3<Scalar> r = x[0] - x[2];
    solve_parameters(r, u, v, pair.weight_a, pair.weight_b, known.s_free, known.t_free, s, t);
    between = r + s * u - t * v;
    spread = pair.weight_a * (s - 0.5) * (s - 0.5) + pair.weight_b * (t - 0.5) * (t - 0.5);
    square = dot(between, between) + spread;
  }
  /// Way between the points of other parameters.
  Vec3<Scalar> moved(const Scalar& by_s, const Scalar& by_t) const { return between + by_s * u - by_t * v; }
};

/// `first`, `last`: the closest points at the start and the end, of which the class is kept; x0, x1: end points there.
template <class Scalar>
MeanPoints<Scalar> mean_points(const ContactPair& pair, const ClosestPoints& first, const ClosestPoints& last,
                               const Vec3<Scalar> (&x0)[4], const Vec3<Scalar> (&x1)[4]) {
  using std::sqrt;
  const PointsOfRods<Scalar> start(pair, first, x0), end(pair, last, x1);
  const Scalar along_a = end.s - start.s, along_b = end.t - start.t;
  const Vec3<Scalar> turned0 = along_a * start.u - along_b * start.v, turned1 = along_a * end.u - along_b * end.v;
  const Vec3<Scalar> back = end.moved(-along_a, -along_b), on = start.between + turned0;
  // h(b) = c0 + c1 b + c2 b^2 falls from above 0 to below 0. Without sliding any share is a solution, and the half is
  // used: h is rounding at both ends, and a small term is added that exceeds it.
  constexpr double kMinRoot = 1e-10;  // of D^2, far above its rounding error of 1e-15
  const Scalar little = kMinRoot * (start.square + end.square);
  const Scalar c0 = dot(back, back) + start.spread - end.square + little,
               at_end = start.square - dot(on, on) - end.spread - little,
               c2 = dot(turned1, turned1) - dot(turned0, turned0), c1 = at_end - c0 - c2;
  const Scalar share = 2.0 * c0 / (sqrt(c1 * c1 - 4.0 * (c2 * c0)) - c1);
  MeanPoints<Scalar> out;
  end_weights(Scalar(start.s + share * along_a), Scalar(start.t + share * along_b), out.weight);
  out.ways = start.between + back + share * (turned0 + turned1);
  out.start = sqrt(start.square);
  out.end = sqrt(end.square);
  return out;
}

}  // namespace withe
