#pragma once
/// Bending in a plane. The energy depends on the turn phi between two directions only:
///   E = K (beta - n)^2 / 2,  beta = f(kappa^2) kappa,  kappa = 2 tan(phi / 2), positive from the first axis to the
/// second. [Choi, dissertation 3.3, 3.5 without the third coordinate; f: geometry/bend_measure.hpp].

#include "geometry/bend_measure.hpp"
#include "geometry/vec2.hpp"

namespace withe {

template <class Scalar>
struct PlanarBend {
  Scalar energy;
  Scalar slope;      ///< dE / dphi [N m]
  Scalar curvature;  ///< d2E / dphi2 [N m]
};

/// beta and its derivatives with respect to phi.
template <class Scalar>
struct PlanarStrain {
  Scalar value, first, second;
};

/// kappa' = 1 + kappa^2 / 4, kappa'' = kappa kappa' / 2.
template <class Scalar>
PlanarStrain<Scalar> planar_strain(const BendMeasure& measure, const Scalar& kappa) {
  const Scalar x = kappa * kappa;
  const BendFactor<Scalar> f = bend_factor(measure, x);
  const Scalar by_kappa = f.value + 2.0 * (x * f.first);
  const Scalar turn = 1.0 + 0.25 * x;
  const Scalar first = by_kappa * turn;
  const Scalar second = kappa * turn * ((6.0 * f.first + 4.0 * (x * f.second)) * turn + 0.5 * by_kappa);
  return {f.value * kappa, first, second};
}

template <class Scalar>
PlanarBend<Scalar> planar_bend(const BendMeasure& measure, const Scalar& kappa, const Scalar& natural,
                               const Scalar& stiffness) {
  const PlanarStrain<Scalar> beta = planar_strain(measure, kappa);
  const Scalar strain = beta.value - natural;
  const Scalar moment = stiffness * strain;
  return {0.5 * moment * strain, moment * beta.first, stiffness * beta.first * beta.first + moment * beta.second};
}

/// Direction of an edge, or of the part to which it is attached, and one over its length.
template <class Scalar>
struct PlanarEdge {
  Vec2<Scalar> tangent;
  Scalar inverse_length;
};

/// Forces of two edges that follow one another, and how they change, with respect to their vectors.
template <class Scalar>
struct PlanarForces {
  Vec2<Scalar> force[2];  ///< [N]
  Mat2<Scalar> by[2][2];  ///< derivative of the first by the second [N / m]; if requested
};

/// Derivatives of the bending `p` between two edges. The bend phi is the angle of the second edge minus that of the
/// first edge. The angle of an edge has the gradient n = (-ty, tx) / l and the Hessian -(t n^T + n t^T) / l.
template <bool with_matrix, class Scalar>
void planar_bend_forces(const PlanarBend<Scalar>& p, const PlanarEdge<Scalar> (&edge)[2], PlanarForces<Scalar>& out) {
  const Vec2<Scalar> by_edge[2] = {-edge[0].inverse_length * turned(edge[0].tangent),
                                   edge[1].inverse_length * turned(edge[1].tangent)};
  for (int i = 0; i < 2; ++i) out.force[i] = p.slope * by_edge[i];
  if constexpr (with_matrix)
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < 2; ++j) {
        out.by[i][j] = Mat2<Scalar>{};
        add_outer(out.by[i][j], p.curvature, by_edge[i], by_edge[j]);
      }
      add_symmetric_outer(out.by[i][i], -edge[i].inverse_length, edge[i].tangent, out.force[i]);
    }
}

/// Converts the matrix of two edges into the matrix of their three nodes.
template <class Scalar, class Matrix>
void put_planar_matrix(const PlanarForces<Scalar>& f, Matrix& out) {
  for (int k = 0; k < 2; ++k)
    for (int l = 0; l < 2; ++l) {
      const Scalar b00 = f.by[0][0].row[k][l], b01 = f.by[0][1].row[k][l];
      const Scalar b10 = f.by[1][0].row[k][l], b11 = f.by[1][1].row[k][l];
      out[k][l] = b00;
      out[k][2 + l] = b01 - b00;
      out[k][4 + l] = -b01;
      out[2 + k][l] = b10 - b00;
      out[2 + k][2 + l] = (b00 - b01) + (b11 - b10);
      out[2 + k][4 + l] = b01 - b11;
      out[4 + k][l] = -b10;
      out[4 + k][2 + l] = b10 - b11;
      out[4 + k][4 + l] = b11;
    }
}

}  // namespace withe
