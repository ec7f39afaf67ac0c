#pragma once
/// Interpolation by polynomials.

#include <array>
#include <cstddef>

namespace withe {

/// Weights, at x, of values at the first `count` of some places in the polynomial through them [Lagrange]; 0 of others.
template <std::size_t most>
std::array<double, most> lagrange_weights(const std::array<double, most>& places, std::size_t count, double x) {
  std::array<double, most> weights{};
  for (std::size_t i = 0; i < count; ++i) {
    weights[i] = 1.0;
    for (std::size_t j = 0; j < count; ++j)
      if (j != i) weights[i] *= (x - places[j]) / (places[i] - places[j]);
  }
  return weights;
}

}  // namespace withe
