#pragma once
/// The generalised forces of surfaces that press against each other.

#include "contact/contact_problem.hpp"

namespace withe {

/// Adds minus the forces of a contact, and their derivative when asked for: that with how pressing turns, or, without
/// `geometric`, the part that resists where surfaces near.
void add_pressing(const ContactProblem& problem, const Touching& t, bool with_hessian, bool geometric,
                  ContactLocal& out);

}  // namespace withe
