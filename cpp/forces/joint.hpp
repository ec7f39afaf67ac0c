#pragma once
/// Motor, spring and damper of a revolute joint. Its angle theta is measured from the drawing [rad]. The torque
///   T = m - k (theta - theta0) - c dtheta/dt
/// acts on the turning part, and its opposite on the part against which it turns. A
/// motor has the moment m [N m], a spring the stiffness k [N m/rad] and the rest angle theta0 [rad], and a damper the
/// damping c [N m s/rad]. A servo is a spring whose rest angle moves.
///
/// T is linear in theta. A step of dt uses the angle at its end, or the middle angle (theta0 + theta1) / 2. With the
/// middle angle the work T (theta1 - theta0) is exactly the loss of k (theta - theta0)^2 / 2, minus the dissipation of
/// the damper. The force of the midpoint rule is therefore a discrete gradient [Gonzalez 1996, J. Nonlinear Sci. 6]. In
/// a plane, frames that turn by x and y are measured by their Cayley vectors 2 tan(x / 2). T is then scaled by s to
/// keep this work:
///   T (x - y) = T s (2 tan(x / 2) - 2 tan(y / 2)).
///
/// Stops at the angles a < b push back with the energy V = k (theta - b)^2 / 2 above b and k (a - theta)^2 / 2 below a.
/// Their torque over a step is the discrete gradient -(V(theta1) - V(theta0)) / (theta1 - theta0), so that a joint
/// rebounds from them without loss.

#include <algorithm>
#include <cmath>

#include "common/dual.hpp"
#include "model/description.hpp"

namespace withe {

struct JointTorque {
  double stiffness = 0, rest_angle = 0, damping = 0, moment = 0;
  JointStops stops = {};

  bool acts() const { return stiffness != 0.0 || damping != 0.0 || moment != 0.0 || stops.stiffness != 0.0; }
  /// k (theta - theta0)^2 / 2 and the energy of the stops [J].
  double energy(double angle) const {
    const double beyond = std::max({angle - stops.high, stops.low - angle, 0.0});
    return 0.5 * stiffness * (angle - rest_angle) * (angle - rest_angle) + 0.5 * stops.stiffness * beyond * beyond;
  }
};

/// Mean of the angle beyond a limit, from 0 on, over the change of an angle that is `from` and `to` beyond it.
template <class Scalar>
Scalar mean_beyond(const Scalar& from, const Scalar& to) {
  const bool first = value_of(from) > 0.0, last = value_of(to) > 0.0;
  if (first && last) return 0.5 * (from + to);
  if (last) return (0.5 * to * to) / (to - from);
  if (first) return (0.5 * from * from) / (from - to);
  return Scalar(0.0);
}

/// Torque of stops over a change of angle; at one angle where both are the same [N m].
template <class Scalar>
Scalar torque_of_stops(const JointStops& stops, const Scalar& from, const Scalar& to) {
  if (stops.stiffness == 0.0) return Scalar(0.0);
  return stops.stiffness * (mean_beyond<Scalar>(stops.low - from, stops.low - to) -
                            mean_beyond<Scalar>(from - stops.high, to - stops.high));
}

/// T and the torque of the stops, over a change of angle with a mean and a mean rate [N m].
template <class Scalar>
Scalar torque_of(const JointTorque& joint, const Scalar& angle, const Scalar& rate, const Scalar& from,
                 const Scalar& to) {
  return joint.moment - joint.stiffness * (angle - joint.rest_angle) - joint.damping * rate +
         torque_of_stops(joint.stops, from, to);
}

/// The same at one angle.
template <class Scalar>
Scalar torque_of(const JointTorque& joint, const Scalar& angle, const Scalar& rate) {
  return torque_of(joint, angle, rate, angle, angle);
}

/// s = (x - y) / (2 tan(x / 2) - 2 tan(y / 2)), with tan a - tan b = tan(a - b) (1 + tan a tan b).
template <class Scalar>
Scalar share_of_turns(const Scalar& x, const Scalar& y) {
  const auto tangent_of_half = [](const Scalar& a) {
    const double t = std::tan(0.5 * value_of(a));
    return chain(a, t, 0.5 * (1.0 + t * t));
  };
  // u / (2 tan(u / 2)) and its derivative.
  const auto ratio = [](const Scalar& u) {
    const double v = value_of(u), t = std::tan(0.5 * v);
    if (std::abs(v) < 1e-2) return chain(u, 1.0 - v * v * (1.0 + v * v / 60.0) / 12.0, -v * (1.0 + v * v / 30.0) / 6.0);
    return chain(u, 0.5 * v / t, 0.5 * (t - 0.5 * v * (1.0 + t * t)) / (t * t));
  };
  return ratio(x - y) / (1.0 + tangent_of_half(x) * tangent_of_half(y));
}

}  // namespace withe
