#pragma once
/// Strains between two frames: discrete curvature and twist.

#include <cmath>

#include "geometry/frames.hpp"

namespace withe {

/// Curvature components [-] (2 tan(phi / 2) for a turn by phi, kappa1 towards d1, kappa2 towards d2) and
/// twist [rad]. [Bergou et al. 2010, section 3; Choi, dissertation 3.3, 3.4, 3.6].
template <class Scalar>
struct BendTwistStrain {
  Scalar kappa1, kappa2, tau;
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
  const Scalar angle = arctangent(-dot(carried, f1.d2), dot(carried, f1.d1));
  constexpr double kTwoPi = 6.283185307179586476925286766559;
  return {0.5 * dot(kb, f0.d2 + f1.d2), -0.5 * dot(kb, f0.d1 + f1.d1),
          angle + kTwoPi * round_to_integer((previous_tau - angle) / kTwoPi)};
}

/// kappa = 2 tan(phi / 2) between unit tangents (x0, y0) and (x1, y1).
template <class Scalar>
Scalar planar_kappa(const Scalar& x0, const Scalar& y0, const Scalar& x1, const Scalar& y1) {
  return 2.0 * (x0 * y1 - y0 * x1) / (1.0 + x0 * x1 + y0 * y1);
}

}  // namespace withe
