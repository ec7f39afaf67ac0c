#pragma once
/// Stretching of one edge, with the energy E = (EA / 2) (eps - eps_n)^2 L, axial strain eps = |e| / L - 1.
/// [Bergou et al. 2008, section 4.2.3].

#include <type_traits>

#include "geometry/vec2.hpp"
#include "geometry/vec3.hpp"

namespace withe {

/// n = EA (eps - eps_n) [N]: the derivative of the energy by the length. Lengths in m, axial stiffness in N.
template <class Scalar>
Scalar axial_force(const Scalar& length, const Scalar& rest_length, const std::type_identity_t<Scalar>& axial_stiffness,
                   const std::type_identity_t<Scalar>& natural_strain) {
  return axial_stiffness * (length / rest_length - 1.0 - natural_strain);
}

/// Hessian with respect to the edge vector: (EA / L) t t^T + (n / l) (I - t t^T), from the `modulus` EA / L and the
/// `transverse` stiffness n / l. The axial force n is a separate argument. With n = EA eps the result is the exact
/// Hessian. With n as an independent unknown it is the Hessian of the mixed Newton method [Magisano, Leonetti and
/// Garcea 2017]. An energy-momentum step has the force n m with m = (e0 + e1) / (l0 + l1). Its derivative by the
/// mid-step vector takes m as `direction`, the tangent at the end as `tangent`, and 2 n / (l0 + l1) as `transverse`.
template <class Matrix, class Vector, class Scalar>
void add_stretch_hessian(const Vector& direction, const Vector& tangent, const Scalar& modulus,
                         const Scalar& transverse, Matrix& out) {
  add_identity(out, transverse);
  add_outer(out, modulus - transverse, direction, tangent);
}

}  // namespace withe
