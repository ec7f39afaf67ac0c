#pragma once
/// Strains between two frames: discrete curvature and twist.

#include <cmath>

#include "geometry/frames.hpp"
#include "geometry/vec2.hpp"

namespace withe {

/// Curvature components [-] (2 tan(phi / 2) for a turn by phi, kappa1 towards d1, kappa2 towards d2, in directors
/// halfway between the two frames) and twist [rad]. [Bergou et al. 2010, section 3; Choi, dissertation 3.3, 3.4, 3.6].
template <class Scalar>
struct BendTwistStrain {
  Scalar kappa1, kappa2, tau;
};

/// Cosine and sine of half a twist, by which the directors halfway between two frames are turned from those of the
/// first. The mean of both frames' directors is shorter by this cosine: in it a rod would bend with cos^2(tau / 2) of
/// its stiffness. Whole turns of tau matter: without them curvatures would change their sign abruptly when tau passes
/// half a turn.
template <class Scalar>
struct HalfTwist {
  Scalar cosine, sine;

  /// Converts components in (d1, d2) of the first frame into components in the halfway directors.
  Vec2<Scalar> to_halfway(const Vec2<Scalar>& a) const {
    return {cosine * a.x + sine * a.y, cosine * a.y - sine * a.x};
  }
  Vec2<Scalar> to_first(const Vec2<Scalar>& a) const { return {cosine * a.x - sine * a.y, cosine * a.y + sine * a.x}; }
};
inline HalfTwist<double> half_twist(double tau) { return {std::cos(0.5 * tau), std::sin(0.5 * tau)}; }

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
  const Scalar tau = angle + kTwoPi * round_to_integer((previous_tau - angle) / kTwoPi);
  const Vec2<Scalar> kappa = half_twist(tau).to_halfway({dot(kb, f0.d2), -dot(kb, f0.d1)});
  return {kappa.x, kappa.y, tau};
}

/// kappa = 2 tan(phi / 2) between unit tangents (x0, y0) and (x1, y1).
template <class Scalar>
Scalar planar_kappa(const Scalar& x0, const Scalar& y0, const Scalar& x1, const Scalar& y1) {
  return 2.0 * (x0 * y1 - y0 * x1) / (1.0 + x0 * x1 + y0 * y1);
}

}  // namespace withe
