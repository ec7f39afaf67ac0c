#pragma once
/// Jacobian of the generalised forces of friction on a smooth curve, as friction_jacobian.hpp derives that of edges.
///
/// Let s be the place of contact, n the normal there, w_i and m_b the weights of nodes and edges at s, and r the
/// radius. The derivatives are:
///
///   ds of curve.hpp,   dn = H (sum_i w_i dx_i + c' ds),   dN = N' dD,
///
///   omega = r sum_b m_b phi_b,   T = sum_i w_i (x_i - x_i^0) - omega x n less an obstacle's motion,
///
///   dT = sum_i w_i dx_i + (sum_i w_i' (x_i - x_i^0)) ds + n x domega - omega x dn.
///
/// F follows from T as in friction_jacobian.hpp. Nodes receive w_i F, and edges the couples of r m_b (F x n).

#include "contact/friction.hpp"

namespace withe {

void add_curve_friction_jacobian(const FrictionSetting& f, const SlippingSurfaces<double>& c,
                                 double (&jacobian)[kContactUnknowns][kContactUnknowns]);

}  // namespace withe
