#pragma once
/// Stretching of one edge.

#include "geometry/vec3.hpp"

namespace withe {

/// Stretching energy of one edge, E = (EA / 2) eps^2 L with axial strain eps = |e| / L - 1.
/// [Bergou et al. 2008, section 4.2.3]. Lengths in m, axial stiffness in N, result in J.
template <class Scalar>
Scalar stretch_energy(const Scalar& length, const Scalar& rest_length, const Scalar& axial_stiffness) {
  const Scalar strain = length / rest_length - 1.0;
  return 0.5 * axial_stiffness * strain * strain * rest_length;
}

/// Hessian with respect to the edge vector: (EA / L) t t^T + (n / l) (I - t t^T). The axial force n is given
/// apart: with n = EA eps it is the exact Hessian, with n its own unknown that of the mixed Newton method
/// [Magisano, Leonetti and Garcea 2017].
template <class Scalar>
Mat3<Scalar> stretch_hessian(const Vec3<Scalar>& tangent, const Scalar& inverse_length, const Scalar& rest_length,
                             const Scalar& axial_stiffness, const Scalar& axial_force) {
  const Scalar g = axial_force * inverse_length;
  Mat3<Scalar> H{};
  add_identity(H, g);
  add_outer(H, axial_stiffness / rest_length - g, tangent, tangent);
  return H;
}

}  // namespace withe
