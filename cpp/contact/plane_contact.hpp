#pragma once
/// A planar rod's curve beside a plane, in closed form.
///
/// Let n be the normal of the plane, t the normal turned by -90 degrees, and h_i = n . (x_i - p) the heights of the
/// nodes of a piece. Heights alone determine the distance D(h) of the piece and the place s(h) where it touches, since
/// g0, g1, g2 are sums of them (curve.hpp). The slip of a step that began at x0 is
///   S = sum_i w_i(s) t . (x_i - x0_i) + r sum_b m_b(s) phi_b - drift,   phi_b = (e0_b x e_b) / |e_b|^2,
/// where e_b are the edges and m_b their shares in the rotation of the piece. These are the general formulas
/// (friction.hpp, friction_curve.hpp, pressing.cpp) for a normal that does not turn.

#include "contact/contact_friction.hpp"

namespace withe {

/// True if this form applies: contact of a planar rod with a plane that does not turn, without a different friction
/// along the rod.
bool beside_plane(const ContactProblem& problem, const Touching& t);

enum class PlaneForces { pressing, friction, both };

/// Minus the forces of such a contact and, if requested, their derivative.
void plane_contact(const ContactProblem& problem, const Touching& t, PlaneForces which,
                   const ContactLinearisation& linearisation, bool with_hessian, PlaneLocal& out);
/// Adds them to the forces and derivatives by all unknowns of a contact.
void add_plane_contact(const ContactProblem& problem, const Touching& t, PlaneForces which,
                       const ContactLinearisation& linearisation, bool with_hessian, ContactLocal& out);
/// Its friction on the slip. `rate`: K / (2 dt) [1/m].
FrictionForce<double> plane_friction(const ContactProblem& problem, const Touching& t, double rate);
/// `slipping` of such a contact.
Slipping plane_slipping(const ContactProblem& problem, const Touching& t, double rate, const VectorX& change);

}  // namespace withe
