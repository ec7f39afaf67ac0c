#pragma once
/// A spring with a parallel damper (Kelvin and Voigt) between two nodes at x0 and x1, with d = x1 - x0 and l = |d|:
///   E = (k / 2) (l - L)^2,   n = k (l - L) + c dl/dt,
/// where n is the axial force [N] along d, positive in tension, k the stiffness [N/m], L the rest length [m], and c the
/// damping [N s/m]. With L = 0 the force is k d, and linear. At d = 0 a spring with L > 0 has no direction. It then
/// exerts no force, and its stiffness is k in all directions.
///
/// Over a step of dt from d0 to d1 the force acts along w at
///   the end, d = d1:        n = k (l1 - L) + c (l1 - l0) / dt,               w = d1 / l1;
///   the middle d:           n = k (l - L) + c (l1 - l0) / dt,                w = d / l,  d1 = 2 d - d0;
///   the mean of both ends:  n = k ((l0 + l1) / 2 - L) + c (l1 - l0) / dt,    w = (d0 + d1) / (l0 + l1).
/// The last is a discrete gradient [Gonzalez 1996, J. Nonlinear Sci. 6; Simo, Tarnow and Doblare 1995]. The product
/// w . (d1 - d0) is l1 - l0. Its work is the change of E plus the dissipation of the damper, c (l1 - l0)^2 / dt. All
/// forces are along d in the middle or at the end, where the rule evaluates moments. Angular momentum is therefore
/// conserved.

#include <cmath>

#include "common/dual.hpp"
#include "geometry/vec3.hpp"

namespace withe {

struct Spring {
  double stiffness = 0, rest_length = 0, damping = 0;
};

enum class SpringRule { end, middle, mean };

/// State of a spring at the start of a step.
template <class Scalar>
struct SpringStart {
  SpringRule rule = SpringRule::end;
  Vec3<Scalar> d{};  ///< d0 [m]
  double rate = 0;   ///< 1 / dt [1/s]; 0: at rest
};

template <class Scalar>
struct SpringForce {
  Scalar tension;           ///< n [N]
  Vec3<Scalar> direction;   ///< w
  Mat3<Scalar> derivative;  ///< derivative of n w by d at the end, or in the middle [N/m]
};

inline double spring_energy(const Spring& spring, double length) {
  const double stretched = length - spring.rest_length;
  return 0.5 * spring.stiffness * stretched * stretched;
}

/// n w and its exact derivative, with w = d / s and s the length that goes with the rule:
///   d(n w)/dd = w (dn/dd)^T + (n / s) (I - w (ds/dd)^T).
/// Symmetric at the end, and in the middle without a damper.
template <class Scalar>
SpringForce<Scalar> spring_force(const Spring& spring, const SpringStart<Scalar>& start, const Vec3<Scalar>& d) {
  using std::sqrt;
  const auto unit = [](const Vec3<Scalar>& v, const Scalar& length) {
    return value_of(length) > 0.0 ? Scalar(1.0 / length) * v : Vec3<Scalar>{};
  };
  const bool at_end = start.rule == SpringRule::end, mean = start.rule == SpringRule::mean;
  const double k = spring.stiffness, c = spring.damping * start.rate;
  const Vec3<Scalar> d1 = at_end ? d : d + d - start.d;
  const Scalar l = sqrt(dot(d, d)), l0 = sqrt(dot(start.d, start.d)), l1 = at_end ? l : sqrt(dot(d1, d1));
  const Vec3<Scalar> t1 = unit(d1, l1), turning = mean ? t1 : unit(d, l);
  const Scalar size = mean ? 0.5 * (l0 + l1) : l;
  SpringForce<Scalar> out{};
  out.tension = k * (size - spring.rest_length) + c * (l1 - l0);
  out.direction = unit(d, size);
  const Scalar across = value_of(size) > 0.0 ? out.tension / size : Scalar(k);
  add_identity(out.derivative, across);
  add_outer(out.derivative, k - across, out.direction, turning);
  add_outer(out.derivative, at_end ? c : 2.0 * c, out.direction, t1);
  return out;
}

}  // namespace withe
