#pragma once
/// Strains of bending and twisting of a stencil.
///
/// Strains are f(|kappa|^2) (kappa1, kappa2, tau) with |kappa| = 2 tan(phi / 2) for a turn by phi, and
///   f(x) = (1 + a x) / (1 + b x).
/// With a = b = 0 the strains are those of [Bergou et al. 2010, section 3]. A turn by phi then bends as 2 tan(phi / 2),
/// too stiff by phi^2 / 2. It twists with the moment along t0 + t1 over 1 + t0 . t1, too stiff by phi^2 / 4. With
/// a = 1/15, b = 3/20, f is the Pade approximant of (phi / 2) / tan(phi / 2). The strains are then the rotation vector
/// from one frame to the other, exactly in bending (to phi^6), and to first order in tau. The factor tends to 4/9 as a
/// stencil folds over, so the energy still grows without bound. The energy of the angle itself would let the stencil
/// fold.

namespace withe {

struct BendMeasure {
  double a = 1.0 / 15.0, b = 3.0 / 20.0;
};

/// f and its first two derivatives with respect to x.
template <class Scalar>
struct BendFactor {
  Scalar value, first, second;
};

template <class Scalar>
BendFactor<Scalar> bend_factor(const BendMeasure& m, const Scalar& x) {
  const Scalar inverse = 1.0 / (1.0 + m.b * x);
  const Scalar first = (m.a - m.b) * (inverse * inverse);
  return {(1.0 + m.a * x) * inverse, first, (-2.0 * m.b) * (first * inverse)};
}

/// Strains of a row (kappa1, kappa2, tau); in a plane the last two are zero.
template <class Row>
auto measured(const BendMeasure& m, const Row& row) {
  return (bend_factor(m, row(0) * row(0) + row(1) * row(1)).value * row).eval();
}

}  // namespace withe
