#pragma once
/// The angle of a step whose middle is the middle of a rotation.

#include <cmath>

#include "common/dual.hpp"

namespace withe {

/// Cayley vector of a step's rotation by `angle`, for steps whose middle is the middle of a rotation.
template <class Scalar>
Scalar finite_turn(const Scalar& angle) {
  const double t = std::tan(0.5 * value_of(angle));
  return chain(angle, 2.0 * t, 1.0 + t * t);
}

}  // namespace withe
