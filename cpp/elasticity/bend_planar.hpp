#pragma once
/// Bending in a plane. The energy depends on the turn phi between two directions only:
///   E = K (kappa - k)^2 / 2,  kappa = 2 tan(phi / 2), positive from the first axis to the second.
/// [dissertation 3.3, 3.5 without the third coordinate].

namespace withe {

template <class Scalar>
struct PlanarBend {
  Scalar energy;
  Scalar slope;      ///< dE / dphi [N m]
  Scalar curvature;  ///< d2E / dphi2 [N m]
};

/// Energy and its derivatives with respect to phi: kappa' = 1 + kappa^2 / 4, kappa'' = kappa kappa' / 2.
template <class Scalar>
PlanarBend<Scalar> planar_bend(const Scalar& kappa, const Scalar& natural, const Scalar& stiffness) {
  const Scalar moment = stiffness * (kappa - natural);
  const Scalar first = 1.0 + 0.25 * kappa * kappa;
  return {0.5 * moment * (kappa - natural), moment * first, stiffness * first * first + 0.5 * moment * kappa * first};
}

}  // namespace withe
