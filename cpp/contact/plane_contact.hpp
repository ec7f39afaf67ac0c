#pragma once
/// A planar rod's curve beside a plane, in closed form.
///
/// With n the plane's normal, t that turned by -90 degrees, and h_i = n . (x_i - p) the heights of a piece's nodes, all
/// is a function of few scalars. Heights alone say how near the piece is (curve.hpp): g0, g1, g2 are sums of them,
/// D(h), and where it touches, s(h). The slip of a step that began at x0 is
///   S = sum_i w_i(s) t . (x_i - x0_i) + r sum_b m_b(s) phi_b - drift,   phi_b = (e0_b x e_b) / |e_b|^2,
/// with e_b the edges and m_b their shares in the piece's rotation. These are the general formulas (friction.hpp,
/// friction_curve.hpp, pressing.cpp) for a normal that does not turn.

#include "contact/contact_friction.hpp"

namespace withe {

/// True if a contact is one: of a planar rod with a plane that does not turn, without friction of its own along the
/// rod.
bool beside_plane(const ContactProblem& problem, const Touching& t);

enum class PlaneForces { pressing, friction, both };

/// Minus the forces of such a contact, and their derivative when asked for.
void plane_contact(const ContactProblem& problem, const Touching& t, PlaneForces which,
                   const ContactLinearisation& linearisation, bool with_hessian, PlaneLocal& out);
/// Adds them to what is by all unknowns of a contact.
void add_plane_contact(const ContactProblem& problem, const Touching& t, PlaneForces which,
                       const ContactLinearisation& linearisation, bool with_hessian, ContactLocal& out);
/// Its friction on the slip. `rate`: K / (2 dt) [1/m].
FrictionForce<double> plane_friction(const ContactProblem& problem, const Touching& t, double rate);
/// `slipping` of such a contact.
Slipping plane_slipping(const ContactProblem& problem, const Touching& t, double rate, const VectorX& change);

}  // namespace withe
