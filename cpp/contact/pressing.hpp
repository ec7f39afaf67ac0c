#pragma once
/// The generalised forces of surfaces that press against each other.

#include <algorithm>
#include <cmath>

#include "contact/contact_problem.hpp"

namespace withe {

/// The share b of the gradient g0 of a distance D at the start of a step in a mean of it and of g1 at the end,
///   m = (1 - b) g1 + b g0,   b = (D1 - D0 - p1) / (p0 - p1),   p = g . (x1 - x0),
/// so that m . (x1 - x0) = D1 - D0 where b is between 0 and 1.
struct StartShare {
  double value;
  double apart;  ///< p0 - p1
  bool fixed;    ///< whatever the unknowns do
};

/// `way`: x1 - x0; `nearer`: D1 - D0.
template <int N>
StartShare start_share(const double (&first)[N], const double (&last)[N], const double (&way)[N], double nearer) {
  constexpr double kSameDirection = 1e-12;  // gradients that differ by no more differ by rounding: any share will do
  double p0 = 0.0, p1 = 0.0, size = 0.0;
  for (int i = 0; i < N; ++i) {
    p0 += first[i] * way[i];
    p1 += last[i] * way[i];
    size += std::abs(way[i]);
  }
  const bool same = std::abs(p0 - p1) <= kSameDirection * size;
  const double share = same ? 0.5 : (nearer - p1) / (p0 - p1), value = std::clamp(share, 0.0, 1.0);
  return {value, p0 - p1, same || share != value};
}

/// From g1 to m, and from the derivative of g1 to that of m; `derivative` is nothing where none is asked for.
template <int N>
void add_start_direction(const double (&first)[N], const double (&way)[N], double nearer, bool geometric,
                         double (&along)[N], double (*derivative)[N]) {
  const StartShare share = start_share(first, along, way, nearer);
  const double b = share.value;
  double turned[N];
  for (int i = 0; i < N; ++i) turned[i] = first[i] - along[i];
  for (int j = 0; j < N && derivative; ++j) {
    double bent = 0.0;
    for (int i = 0; i < N; ++i) bent += way[i] * derivative[i][j];
    const double change = share.fixed || !geometric ? 0.0 : -(bent + b * (turned[j] - bent)) / share.apart;
    for (int i = 0; i < N; ++i) derivative[i][j] = (1.0 - b) * derivative[i][j] + turned[i] * change;
  }
  for (int i = 0; i < N; ++i) along[i] += b * turned[i];
}

/// Adds minus the forces of a contact, and their derivative when asked for: that with how pressing turns, or, without
/// `geometric`, the part that resists where surfaces near.
void add_pressing(const ContactProblem& problem, const Touching& t, bool with_hessian, bool geometric,
                  ContactLocal& out);

/// Derivative of a contact's distance by its unknowns but angles, at the end of the step.
void distance_slope(const Touching& t, double (&out)[12]);

}  // namespace withe
