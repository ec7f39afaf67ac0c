#pragma once
/// The generalised forces of surfaces that press against each other.

#include "contact/contact_problem.hpp"

namespace withe {

/// Directions at both ends of a step whose ways along it differ by less, over the way, are the same but for rounding.
inline constexpr double kSameDirection = 1e-12;

/// Adds minus the forces of a contact, and their derivative when asked for: that with how pressing turns, or, without
/// `geometric`, the part that resists where surfaces near.
void add_pressing(const ContactProblem& problem, const Touching& t, bool with_hessian, bool geometric,
                  ContactLocal& out);

/// Derivative of a contact's distance by its unknowns but angles, at the end of the step.
void distance_slope(const Touching& t, double (&out)[12]);

}  // namespace withe
