#pragma once
/// The equations of `rod.hpp` on numbers, packs, and numbers with derivatives.

#include <array>
#include <cstddef>

#include "common/dual.hpp"

namespace withe {

/// d(t, m)/ds, then the derivatives of the quantities that follow from t and m: r, or r and the quaternion that rotates
/// x with the tangent. A Number has no derivatives.
template <class Scalar, class Number>
struct RodSlope {
  Scalar floor[3];
  Number compliance;

  template <std::size_t count>
  std::array<Scalar, count> operator()(const Number& s, const std::array<Scalar, count>& y) const {
    const Scalar n[3] = {-floor[0], -floor[1], s - floor[2]};
    const Scalar stretch = 1.0 + compliance * (n[0] * y[0] + n[1] * y[1] + n[2] * y[2]);
    std::array<Scalar, count> slope;
    slope[0] = 0.5 * (y[4] * y[2] - y[5] * y[1]);
    slope[1] = 0.5 * (y[5] * y[0] - y[3] * y[2]);
    slope[2] = 0.5 * (y[3] * y[1] - y[4] * y[0]);
    slope[3] = stretch * (y[2] * n[1] - y[1] * n[2]);
    slope[4] = stretch * (y[0] * n[2] - y[2] * n[0]);
    slope[5] = stretch * (y[1] * n[0] - y[0] * n[1]);
    if constexpr (count >= 9)
      for (std::size_t i = 0; i < 3; ++i) slope[6 + i] = stretch * y[i];
    if constexpr (count == 13) {  // q' = w q / 2, w = t x t' the turning without twist
      const Scalar* q = &y[9];
      const Scalar twist = y[0] * y[3] + y[1] * y[4] + y[2] * y[5];
      const Scalar m[3] = {y[3] - twist * y[0], y[4] - twist * y[1], y[5] - twist * y[2]};
      slope[9] = -0.25 * (m[0] * q[1] + m[1] * q[2] + m[2] * q[3]);
      slope[10] = 0.25 * (m[0] * q[0] + m[1] * q[3] - m[2] * q[2]);
      slope[11] = 0.25 * (m[1] * q[0] + m[2] * q[1] - m[0] * q[3]);
      slope[12] = 0.25 * (m[2] * q[0] + m[0] * q[2] - m[1] * q[1]);
    }
    return slope;
  }
};

/// Adds the moment of the floor's force, which acts a lever below and some way behind lift-off, to the state there.
template <class Scalar, class Number, std::size_t count>
void add_lever(const Number& lever, const Number& behind, const Scalar (&floor)[3], std::array<Scalar, count>& y) {
  y[3] -= lever * floor[1];
  y[4] += lever * floor[0];
  y[5] += behind * floor[1];
}

}  // namespace withe
