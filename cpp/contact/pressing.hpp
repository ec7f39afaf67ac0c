#pragma once
/// The generalised forces of surfaces that press against each other.

#include <algorithm>
#include <cmath>

#include "contact/contact_problem.hpp"

namespace withe {

/// Share b of the gradient g0 at the start of a step in the mean gradient m of a distance D. The mean, with the
/// gradient g1 at the end, and the share are:
///
///   m = (1 - b) g1 + b g0,   b = 1/2 + e d / (d^2 + a^2),   e = D1 - D0 - (p0 + p1) / 2,   d = p0 - p1.
///
/// Here p = g . (x1 - x0), and b is limited to 0 to 1. Up to the effect of a, m . (x1 - x0) = D1 - D0 holds. If d
/// vanishes, any share satisfies this equation. The small number a is a fraction of the contributions of nodes to p0.
/// Without it, b would jump from one end to the other, and so would the forces, at contacts that are about to lift off.
struct StartShare {
  double value;
  double by_excess, by_apart;  ///< its derivatives by e and d; 0 if the share is 0 or 1
  double by_part[3];           ///< derivatives by the contribution of each node to p0, through a
};

/// `way`: x1 - x0, of three nodes; `nearer`: D1 - D0.
template <int N>
StartShare start_share(const double (&first)[N], const double (&last)[N], const double (&way)[N], double nearer) {
  constexpr double kSmoothing = 1e-4;  // a, relative to the contributions of nodes to p0
  constexpr int kAxes = N / 3;
  double part[3] = {}, p1 = 0.0;
  for (int i = 0; i < N; ++i) {
    part[i / kAxes] += first[i] * way[i];
    p1 += last[i] * way[i];
  }
  const double p0 = part[0] + part[1] + part[2], excess = nearer - 0.5 * (p0 + p1), apart = p0 - p1;
  const double least = part[0] * part[0] + part[1] * part[1] + part[2] * part[2],
               square = apart * apart + kSmoothing * kSmoothing * least;
  if (square == 0.0) return {0.5, 0.0, 0.0, {}};
  const double share = 0.5 + excess * apart / square, value = std::clamp(share, 0.0, 1.0);
  if (value != share) return {value, 0.0, 0.0, {}};
  const double by_square = -excess * apart / (square * square);
  StartShare out{value, apart / square, excess / square + 2.0 * apart * by_square, {}};
  for (int n = 0; n < 3; ++n) out.by_part[n] = 2.0 * kSmoothing * kSmoothing * by_square * part[n];
  return out;
}

/// Converts g1 into m, and the derivative of g1 into that of m. `derivative`: null if none is needed.
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
    const double change = !geometric ? 0.0
                                     : -0.5 * share.by_excess * (turned[j] + bent) +
                                           share.by_apart * (turned[j] - bent) + share.by_part[j / (N / 3)] * first[j];
    for (int i = 0; i < N; ++i) derivative[i][j] = (1.0 - b) * derivative[i][j] + turned[i] * change;
  }
  for (int i = 0; i < N; ++i) along[i] += b * turned[i];
}

/// Adds minus the forces of a contact and, if requested, their derivative. Without `geometric` the derivative omits the
/// rotation of the direction of pressing, and has only the part that resists the approach of surfaces.
void add_pressing(const ContactProblem& problem, const Touching& t, bool with_hessian, bool geometric,
                  ContactLocal& out);

/// Directions in which a point and a face press on each other, over the end points: the gradient of their distance.
struct FacePressing {
  double end[12], along[12];  ///< at the end of the step; and by which they press, there or in the mean of the step
  double over = 0;            ///< see FaceVectors
  double share = 1;           ///< of the derivative of `along` in that of `end`

  FacePressing(const ContactProblem& problem, const Touching& t);
};

/// Derivative of a contact's distance by its unknowns but angles, at the end of the step.
void distance_slope(const Touching& t, double (&out)[12]);

}  // namespace withe
