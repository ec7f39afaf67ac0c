#pragma once
/// A planar rod's curve beside a plane, in closed form.
///
/// With h_i = n . (x_i - p) the heights of a piece's nodes above the plane and y_i = t . x_i their places along it, t
/// the normal turned by -90 degrees, everything is a function of scalars. Heights alone say how near the piece is
/// (curve.hpp): g0, g1, g2 are sums of them, D(h), and where it touches, s(h). The slip of a step that began at h0, y0
/// is
///   S = sum_i w_i(s) (y_i - y0_i) + r sum_b m_b(s) phi_b - drift,   phi_b = (a_b b0_b - b_b a0_b) / |e_b|^2,
/// with a, b the parts of an edge across and along the plane, m_b its share in the piece's rotation. These are the
/// general formulas (friction.hpp, friction_curve.hpp, pressing.cpp) for a normal that does not turn.

#include "contact/contact_friction.hpp"

namespace withe {

/// Whether a contact is one: of a planar rod with a plane that does not turn, without friction of its own along the
/// rod.
bool beside_plane(const ContactProblem& problem, const Touching& t);

enum class PlaneForces { pressing, friction, both };

/// Adds minus the forces of such a contact, and their derivative when asked for.
void add_plane_contact(const ContactProblem& problem, const Touching& t, PlaneForces which,
                       const ContactLinearisation& linearisation, bool with_hessian, ContactLocal& out);
/// Its friction on the slip. `rate`: K / (2 dt) [1/m].
FrictionForce<double> plane_friction(const ContactProblem& problem, const Touching& t, double rate);
/// `slipping` of such a contact.
Slipping plane_slipping(const ContactProblem& problem, const Touching& t, double rate, const VectorX& change);

}  // namespace withe
