#pragma once
/// Contact energies E(D) of two surfaces whose centrelines are D apart, for unit stiffness.
///
/// C is the sum of the radii, delta the distance tolerance. E is zero from C + delta on.
///   imcv2:   (C - D)^2 up to C - delta, then softplus(C - D)^2, softplus(x) = log(1 + e^(K x)) / K, K = 15 / delta
///            [Choi, dissertation, (5.2), with the range of its first line ending at C - delta]
///   barrier: -(D - C - delta)^2 ln((D - C) / delta), infinite at D = C [Li et al. 2020; Choi, dissertation, (5.1),
///            whose barrier as printed stands at D = 0]
///   imcv1:   (h / K) log(1 + e^(K (C - D))), h = C / 2, whose force is at most k h; minus its tangent at C + delta, so
///            that it begins there without a step [Choi, dissertation, (4.16), h^2 E with K1 = K h: its K1 = 50 is
///            delta = 0.3 h]
///   spillmann_teschner: (C - D)^2 where D < C, without tolerance. The force is so stiff that it removes an overlap
///            within one step [Spillmann and Teschner 2008; Choi, dissertation, 4.7, there explicit]
/// E has the unit m^2, so its stiffness is in N/m.

#include <cmath>

#include "model/description.hpp"

namespace withe {

/// K delta, at which softplus(-delta) is e^-15 / K: the laws end there [Choi, dissertation, (5.2)].
inline constexpr double kSteepness = 15.0;

/// E and its first two derivatives by D.
struct ContactEnergy {
  double value = 0, first = 0, second = 0;
};

inline ContactEnergy imcv2_energy(double distance, double radii, double tolerance) {
  const double x = radii - distance;
  if (x <= -tolerance) return {};
  if (x >= tolerance) return {x * x, -2.0 * x, 2.0};
  const double steepness = kSteepness / tolerance;
  // log(1 + e^y) without overflow or loss.
  const double y = steepness * x, decay = std::exp(-std::abs(y));
  const double softplus = (std::max(y, 0.0) + std::log1p(decay)) / steepness;
  const double logistic = y >= 0.0 ? 1.0 / (1.0 + decay) : decay / (1.0 + decay);
  return {softplus * softplus, -2.0 * softplus * logistic,
          2.0 * (logistic * logistic + softplus * steepness * logistic * (1.0 - logistic))};
}

inline ContactEnergy barrier_energy(double distance, double radii, double tolerance) {
  const double gap = distance - radii, x = gap - tolerance;
  if (x >= 0.0) return {};
  if (gap <= 0.0) return {INFINITY, -INFINITY, INFINITY};
  const double log = std::log(gap / tolerance);
  return {-x * x * log, -2.0 * x * log - x * x / gap, -2.0 * log - 4.0 * x / gap + x * x / (gap * gap)};
}

inline ContactEnergy imcv1_energy(double distance, double radii, double tolerance) {
  const double x = radii - distance;
  if (x <= -tolerance) return {};
  const double size = 0.5 * radii, steepness = kSteepness / tolerance;
  const double y = steepness * x, decay = std::exp(-std::abs(y)), end = std::exp(-kSteepness);
  const double softplus = std::max(y, 0.0) + std::log1p(decay);
  const double logistic = y >= 0.0 ? 1.0 / (1.0 + decay) : decay / (1.0 + decay);
  const double least = end / (1.0 + end);  // the logistic at the end
  return {size * ((softplus - std::log1p(end)) / steepness - least * (x + tolerance)), size * (least - logistic),
          size * steepness * logistic * (1.0 - logistic)};
}

inline ContactEnergy spillmann_teschner_energy(double distance, double radii) {
  const double x = radii - distance;
  if (x <= 0.0) return {};
  return {x * x, -2.0 * x, 2.0};
}

inline ContactEnergy contact_energy(ContactLaw law, double distance, double radii, double tolerance) {
  switch (law) {
    case ContactLaw::barrier:
      return barrier_energy(distance, radii, tolerance);
    case ContactLaw::imcv1:
      return imcv1_energy(distance, radii, tolerance);
    case ContactLaw::spillmann_teschner:
      return spillmann_teschner_energy(distance, radii);
    case ContactLaw::imcv2:
      break;
  }
  return imcv2_energy(distance, radii, tolerance);
}

}  // namespace withe
