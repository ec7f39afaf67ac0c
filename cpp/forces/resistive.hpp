#pragma once
/// Resistive-force theory: each piece of a slender rod is slowed down as if it were alone, by
///   f = -mu [c_t t (t . v) + c_n (v - t (t . v))]
/// per length [N/m], mu the viscosity of the fluid, t the tangent, v the velocity. Currents that other pieces make are
/// left out, so rods do not feel each other. Spin about the tangent meets no resistance.

#include "elasticity/elements.hpp"

namespace withe {

/// Resistance per length and viscosity [-].
struct ResistiveCoefficients {
  double along = 0, across = 0;
};

/// Resistance coefficients of waves of length L (along the rod): c_t = 2 pi / ln(0.18 L / a), c_n = 4 pi / (ln(0.18 L /
/// a) + 1/2) [Lighthill 1976, SIAM Review 18, section 5]. Without waves (L = 0), the coefficients are those of a
/// straight rod of length l, taken as the spheroid with its length and radius. They are c_t = 2 pi / (ln(l / a) - 1/2)
/// and c_n = 4 pi / (ln(l / a) + 1/2) [Happel and Brenner 1965, section 5-11]. Throws std::invalid_argument if the rod
/// is too thick for these formulas.
ResistiveCoefficients resistive_coefficients(double radius, double length, double wavelength);

/// Minus the force on an edge's nodes, half of it on each, over a step in which they move by `change` within
/// `duration`. The derivative by their positions at the end is exact. It is not symmetric, because the force depends on
/// the tangent at the end.
struct ResistiveEdge {
  int dimension;            ///< 3, or 2 in a plane
  double along, across;     ///< resistance of half the edge [N s / m]
  double tangent[3];        ///< at the end of the step
  double inverse_length;    ///< at the end of the step [1 / m]
  double change[2][3];      ///< displacements of tail and head [m]
  double inverse_duration;  ///< [1 / s]
};
void resistive_local(const ResistiveEdge& edge, bool with_hessian, Local& out);

}  // namespace withe
