#pragma once
/// Impacts: approach speed of surfaces, time during which they count as having just met, and the elastic share.

#include <algorithm>

#include "contact/contact_problem.hpp"

namespace withe {

/// Surfaces that meet more slowly rest on each other: as fast as a fall from the depth of contact ends, or as slip that
/// counts as none [m/s].
double rest_speed(const ContactProblem& problem, const ContactPair& pair);
/// Approach speed below which surfaces come to rest on each other, if they do not fall on [m/s].
double least_approach(const ContactProblem& problem, const ContactPair& pair);
/// Distance of centrelines as the step begins [m].
double start_distance(const ContactProblem& problem, const ContactPair& pair);
/// Rate at which surfaces near each other as the step begins; below zero where they part [m/s].
double nearing(const ContactProblem& problem, const ContactPair& pair);
inline double approach_speed(const ContactProblem& problem, const ContactPair& pair) {
  return std::max(0.0, nearing(problem, pair));
}
/// True if an impact is still on its way in at the end of a step. The impact has not pressed the surfaces together yet,
/// nor turned them round within the tolerance, where light bodies rest.
bool comes_near(const ContactProblem& problem, const Touching& t);
/// True if surfaces meet in this step.
bool meets(const ContactProblem& problem, const ContactPair& pair);
/// Approach speed of an impact that the step begins; 0: none.
double first_approach(const ContactProblem& problem, const ContactPair& pair);
/// Half a period of an edge on its contact: as long as an impact lasts at least [s].
double swing_time(const ContactProblem& problem, const Touching& t);
/// True if an elastic impact still affects surfaces.
bool impact_lasts(const ContactProblem& problem, const Touching& t);
/// Derivatives of how much presses elastically in a step, `PressingLaw::elastic`.
struct ElasticShareSlopes {
  double approach = 0;        ///< by the approach speed as the step begins [s/m]
  double way = 0;             ///< by the decrease of the distance in the step [1/m]
  double slip_tolerance = 0;  ///< [s/m]
  double gravity = 0;         ///< by the magnitude of gravity [s^2/m]
  double mass = 0;            ///< by the mass at the contact [1/kg]
};
ElasticShareSlopes elastic_share_slopes(const ContactProblem& problem, const Touching& t);
/// Adds `by` times the derivatives of the speed of approach that a contact has from the start of the step, by its
/// unknowns there and by their rates.
void add_approach_slopes(const ContactProblem& problem, const Touching& touching, double by,
                         double (&start)[kContactUnknowns], double (&velocity)[kContactUnknowns]);
/// True if a step of dt would be too long to resolve where meeting surfaces push each other.
bool unresolved(const ContactProblem& problem, const Touching& t, double dt);
/// Sets the law by which surfaces press in a step, and the force at its end, of a contact with its stiffness and speed
/// of approach.
void set_pressing(const ContactProblem& problem, Touching& t);

}  // namespace withe
