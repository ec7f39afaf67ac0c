#pragma once
/// Friction with J and N of the start of a step, lagged or semi-explicit.

#include "contact/contact_friction.hpp"

namespace withe {

struct LaggedForce {
  Vec3d force{};       ///< force against the slip: minus friction on a [N]
  double slope[3][3];  ///< derivative by the slip [N/m]
  bool sticking = false;
};
/// `rate`: K / (2 dt) [1/m].
LaggedForce lagged_force(const ContactProblem& problem, const Touching& t, double rate, const Vec3d* predicted);
void add_lagged_friction(const ContactProblem& problem, const Touching& t, double rate, const Vec3d* predicted,
                         bool with_hessian, ContactLocal& out);
Slipping lagged_slipping(const ContactProblem& problem, const Touching& t, double rate, const VectorX& change);

}  // namespace withe
