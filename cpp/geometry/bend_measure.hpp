#pragma once
/// Strains of bending and twisting of a stencil.
///
/// Strains are f(|kappa|^2) (kappa1, kappa2, tau) with |kappa| = 2 tan(phi / 2) for a turn by phi, and
///   f(x) = (1 + a x) / (1 + b x).
/// a = b = 0 are the strains of [Bergou et al. 2010, section 3]: a turn by phi bends as 2 tan(phi / 2), stiffer by
/// phi^2 / 2, and twists with the moment along t0 + t1 over 1 + t0 . t1, stiffer by phi^2 / 4. With a = 1/15, b = 3/20,
/// f is the Pade approximant of (phi / 2) / tan(phi / 2), with which the strains are the rotation vector from one frame
/// to the other: exactly in bending (to phi^6), to first order in tau. It tends to 4/9 as a stencil folds over, so that
/// the energy still grows without end, where the angle itself would let it fold.

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
