#pragma once
/// The equations of `sheet.hpp` where the width is one straight piece; on numbers, packs, and numbers with derivatives.

#include <array>
#include <cmath>

#include "common/dual.hpp"

namespace withe {

/// Piece of the width from a place on: b = width + slope (t - begin), where t is the distance from the tip. `weight`:
/// weight of all pieces before it.
template <class Number>
struct WidthPiece {
  Number begin = 0.0, width = 1.0, slope = 0.0, weight = 0.0;

  template <class Scalar>
  Scalar width_at(const Scalar& t) const {
    return width + slope * (t - begin);
  }
  template <class Scalar>
  Scalar weight_at(const Scalar& t) const {
    return weight + (t - begin) * (width + (0.5 * slope) * (t - begin));
  }
};

template <class Scalar>
struct SineAndCosine {
  Scalar sine, cosine;
};

inline SineAndCosine<double> sine_cosine(double x) { return {std::sin(x), std::cos(x)}; }

template <int N, class Number>
SineAndCosine<Dual<N, Number>> sine_cosine(const Dual<N, Number>& x) {
  const auto [sine, cosine] = sine_cosine(x.value);
  return {chain(x, sine, cosine), chain(x, cosine, -sine)};
}

/// d(theta, m, X, Z)/ds.
template <class Scalar, class Number>
struct SheetSlope {
  Scalar up, forward, length;
  bool even = true;  ///< b = 1 all along; of others:
  WidthPiece<Number> piece{};
  Scalar weight{};  ///< weight of the lifted part

  std::array<Scalar, 4> operator()(const Scalar& s, const std::array<Scalar, 4>& y) const {
    const auto [sine, cosine] = sine_cosine(y[0]);
    if (even) return {0.5 * y[1], (up - s) * cosine - forward * sine, cosine, sine};
    const Scalar t = length - s, before = weight - piece.weight_at(t);
    return {0.5 * (y[1] / piece.width_at(t)), (up - before) * cosine - forward * sine, cosine, sine};
  }
};

}  // namespace withe
