#pragma once
/// Strains between two frames: discrete curvature and twist.

#include <cmath>

#include "geometry/frames.hpp"

namespace withe {

/// Curvature components [-] (2 tan(phi / 2) for a turn by phi, kappa1 towards d1, kappa2 towards d2, in directors
/// halfway between the two frames) and twist [rad]. [Bergou et al. 2010, section 3; Choi, dissertation 3.3, 3.4, 3.6].
template <class Scalar>
struct BendTwistStrain {
  Scalar kappa1, kappa2, tau;
};

/// The mean of the directors of two frames that are twisted by tau against each other is shorter by cos(tau / 2) than
/// directors halfway between them, and so were curvatures in it: a rod would bend with cos^2(tau / 2) of its
/// stiffness. With z = sin^2(tau / 2) the factor
///   g = (1 - z / 4) / (1 - 3 z / 4)
/// is the Pade approximant of 1 / cos(tau / 2) = (1 - z)^(-1/2), smaller by .1 % at 60 and 1 % at 90 degrees. It has a
/// bound where the frames are opposed, and nothing is halfway.
template <class Scalar>
struct HalfwayFactor {
  Scalar pole, quotient;  ///< 1 / (1 - 3 z / 4) and what else g and its derivatives are made of
  Scalar value, inverse;  ///< g, 1 / g

  explicit HalfwayFactor(const Scalar& cosine) {
    const Scalar z = 0.5 * (1.0 - cosine), numerator = 1.0 - 0.25 * z, denominator = 1.0 - 0.75 * z;
    quotient = 1.0 / (numerator * denominator);
    pole = numerator * quotient;
    value = numerator * pole;
    inverse = denominator * denominator * quotient;
  }
  /// g' / g by tau.
  Scalar first(const Scalar& sine) const { return 0.25 * (sine * quotient); }
  /// g'' / g.
  Scalar second(const Scalar& cosine, const Scalar& sine) const {
    return quotient * (0.25 * cosine + 0.1875 * (pole * (sine * sine)));
  }
};

inline double arctangent(double y, double x) { return std::atan2(y, x); }
inline double round_to_integer(double x) { return std::nearbyint(x); }

/// Strains; `tau` is taken on the branch nearest to `previous_tau`.
template <class Scalar>
BendTwistStrain<Scalar> bend_twist_strain(const EdgeFrame<Scalar>& f0, const EdgeFrame<Scalar>& f1,
                                          const Scalar& previous_tau) {
  const Scalar chi = 1.0 + dot(f0.tangent, f1.tangent);
  const Vec3<Scalar> kb = (2.0 / chi) * cross(f0.tangent, f1.tangent);
  const Vec3<Scalar> carried = parallel_transport(f0.d1, f0.tangent, f1.tangent);
  const Scalar cosine = dot(carried, f1.d1), angle = arctangent(-dot(carried, f1.d2), cosine);
  const Scalar half = 0.5 * HalfwayFactor<Scalar>(cosine).value;
  constexpr double kTwoPi = 6.283185307179586476925286766559;
  return {half * dot(kb, f0.d2 + f1.d2), -half * dot(kb, f0.d1 + f1.d1),
          angle + kTwoPi * round_to_integer((previous_tau - angle) / kTwoPi)};
}

/// kappa = 2 tan(phi / 2) between unit tangents (x0, y0) and (x1, y1).
template <class Scalar>
Scalar planar_kappa(const Scalar& x0, const Scalar& y0, const Scalar& x1, const Scalar& y1) {
  return 2.0 * (x0 * y1 - y0 * x1) / (1.0 + x0 * x1 + y0 * y1);
}

}  // namespace withe
