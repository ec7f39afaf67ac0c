#pragma once
/// The parts that a step of fourth order is composed of.

#include <array>

namespace withe {

/// Parts of a fourth-order step, each a symmetric step of second order. The third goes back in time
/// [Suzuki 1990; Hairer, Lubich and Wanner: Geometric numerical integration, 2006, II.4].
inline constexpr double kSuzuki = 0.41449077179437573714;  // 1 / (4 - 4^(1/3))
inline constexpr std::array<double, 5> kFourthOrderParts = {kSuzuki, kSuzuki, 1.0 - 4.0 * kSuzuki, kSuzuki, kSuzuki};
/// Sum of their errors of fifth order in dt, |sum g^5| / 80, relative to dt^5 times the third derivative.
inline constexpr double kFourthOrderError = [] {
  double sum = 0.0;
  for (double g : kFourthOrderParts) sum += g * g * g * g * g / 80.0;
  return sum < 0.0 ? -sum : sum;
}();
/// Sum of the absolute lengths of the parts. The error of momentum from tolerances grows with it.
inline constexpr double kFourthOrderWay = [] {
  double sum = 0.0;
  for (double g : kFourthOrderParts) sum += g < 0.0 ? -g : g;
  return sum;
}();

}  // namespace withe
