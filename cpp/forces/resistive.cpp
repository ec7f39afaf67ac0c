#include "forces/resistive.hpp"

#include <cmath>
#include <numbers>

#include "common/check.hpp"

namespace withe {

ResistiveCoefficients resistive_coefficients(double radius, double length, double wavelength) {
  const bool waves = wavelength > 0.0;
  const double logarithm = std::log(waves ? 0.18 * wavelength / radius : length / radius);
  const double along = waves ? logarithm : logarithm - 0.5;
  require(along > 0.0, waves ? "wavelength of the fluid must exceed 5.6 radii of every rod, got " +
                                   std::to_string(wavelength) + " m with a radius of " + std::to_string(radius) + " m"
                             : "a rod in a resistive fluid must be longer than 1.7 radii, got a length of " +
                                   std::to_string(length) + " m with a radius of " + std::to_string(radius) + " m");
  return {2.0 * std::numbers::pi / along, 4.0 * std::numbers::pi / (logarithm + 0.5)};
}

void resistive_local(const ResistiveEdge& edge, bool with_hessian, Local& out) {
  const int d = edge.dimension;
  const double* t = edge.tangent;
  const double excess = edge.along - edge.across, per_change = edge.inverse_duration;
  for (int end = 0; end < 2; ++end) {
    double v[3] = {}, forward = 0.0;
    for (int i = 0; i < d; ++i) v[i] = per_change * edge.change[end][i];
    for (int i = 0; i < d; ++i) forward += t[i] * v[i];
    double* gradient = out.gradient + end * d;
    for (int i = 0; i < d; ++i) gradient[i] = edge.across * v[i] + excess * forward * t[i];
    if (!with_hessian) continue;
    for (int i = 0; i < d; ++i)
      for (int j = 0; j < d; ++j) {
        const double same = i == j ? 1.0 : 0.0;
        const double own = per_change * (edge.across * same + excess * t[i] * t[j]);
        // The tangent turns with the edge: d t = (1 - t t) d e / |e|.
        const double turned =
            excess * edge.inverse_length * (forward * (same - t[i] * t[j]) + t[i] * (v[j] - forward * t[j]));
        out.hessian[end * d + i][j] = (end == 0 ? own : 0.0) - turned;
        out.hessian[end * d + i][d + j] = (end == 1 ? own : 0.0) + turned;
      }
  }
  out.energy = 0.0;
}

}  // namespace withe
