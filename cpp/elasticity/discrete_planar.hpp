#pragma once
/// discrete_gradient.hpp in a plane, where a moment has one component and directors do not turn.

#include "elasticity/bend_planar.hpp"

namespace withe {

/// Divided difference D E / D kappa of E = K (f kappa - n)^2 / 2 between two strains, and its derivative by kappa at
/// the end. It is the moment K (mean f kappa - n) times D (f kappa) / D kappa, computed without a quotient of
/// differences.
template <class Scalar>
struct DividedMoment {
  Scalar value, by_end;
};
template <class Scalar>
DividedMoment<Scalar> divided_moment(const BendMeasure& measure, const Scalar& start, const Scalar& end,
                                     const Scalar& natural, const Scalar& stiffness) {
  const Scalar x0 = start * start, x1 = end * end;
  const BendFactor<Scalar> f0 = bend_factor(measure, x0), f1 = bend_factor(measure, x1);
  // (f1 - f0) / (x1 - x0), and its derivative with respect to x1.
  const Scalar lower = 1.0 / (1.0 + measure.b * x1);
  const Scalar divided = ((measure.a - measure.b) / (1.0 + measure.b * x0)) * lower;
  const Scalar falling = -measure.b * (lower * divided);
  const Scalar u = 0.5 * (start + end);
  const Scalar moment = stiffness * (0.5 * (f0.value * start + f1.value * end) - natural);
  const Scalar slope = 0.5 * (f0.value + f1.value) + 2.0 * (divided * (u * u));
  const Scalar by_moment = (0.5 * stiffness) * (f1.value + 2.0 * (f1.first * x1));
  const Scalar by_slope = f1.first * end + 2.0 * (u * (divided + 2.0 * (falling * (end * u))));
  return {moment * slope, by_moment * slope + moment * by_slope};
}

/// Moment m about the normal of the plane with m (w_a - w_b) = E1 - E0, and its derivatives by the turns of both
/// directions at the end. It is `discrete_moment` for kappa = 2 (t_a x t_b) / (1 + t_a . t_b).
template <class Scalar>
struct PlanarMoment {
  Scalar moment, by_a, by_b;
};
template <class Scalar>
PlanarMoment<Scalar> planar_moment(const BendMeasure& measure, const Vec2<Scalar>& a0, const Vec2<Scalar>& a1,
                                   const Vec2<Scalar>& b0, const Vec2<Scalar>& b1, const Scalar& kappa0,
                                   const Scalar& kappa1, const Scalar& natural, const Scalar& stiffness) {
  const DividedMoment<Scalar> h = divided_moment(measure, kappa0, kappa1, natural, stiffness);
  const Vec2<Scalar> a = 0.5 * (a0 + a1), b = 0.5 * (b0 + b1);
  const Scalar inverse = 2.0 / (2.0 + dot(a0, b0) + dot(a1, b1)), kappa = 0.5 * (kappa0 + kappa1);
  const Scalar along = dot(a, b), across = cross(a, b);
  const Scalar slope = -inverse * (2.0 * along + kappa * across);
  // Derivatives of kappa and of 1 + t_a . t_b, by the turn of a minus the turn of b.
  const Scalar by_kappa = -(1.0 + 0.25 * (kappa1 * kappa1)), by_chi = cross(a1, b1);
  const Scalar strained =
      h.by_end * slope * by_kappa - h.value * inverse * (0.5 * (by_kappa * across + by_chi * slope));
  // A turn of a moves the mean of its directions by half of that times a1, turned by a right angle.
  const Scalar by_along = inverse * h.value, by_across = 0.5 * (by_along * kappa);
  return {h.value * slope, strained - by_along * cross(a1, b) + by_across * dot(a1, b),
          by_along * cross(a, b1) - strained - by_across * dot(a, b1)};
}

/// `MovingEdge` in a plane.
template <class Scalar>
struct PlanarMovingEdge {
  Vec2<Scalar> t0, t1, t;
  Scalar inverse_length1, inverse_length;
  Scalar inverse_mean;  ///< 2 / (l0 + l1)
  Scalar chi, stretch;
  Vec2<Scalar> force;  ///< force of a unit moment on the vector of the edge

  PlanarMovingEdge(const PlanarEdge<Scalar>& start, const PlanarEdge<Scalar>& middle, const PlanarEdge<Scalar>& end)
      : t0(start.tangent),
        t1(end.tangent),
        t(middle.tangent),
        inverse_length1(end.inverse_length),
        inverse_length(middle.inverse_length) {
    const Scalar l0 = 1.0 / start.inverse_length, l1 = 1.0 / end.inverse_length;
    inverse_mean = 2.0 / (l0 + l1);
    chi = 0.5 / (1.0 + dot(t0, t1));
    stretch = chi * inverse_length * inverse_mean * (l1 - l0);
    force = inverse_length * turned(t) + (stretch * cross(t0, t1)) * t;
  }

  /// Derivative of a moment by the edge's vector at the end, from its derivative by a turn.
  Vec2<Scalar> column(const Scalar& by_turn) const { return (by_turn * inverse_length1) * turned(t1); }

  /// Adds, times `factor`, how the force of a moment that stays changes with the edge's vector at the end.
  void add_geometry(const Scalar& factor, const Scalar& moment, Mat2<Scalar>& out) const {
    const Scalar i = inverse_length, p = moment * cross(t0, t1), half_nu = 0.5 * (stretch * p);
    const auto normal = [&](const Vec2<Scalar>& v) { return inverse_length1 * (v - dot(v, t1) * t1); };
    const Vec2<Scalar> by_chi = (2.0 * chi) * normal(t0);
    const Vec2<Scalar> by_nu =
        normal((stretch * moment) * turned(t0)) +
        p * ((chi * i * inverse_mean) * t1 - stretch * (by_chi + (0.5 * i) * t + (0.5 * inverse_mean) * t1));
    add_outer(out, factor, t, by_nu - (half_nu * i) * t);
    add_outer(out, -factor * (i * i * moment), turned(t), t);
    add_identity(out, factor * (half_nu * i));
    add_turned(out, factor * (0.5 * (i * i * moment)));
  }
};

/// Forces between two edges that follow one another in a step, and how they change with the edges' vectors in its
/// middle, of whose change that at the end is twice.
template <bool with_matrix, class Scalar>
void planar_discrete_forces(const PlanarMoment<Scalar>& m, const PlanarMovingEdge<Scalar> (&edge)[2],
                            PlanarForces<Scalar>& out) {
  const Scalar moment[2] = {m.moment, -m.moment};
  for (int i = 0; i < 2; ++i) out.force[i] = moment[i] * edge[i].force;
  if constexpr (with_matrix) {
    const Vec2<Scalar> column[2] = {edge[0].column(2.0 * m.by_a), edge[1].column(2.0 * m.by_b)};
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < 2; ++j) {
        out.by[i][j] = Mat2<Scalar>{};
        add_outer(out.by[i][j], Scalar(i == 0 ? 1.0 : -1.0), edge[i].force, column[j]);
      }
      edge[i].add_geometry(2.0, moment[i], out.by[i][i]);
    }
  }
}

}  // namespace withe
