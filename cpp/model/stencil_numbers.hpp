#pragma once
/// Coefficients of a stencil from those of its edges, for any scalar: doubles, or dual numbers for derivatives.

#include <cmath>
#include <numbers>

#include "common/dual.hpp"
#include "common/types.hpp"
#include "geometry/bend_measure.hpp"
#include "geometry/vec3.hpp"

namespace withe {

/// V / K of a part of an edge of length V; infinite without stiffness.
template <class Scalar>
Scalar flexibility(double length, const Scalar& stiffness) {
  return value_of(stiffness) == 0.0 ? Scalar(INFINITY) : length / stiffness;
}
/// Stiffness of two parts in series, whose flexibilities add up.
template <class Scalar>
Scalar in_series(const Scalar& flexibility0, const Scalar& flexibility1) {
  return 1.0 / (flexibility0 + flexibility1);
}

/// Twisting stiffness of a stencil on an arc that turns by phi. A moment along the middle of the arc also bends both of
/// its ends: the compliance is 1 / Kt + phi^2 / (12 K). K is the stiffness against bending about the normal of the arc,
/// from the `share` of the squared curvature towards each director.
template <class Scalar>
Scalar twist_of_arc(const Scalar& twist, const Scalar& bend1, const Scalar& bend2, double square_of_turn,
                    const Vector2& share) {
  return 1.0 / (1.0 / twist + square_of_turn / 12.0 * (share(0) / bend2 + share(1) / bend1));
}

/// Factor 2 tan(|kappa| V / 2) / |kappa| [m], which turns a curvature of the smooth rod into a discrete curvature.
template <class Scalar>
Scalar discrete_over_smooth(const Scalar& kappa1, const Scalar& kappa2, double voronoi) {
  using std::sqrt;
  const Scalar square = kappa1 * kappa1 + kappa2 * kappa2;
  if (value_of(square) * voronoi * voronoi < 1e-16) return voronoi + (voronoi * voronoi * voronoi / 12.0) * square;
  const Scalar k = sqrt(square), phi = voronoi * k;
  const double t = std::tan(0.5 * value_of(phi));
  return chain(phi, 2.0 * t, 1.0 + t * t) / k;
}

/// Its inverse, 2 atan(|kappa| / 2) / (|kappa| V), which makes a curvature of the smooth rod of a discrete one [1/m].
template <class Scalar>
Scalar smooth_over_discrete(const Scalar& kappa1, const Scalar& kappa2, double voronoi) {
  using std::sqrt;
  const Scalar square = kappa1 * kappa1 + kappa2 * kappa2;
  if (value_of(square) < 1e-8) return 1.0 / voronoi - (1.0 / (12.0 * voronoi)) * square;
  const Scalar k = sqrt(square);
  const double half = 0.5 * value_of(k);
  return chain(k, 2.0 * std::atan(half), 1.0 / (1.0 + half * half)) / (k * voronoi);
}

/// Strains of bending and twisting of a naturally curved and twisted stencil.
template <class Scalar>
Vec3<Scalar> natural_strain(const BendMeasure& measure, const Scalar& kappa1, const Scalar& kappa2, const Scalar& twist,
                            double voronoi) {
  const Scalar factor = discrete_over_smooth(kappa1, kappa2, voronoi), x = factor * kappa1, y = factor * kappa2;
  const Scalar f = bend_factor(measure, x * x + y * y).value;
  return {f * x, f * y, f * (voronoi * twist)};
}

}  // namespace withe
