#pragma once
/// The force of a step on two surfaces that press against each other, from the energy k E(D) that their contact stores.
///
/// With D0 and D1 the distances at the start and the end of a step, `first` replaces k E'(D1) by
///   a Q + (1 - a) k E'(D1),   Q = k (E(D1) - E(D0)) / (D1 - D0).
/// The elastic share a is 1 for surfaces that have just met, and 0 for surfaces that rest on each other. The work of Q
/// over the step equals the change of the stored energy. An impact therefore returns its energy, even if it is shorter
/// than a step [Gonzalez 1996; Laursen and Chawla 1997]. E'(D1) does more work, as E is convex, and lets surfaces rest.
/// Impacts with a coefficient of restitution below 1 have an elastic share of 0, see rebound.hpp.

#include <algorithm>
#include <cmath>

#include "contact/contact_law.hpp"

namespace withe {

/// Minus the force [N], and its derivatives by the distance at the end and at the start [N/m].
struct PressingForce {
  double first = 0, by_end = 0, by_start = 0;
};

struct PressingLaw {
  ContactLaw law = ContactLaw::imcv2;
  double radii = 0, tolerance = 0;  ///< [m]
  double stiffness = 0;             ///< [N/m]
  double yielded = 0;               ///< [m]
  double elastic = 0;               ///< a [-]
  double elastic_by_way = 0;        ///< derivative of a by D0 - D1 [1/m]

  /// E at a distance, for unit stiffness.
  ContactEnergy energy(double distance) const { return contact_energy(law, distance + yielded, radii, tolerance); }

  PressingForce at(double start, double end) const {
    const ContactEnergy e = energy(end);
    PressingForce f{e.first, e.second, 0.0};
    if (elastic > 0.0) {
      const PressingForce mean = quotient(start, end, e);
      const double rest = 1.0 - elastic, by_way = elastic_by_way * (mean.first - f.first);
      f = {rest * f.first + elastic * mean.first, rest * f.by_end + elastic * mean.by_end - by_way,
           elastic * mean.by_start + by_way};
    }
    return {stiffness * f.first, stiffness * f.by_end, stiffness * f.by_start};
  }

 private:
  /// Q and its derivatives; by Gauss's rule of three points, exact to the sixth power, where the difference would
  /// round.
  PressingForce quotient(double start, double end, const ContactEnergy& last) const {
    const double way = end - start;
    if (std::abs(way) > 0.01 * tolerance) {
      const ContactEnergy first = energy(start);
      const double mean = (last.value - first.value) / way;
      return {mean, (last.first - mean) / way, (mean - first.first) / way};
    }
    constexpr double kPoints[3] = {0.11270166537925831, 0.5, 0.88729833462074169};
    constexpr double kWeights[3] = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
    PressingForce f;
    for (int k = 0; k < 3; ++k) {
      const ContactEnergy e = energy(start + kPoints[k] * way);
      f.first += kWeights[k] * e.first;
      f.by_end += kWeights[k] * kPoints[k] * e.second;
      f.by_start += kWeights[k] * (1.0 - kPoints[k]) * e.second;
    }
    return f;
  }
};

}  // namespace withe
