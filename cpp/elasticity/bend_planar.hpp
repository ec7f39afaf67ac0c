#pragma once
/// Bending in a plane. The energy depends on the turn phi between two directions only:
///   E = K (beta - n)^2 / 2,  beta = f(kappa^2) kappa,  kappa = 2 tan(phi / 2), positive from the first axis to the
/// second. [Choi, dissertation 3.3, 3.5 without the third coordinate; f: geometry/bend_measure.hpp].

#include "geometry/bend_measure.hpp"

namespace withe {

template <class Scalar>
struct PlanarBend {
  Scalar energy;
  Scalar slope;      ///< dE / dphi [N m]
  Scalar curvature;  ///< d2E / dphi2 [N m]
};

/// beta and its derivatives with respect to phi.
template <class Scalar>
struct PlanarStrain {
  Scalar value, first, second;
};

/// kappa' = 1 + kappa^2 / 4, kappa'' = kappa kappa' / 2.
template <class Scalar>
PlanarStrain<Scalar> planar_strain(const BendMeasure& measure, const Scalar& kappa) {
  const Scalar x = kappa * kappa;
  const BendFactor<Scalar> f = bend_factor(measure, x);
  const Scalar by_kappa = f.value + 2.0 * (x * f.first);
  const Scalar turn = 1.0 + 0.25 * x;
  const Scalar first = by_kappa * turn;
  const Scalar second = kappa * turn * ((6.0 * f.first + 4.0 * (x * f.second)) * turn + 0.5 * by_kappa);
  return {f.value * kappa, first, second};
}

template <class Scalar>
PlanarBend<Scalar> planar_bend(const BendMeasure& measure, const Scalar& kappa, const Scalar& natural,
                               const Scalar& stiffness) {
  const PlanarStrain<Scalar> beta = planar_strain(measure, kappa);
  const Scalar strain = beta.value - natural;
  const Scalar moment = stiffness * strain;
  return {0.5 * moment * strain, moment * beta.first, stiffness * beta.first * beta.first + moment * beta.second};
}

}  // namespace withe
