#pragma once
/// Motor, spring and damper of a revolute joint. Its angle theta is measured from the drawing [rad]. The torque
///   T = m - clamp(k (theta - theta0), -L, L) - c dtheta/dt
/// acts on the turning part, and its opposite on the part against which it turns. A
/// motor has the moment m [N m], a spring the stiffness k [N m/rad] and the rest angle theta0 [rad], and a damper the
/// damping c [N m s/rad]. A servo is a spring whose rest angle moves, and L [N m] is its greatest torque. The energy of
/// the spring is that of Huber: k e^2 / 2 up to |e| = L / k, and L |e| - L^2 / (2 k) beyond, where e = theta - theta0.
///
/// Below L, T is linear in theta. A step of dt uses the angle at its end, or the middle angle (theta0 + theta1) / 2.
/// With the middle angle the work T (theta1 - theta0) is exactly the loss of k (theta - theta0)^2 / 2, minus the
/// dissipation of the damper. The force of the midpoint rule is therefore a discrete gradient [Gonzalez 1996, J.
/// Nonlinear Sci. 6]. In a plane, frames that turn by x and y are measured by their Cayley vectors 2 tan(x / 2). T is
/// then scaled by s to keep this work:
///   T (x - y) = T s (2 tan(x / 2) - 2 tan(y / 2)).
/// In a step in which the spring reaches L, its torque is its mean over the change of the angle. This mean keeps the
/// work too.
///
/// Stops at the angles a < b push back with the energy V = k (theta - b)^2 / 2 above b and k (a - theta)^2 / 2 below a.
/// Their torque over a step is the discrete gradient -(V(theta1) - V(theta0)) / (theta1 - theta0), so that a joint
/// rebounds from them without loss. With a restitution r, the torque of a stop is multiplied by 1 + d u / u0. Here u is
/// the rate into the stop, and u0 is u as the joint met the stop [Hunt and Crossley 1975, J. Appl. Mech. 42]. The joint
/// leaves at the rate -r u0, whatever its inertia is, if d (1 + r) = log((1 + d) / (1 - r d)). A stop never pulls. The
/// factor is linear in the mean rate of a step, so that a stop takes energy in every step. A joint slower than
/// 0.001 rad/s or m/s counts as one with this rate, and a restitution below 0.01 as 0.01.

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/dual.hpp"
#include "model/description.hpp"

namespace withe {

struct JointTorque {
  double stiffness = 0, rest_angle = 0, damping = 0, moment = 0;
  JointStops stops = {};
  double max_torque = std::numeric_limits<double>::infinity();

  /// Elongation of the spring at which it reaches its greatest torque [rad].
  double most() const { return max_torque / stiffness; }
  bool saturates() const { return std::isfinite(max_torque) && stiffness != 0.0; }
  /// True if the spring has its greatest torque at an angle.
  bool is_saturated(double angle) const { return saturates() && std::abs(angle - rest_angle) > most(); }
  bool acts() const { return stiffness != 0.0 || damping != 0.0 || moment != 0.0 || stops.stiffness != 0.0; }
  /// Energy of the spring and the stops [J].
  double energy(double angle) const {
    const double beyond = std::max({angle - stops.high, stops.low - angle, 0.0});
    const double of_stops = 0.5 * stops.stiffness * beyond * beyond;
    if (is_saturated(angle)) return max_torque * (std::abs(angle - rest_angle) - 0.5 * most()) + of_stops;
    return 0.5 * stiffness * (angle - rest_angle) * (angle - rest_angle) + of_stops;
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

/// Mean of an elongation between -most and most, over its change.
template <class Scalar>
Scalar mean_within(const Scalar& from, const Scalar& to, double most) {
  const double first = value_of(from), last = value_of(to);
  if (std::abs(first) <= most && std::abs(last) <= most) return 0.5 * (from + to);
  if (first >= most && last >= most) return Scalar(most);
  if (first <= -most && last <= -most) return Scalar(-most);
  return 0.5 * (from + to) - mean_beyond<Scalar>(from - most, to - most) +
         mean_beyond<Scalar>(-most - from, -most - to);
}

/// A change of the angle of a joint, with its mean and its mean rate.
template <class Scalar>
struct JointChange {
  Scalar mean, rate, from, to;
  double entry_rate;  ///< at which the joint has met the stop that it is in [rad/s]
};

/// Factor of the elastic torque of a stop. `in`: rate into the stop [rad/s].
template <class Scalar>
Scalar impact_factor(const JointStops& stops, const Scalar& in, double entry_rate) {
  constexpr double kSlowest = 1e-3;
  const Scalar factor = 1.0 + (stops.impact_loss / std::max(entry_rate, kSlowest)) * in;
  return value_of(factor) > 0.0 ? factor : Scalar(0.0);
}

/// Torque of stops [N m].
template <class Scalar>
Scalar torque_of_stops(const JointStops& stops, const JointChange<Scalar>& change) {
  if (stops.stiffness == 0.0) return Scalar(0.0);
  const Scalar low = mean_beyond<Scalar>(stops.low - change.from, stops.low - change.to),
               high = mean_beyond<Scalar>(change.from - stops.high, change.to - stops.high);
  if (stops.impact_loss == 0.0) return stops.stiffness * (low - high);
  const Scalar down = -1.0 * change.rate;
  return stops.stiffness * (impact_factor<Scalar>(stops, down, change.entry_rate) * low -
                            impact_factor<Scalar>(stops, change.rate, change.entry_rate) * high);
}

/// T and the torque of the stops [N m].
template <class Scalar>
Scalar torque_of(const JointTorque& joint, const JointChange<Scalar>& change) {
  const Scalar others = torque_of_stops(joint.stops, change);
  if (!joint.saturates())
    return joint.moment - joint.stiffness * (change.mean - joint.rest_angle) - joint.damping * change.rate + others;
  const Scalar from = change.from - joint.rest_angle, to = change.to - joint.rest_angle;
  return joint.moment - joint.stiffness * mean_within(from, to, joint.most()) - joint.damping * change.rate + others;
}

/// The same at one angle.
template <class Scalar>
Scalar torque_of(const JointTorque& joint, const Scalar& angle, const Scalar& rate) {
  return torque_of(joint, JointChange<Scalar>{angle, rate, angle, angle, std::abs(value_of(rate))});
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
