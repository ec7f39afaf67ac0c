#pragma once
/// Exact Jacobian of the generalised forces of friction, J^T F.
///
/// Everything depends on the unknowns through how the point of a moves over that of b while s and t stay,
/// dp = sum_i w_i dx_i, through the edges u and v with tangents t, and through their angles. With D between the
/// centrelines, n = D / |D|, and K of `parameter_inverse`:
///   ds = a . dp - K_ss D . du + K_st D . dv,    a = K_st v - K_ss u,
///   dt = b . dp - K_st D . du + K_tt D . dv,    b = K_tt v - K_st u,
///   dD = dp + u (a . dp) - v (b . dp) + a (D . du) - b (D . dv),
///   dN = N' (D / distance) . dp,
///   dphi_a = (e^0 x du - 2 (t . du) e^0 x t) / |u|^2 + (theta - theta^0) (1 - t t^T) du / |u| + t dtheta,
/// where in energy-momentum steps the angle is `working_turn`.
/// Arms are -rho_a c and rho_b c, c = D or, on an obstacle, n. So with omega = rho_a phi_a + rho_b phi_b the slip is
/// S = (1 - n n^T) T, T = sum_i w_i (x_i - x_i^0) - omega x c less an obstacle's way, and
///   dT = dp + (u - u^0) ds - (v - v^0) dt + c x domega - omega x dc,
///   F = g(|S|^2, N) S,    dF = E (dT - (n . T) dD / |D|) - g n (S . dD) / |D| + S g_N dN,
///   E = g (1 - n n^T) + 2 g' S S^T,    where an anchor's T and S have its stick in them.
/// These go back as w_i F to the ends, and as couples of m = F x c to the edges and their angles:
///   rho (m x t / |e| + (t . m) spin),  rho t . m.

#include "contact/friction.hpp"

namespace withe {

/// Adds the derivative of `add_friction_gradient` by the unknowns; those of an obstacle are left out.
void add_friction_jacobian(const FrictionSetting& f, const SlippingSurfaces<double>& c,
                           double (&jacobian)[kContactUnknowns][kContactUnknowns]);

}  // namespace withe
