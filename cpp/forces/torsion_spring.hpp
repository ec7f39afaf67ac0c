#pragma once
/// Torsion spring between two edges: E = (k / 2) delta^2, with the deviation delta = phi - phi0 [rad] from the rest
/// angle.
///
/// The angle phi [rad] is the rotation of the second edge against the first about an axis n since both were drawn, by
/// the right-hand rule. The first edge carries the axis n, a unit vector u normal to n, and v = n x u. The second edge
/// carries w. As drawn, w is u. Then
///   phi = atan2(s, c),   c = w . u,   s = w . v.
/// If the edges rotate about n alone, phi is the angle of a revolute joint with this axis. Its deviation is taken
/// from -pi to pi, so that the spring does not count full turns. phi is not defined where w is parallel to n.
///
/// Rotating the second edge by omega changes s by omega . (w x v) and c by omega . (w x u), and rotating the first edge
/// by omega changes both by minus that. With d phi = (c ds - s dc) / (c^2 + s^2), the moment on the first edge is
///   m = (k delta / (c^2 + s^2)) (c w x v - s w x u),
/// and on the second edge -m. Where w is normal to n, m = k delta n.
///
/// Over an energy-momentum step from (c0, s0) to (c1, s1), with means c, s and u, v, w of start and end,
///   m = k (delta0 + delta1) / 2 (a / X) (c w x v - s w x u),
///   a = atan2(X, Y),   X = c0 s1 - s0 c1,   Y = c0 c1 + s0 s1,
/// is a discrete gradient [Gonzalez 1996, J. Nonlinear Sci. 6, 449]: a = delta1 - delta0, X = c (s1 - s0) - s (c1 -
/// c0), and the change of each product of two vectors is the change of one times the mean of the other, summed. Hence
/// the work of the moments is the change of E, and opposite moments conserve angular momentum. The step needs |a| < pi
/// / 2.

#include <cmath>
#include <numbers>

#include "common/dual.hpp"
#include "geometry/vec3.hpp"

namespace withe {

/// Vectors that the edges carry: u and v go with the first, w with the second.
template <class Scalar>
struct TorsionArms {
  Vec3<Scalar> u, v, w;

  Scalar cosine() const { return dot(w, u); }
  Scalar sine() const { return dot(w, v); }
};

/// Torque k delta + T [N m].
struct TorsionSpring {
  double stiffness = 0, rest_angle = 0, torque = 0;
};

/// atan2(s, c) [rad].
template <class Scalar>
Scalar torsion_angle(const TorsionArms<Scalar>& arms) {
  const Scalar c = arms.cosine(), s = arms.sine();
  const double x = value_of(c), y = value_of(s), square = x * x + y * y;
  return chain(s, std::atan2(y, x), x / square) + chain(c, 0.0, -y / square);
}

/// Deviation delta, from -pi to pi [rad].
template <class Scalar>
Scalar torsion_deviation(const TorsionSpring& spring, const TorsionArms<Scalar>& arms) {
  const Scalar angle = torsion_angle(arms);
  return chain(angle, std::remainder(value_of(angle) - spring.rest_angle, 2.0 * std::numbers::pi), 1.0);
}

inline double torsion_energy(const TorsionSpring& spring, const TorsionArms<double>& arms) {
  const double deviation = torsion_deviation(spring, arms);
  return 0.5 * spring.stiffness * deviation * deviation;
}

/// Moment on the first edge [N m]: the gradient of the energy by a rotation of the second edge.
template <class Scalar>
Vec3<Scalar> torsion_moment(const TorsionSpring& spring, const TorsionArms<Scalar>& arms) {
  const Scalar c = arms.cosine(), s = arms.sine();
  const Scalar torque = spring.stiffness * torsion_deviation(spring, arms) + spring.torque;
  return (torque / (c * c + s * s)) * (c * cross(arms.w, arms.v) - s * cross(arms.w, arms.u));
}

/// Moment on the first edge over an energy-momentum step [N m].
template <class Scalar>
Vec3<Scalar> discrete_torsion_moment(const TorsionSpring& spring, const TorsionArms<double>& start,
                                     const TorsionArms<Scalar>& end) {
  const auto mean = [](const Vec3<double>& a, const Vec3<Scalar>& b) {
    return Vec3<Scalar>{0.5 * (a.x + b.x), 0.5 * (a.y + b.y), 0.5 * (a.z + b.z)};
  };
  const double c0 = start.cosine(), s0 = start.sine();
  const Scalar c1 = end.cosine(), s1 = end.sine();
  const Scalar X = c0 * s1 - s0 * c1, Y = c0 * c1 + s0 * s1, slope = X / Y;
  // atan(x) / x and its derivative, by their series where x is small.
  const double x = value_of(slope), square = x * x;
  const bool by_series = std::abs(x) < 1e-2;
  const double ratio = by_series ? 1.0 - square * (1.0 / 3.0 - square * (0.2 - square / 7.0)) : std::atan(x) / x;
  const double by_x =
      by_series ? -x * (2.0 / 3.0 - square * (0.8 - 6.0 * square / 7.0)) : (1.0 / (1.0 + square) - ratio) / x;
  const Scalar over = chain(slope, ratio, by_x) / Y, turn = X * over;
  const Scalar torque = spring.stiffness * (torsion_deviation(spring, start) + 0.5 * turn) + spring.torque;
  const Vec3<Scalar> u = mean(start.u, end.u), v = mean(start.v, end.v), w = mean(start.w, end.w);
  return (torque * over) * ((0.5 * (c0 + c1)) * cross(w, v) - (0.5 * (s0 + s1)) * cross(w, u));
}

}  // namespace withe
