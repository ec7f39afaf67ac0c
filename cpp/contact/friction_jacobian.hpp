#pragma once
/// Exact Jacobian of the generalised forces of friction, J^T F.
///
/// The forces depend on the unknowns in three ways. At fixed s and t, the point of a moves relative to the point of b
/// by dp = sum_i w_i dx_i. The edges u and v with tangents t change, and so do their angles. Let D be the vector
/// between the centrelines, n = D / |D|, and K the matrix of `parameter_inverse`. The derivatives are:
///
///   ds = a . dp - K_ss D . du + K_st D . dv,    a = K_st v - K_ss u,
///   dt = b . dp - K_st D . du + K_tt D . dv,    b = K_tt v - K_st u,
///   dD = dp + u (a . dp) - v (b . dp) + a (D . du) - b (D . dv),
///   dN = N' (D / distance) . dp,
///
///   dphi_a = (e^0 x du - 2 (t . du) e^0 x t) / |u|^2 + (theta - theta^0) (1 - t t^T) du / |u| + t dtheta,
///
/// where energy-momentum steps use `working_turn` as the angle. The arms are -rho_a c and rho_b c, where c = D or, on
/// an obstacle, c = n. With omega = rho_a phi_a + rho_b phi_b, the slip S and the force F are:
///
///   S = (1 - n n^T) T,    T = sum_i w_i (x_i - x_i^0) - omega x c less an obstacle's motion,
///
///   dT = dp + (u - u^0) ds - (v - v^0) dt + c x domega - omega x dc,
///
///   F = g(|S|^2, N) S,    dF = E (dT - (n . T) dD / |D|) - g n (S . dD) / |D| + S g_N dN,
///
///   E = g (1 - n n^T) + 2 g' S S^T,
///
/// where T and S of an anchor include its stick. The force acts as w_i F on the ends, and as couples of m = F x c on
/// the edges and their angles:
///   rho (m x t / |e| + (t . m) spin),  rho t . m.

#include "contact/friction.hpp"

namespace withe {

/// Adds the derivative of `add_friction_gradient` by the unknowns, except those of an obstacle.
void add_friction_jacobian(const FrictionSetting& f, const SlippingSurfaces<double>& c,
                           double (&jacobian)[kContactUnknowns][kContactUnknowns]);

/// The same of a point on a face, by dual numbers.
void add_face_friction_jacobian(const FrictionSetting& f, const double (&unknown)[kContactUnknowns],
                                double (&jacobian)[kContactUnknowns][kContactUnknowns]);

}  // namespace withe
