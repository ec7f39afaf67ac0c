#pragma once
/// Finite rotations: exponential, logarithm, and the Cayley map with its derivative.

#include <Eigen/Geometry>  // for the cross products of who includes this

#include "common/types.hpp"

namespace withe {

inline Matrix3 cross_matrix(const Vector3& a) {
  Matrix3 m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

/// Rotation by |vector| rad about vector.
Matrix3 rotation_exp(const Vector3& vector);

/// Spatial spin = rotation_spin(v) dv of exp(v): I + (1 - cos a) / a^2 V + (a - sin a) / a^3 V^2, a = |v|.
Matrix3 rotation_spin(const Vector3& vector);

/// Rotation vector of a rotation, |result| <= pi.
Vector3 rotation_log(const Matrix3& rotation);

/// Cayley map: rotation by 2 atan(|w| / 2) about w; equals the exponential up to third order, and its
/// spin is a rational function, without a singular coefficient at w = 0.
Matrix3 cayley(const Vector3& w);

/// Inverse of the Cayley map; needs an angle below pi.
Vector3 cayley_inverse(const Matrix3& rotation);

/// Spatial spin = cayley_spin(w) dw.
Matrix3 cayley_spin(const Vector3& w);

/// Derivative of cayley_spin(w)^T m by w.
Matrix3 cayley_moment_slope(const Vector3& w, const Vector3& m);

/// Removes the rounding that products of rotations collect.
Matrix3 orthonormalized(const Matrix3& rotation);

}  // namespace withe
