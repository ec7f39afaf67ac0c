#pragma once
/// Bending in a plane. The energy depends on the turn phi between two directions only:
///   E = K (beta - n)^2 / 2,  beta = f(kappa^2) kappa,  kappa = 2 tan(phi / 2), positive from the first axis to the
/// second. [dissertation 3.3, 3.5 without the third coordinate; f: geometry/bend_measure.hpp].

#include "geometry/bend_measure.hpp"

namespace withe {

template <class Scalar>
struct PlanarBend {
  Scalar energy;
  Scalar slope;      ///< dE / dphi [N m]
  Scalar curvature;  ///< d2E / dphi2 [N m]
};

/// Energy and its derivatives with respect to phi: kappa' = 1 + kappa^2 / 4, kappa'' = kappa kappa' / 2.
template <class Scalar>
PlanarBend<Scalar> planar_bend(const BendMeasure& measure, const Scalar& kappa, const Scalar& natural,
                               const Scalar& stiffness) {
  const Scalar x = kappa * kappa;
  const BendFactor<Scalar> f = bend_factor(measure, x);
  const Scalar strain = f.value * kappa - natural;
  const Scalar moment = stiffness * strain;
  const Scalar by_kappa = f.value + 2.0 * (x * f.first);
  const Scalar turn = 1.0 + 0.25 * x;
  const Scalar first = by_kappa * turn;
  const Scalar second = kappa * turn * ((6.0 * f.first + 4.0 * (x * f.second)) * turn + 0.5 * by_kappa);
  return {0.5 * moment * strain, moment * first, stiffness * first * first + moment * second};
}

}  // namespace withe
