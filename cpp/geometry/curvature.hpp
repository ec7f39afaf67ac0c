#pragma once
/// Strains between two frames: discrete curvature and twist.

#include <cmath>

#include "geometry/frames.hpp"

namespace withe {

/// Curvature components [-] (2 tan(phi / 2) for a turn by phi, kappa1 towards d1, kappa2 towards d2) and
/// twist [rad]. [Bergou et al. 2010, section 3; dissertation 3.3, 3.4, 3.6].
template <class Scalar>
struct BendTwistStrain {
  Scalar kappa1, kappa2, tau;
};

/// Strains; `tau` is taken on the branch nearest to `previous_tau`.
inline BendTwistStrain<double> bend_twist_strain(const EdgeFrame<double>& f0, const EdgeFrame<double>& f1,
                                                 double previous_tau) {
  const double chi = 1.0 + dot(f0.tangent, f1.tangent);
  const Vec3<double> kb = (2.0 / chi) * cross(f0.tangent, f1.tangent);
  const Vec3<double> carried = parallel_transport(f0.d1, f0.tangent, f1.tangent);
  const double angle = std::atan2(-dot(carried, f1.d2), dot(carried, f1.d1));
  constexpr double kTwoPi = 6.283185307179586476925286766559;
  return {0.5 * dot(kb, f0.d2 + f1.d2), -0.5 * dot(kb, f0.d1 + f1.d1),
          angle + kTwoPi * std::round((previous_tau - angle) / kTwoPi)};
}

/// kappa = 2 tan(phi / 2) between unit tangents (x0, y0) and (x1, y1).
inline double planar_kappa(double x0, double y0, double x1, double y1) {
  return 2.0 * (x0 * y1 - y0 * x1) / (1.0 + x0 * x1 + y0 * y1);
}

}  // namespace withe
