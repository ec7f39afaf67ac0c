#pragma once
/// Bending and twisting between two frames: two edges, or an edge and the frame of a joint or a wall.
///
/// Strains [Bergou et al. 2010, section 3; Choi, dissertation 3.3-3.6], with t the tangents and d the directors:
///   kb = 2 t0 x t1 / (1 + t0 . t1),  tau = angle about t1 from the transported d1_0 to d1_1,
///   kappa1 = kb . d2,  kappa2 = - kb . d1,  in the directors of the first frame turned by tau / 2
/// (geometry/curvature.hpp). The source uses the mean of the directors of both frames, with which twist would reduce
/// the bending stiffness.
/// |kb| = 2 tan(phi / 2) for a turn by phi. kappa1 > 0 bends towards d1, kappa2 > 0 towards d2.
/// Energy E = (K1 (f kappa1 - n1)^2 + K2 (f kappa2 - n2)^2 + Kt (f tau - nt)^2) / 2, f(|kappa|^2) of
/// geometry/bend_measure.hpp, stiffnesses K = EI / V and GJ / V in N m, V the Voronoi length.
///
/// Derivatives are taken with respect to y = (e0, psi0, e1, psi1): edge vectors, and turns of the
/// directors beyond infinitesimal parallel transport; `apply_transport` changes from psi to theta.

#include "geometry/bend_measure.hpp"
#include "geometry/curvature.hpp"

namespace withe {

template <class Scalar>
struct BendTwistStiffness {
  Scalar bend1, bend2, twist;  // [N m]
};

/// Energy, gradient and Hessian in y. Blocks of the Hessian: edge-edge (3 x 3), edge-angle (3), angle-angle.
template <class Scalar>
struct BendTwistDerivatives {
  Scalar energy;
  Vec3<Scalar> gradient_e[2];
  Scalar gradient_angle[2];
  Mat3<Scalar> ee[2][2];       // [1][0] is not filled: the transpose of [0][1]
  Vec3<Scalar> e_angle[2][2];  // [i][j]: edge i, angle j
  Scalar angle_angle[2][2];    // [1][0] is not filled
};

/// Energy [J] and its derivatives with respect to (kappa1, kappa2, tau) [N m], or to tau and the curvatures in the
/// directors of the first frame.
template <class Scalar>
struct BendTwistMoments {
  Scalar energy, by[3];
  Scalar second[3][3];  ///< if requested
};

template <bool second_too, class Scalar>
BendTwistMoments<Scalar> bend_twist_moments(const BendMeasure& measure, const BendTwistStrain<Scalar>& s,
                                            const BendTwistStrain<Scalar>& natural,
                                            const BendTwistStiffness<Scalar>& k) {
  const Scalar u[3] = {s.kappa1, s.kappa2, s.tau}, n[3] = {natural.kappa1, natural.kappa2, natural.tau};
  const Scalar K[3] = {k.bend1, k.bend2, k.twist};
  const BendFactor<Scalar> f = bend_factor(measure, u[0] * u[0] + u[1] * u[1]);
  Scalar strain[3], moment[3];
  for (int i = 0; i < 3; ++i) {
    strain[i] = f.value * u[i] - n[i];
    moment[i] = K[i] * strain[i];
  }
  const Scalar work = moment[0] * u[0] + moment[1] * u[1] + moment[2] * u[2], pull = 2.0 * (f.first * work);
  BendTwistMoments<Scalar> m;
  m.energy = 0.5 * (moment[0] * strain[0] + moment[1] * strain[1] + moment[2] * strain[2]);
  for (int i = 0; i < 3; ++i) m.by[i] = f.value * moment[i];
  for (int i = 0; i < 2; ++i) m.by[i] += pull * u[i];
  if constexpr (second_too) {
    // d2E = f^2 K + f' (...): `lean` is how a moment changes with x = |kappa|^2, halved, and the factor's change on
    // top.
    Scalar lean[3], stiff[3], sum{0.0};
    for (int i = 0; i < 3; ++i) {
      stiff[i] = K[i] * u[i];
      lean[i] = (2.0 * f.first) * (moment[i] + f.value * stiff[i]);
      sum += stiff[i] * u[i];
    }
    const Scalar common = 4.0 * (f.second * work + (f.first * f.first) * sum), square = f.value * f.value;
    for (int i = 0; i < 2; ++i)
      for (int j = i; j < 2; ++j) m.second[i][j] = u[i] * lean[j] + lean[i] * u[j] + common * (u[i] * u[j]);
    for (int i = 0; i < 2; ++i) {
      m.second[i][i] += square * K[i] + pull;
      m.second[i][2] = m.second[2][i] = u[i] * lean[2];
    }
    m.second[1][0] = m.second[0][1];
    m.second[2][2] = square * K[2];
  }
  return m;
}

/// Changes derivatives by the curvatures in the halfway directors, and tau, to derivatives by the curvatures v in the
/// directors of the first frame, and tau. R(tau) is the rotation by half of the twist: kappa = R v and d kappa / d tau
/// = (kappa2, -kappa1) / 2.
template <bool second_too, class Scalar>
void apply_half_twist(const HalfTwist<Scalar>& half, const BendTwistStrain<Scalar>& s, BendTwistMoments<Scalar>& m) {
  const Vec2<Scalar> by_tau{0.5 * s.kappa2, -0.5 * s.kappa1}, moment{m.by[0], m.by[1]};
  if constexpr (second_too) {
    const Scalar by1 = m.second[0][0] * by_tau.x + m.second[0][1] * by_tau.y;
    const Scalar by2 = m.second[1][0] * by_tau.x + m.second[1][1] * by_tau.y;
    const Scalar mixed = m.second[0][2] * by_tau.x + m.second[1][2] * by_tau.y;
    m.second[2][2] +=
        2.0 * mixed + by1 * by_tau.x + by2 * by_tau.y - 0.25 * (moment.x * s.kappa1 + moment.y * s.kappa2);
    const Vec2<Scalar> with_tau =
        half.to_first({m.second[0][2] + by1 - 0.5 * moment.y, m.second[1][2] + by2 + 0.5 * moment.x});
    m.second[0][2] = m.second[2][0] = with_tau.x;
    m.second[1][2] = m.second[2][1] = with_tau.y;
    const Vec2<Scalar> first = half.to_first({m.second[0][0], m.second[1][0]});
    const Vec2<Scalar> second = half.to_first({m.second[0][1], m.second[1][1]});
    const Vec2<Scalar> row1 = half.to_first({first.x, second.x}), row2 = half.to_first({first.y, second.y});
    m.second[0][0] = row1.x;
    m.second[0][1] = m.second[1][0] = row1.y;
    m.second[1][1] = row2.y;
  }
  m.by[2] += dot(moment, by_tau);
  const Vec2<Scalar> first = half.to_first(moment);
  m.by[0] = first.x;
  m.by[1] = first.y;
}

/// Energy and gradient only.
template <class Scalar>
void bend_twist_gradient(const BendMeasure& measure, const EdgeFrame<Scalar>& f0, const EdgeFrame<Scalar>& f1,
                         const BendTwistStrain<Scalar>& s, const BendTwistStrain<Scalar>& natural,
                         const BendTwistStiffness<Scalar>& k, BendTwistDerivatives<Scalar>& out) {
  BendTwistMoments<Scalar> m = bend_twist_moments<false>(measure, s, natural, k);
  const Scalar K = m.by[0] * s.kappa1 + m.by[1] * s.kappa2;
  const Scalar inverse_chi = 1.0 / (1.0 + dot(f0.tangent, f1.tangent));
  apply_half_twist<false>(half_twist(s.tau), s, m);
  const Scalar &c1 = m.by[0], &c2 = m.by[1], &ct = m.by[2];
  const Vec3<Scalar> kb = (2.0 * inverse_chi) * cross(f0.tangent, f1.tangent);
  const Vec3<Scalar> t = inverse_chi * (f0.tangent + f1.tangent);
  // kappa2 follows from kappa1 by (d1, d2) -> (d2, -d1), so both appear through two combined directors.
  const Vec3<Scalar> D = (2.0 * inverse_chi) * (c1 * f0.d2 - c2 * f0.d1);
  out.energy = m.energy;
  out.gradient_e[0] = f0.inverse_length * (cross(f1.tangent, D) - K * t + (0.5 * ct) * kb);
  out.gradient_e[1] = f1.inverse_length * ((0.5 * ct) * kb - K * t - cross(f0.tangent, D));
  out.gradient_angle[0] = -(c1 * dot(kb, f0.d1) + c2 * dot(kb, f0.d2)) - ct;
  out.gradient_angle[1] = ct;
}

/// Energy, gradient and symmetric Hessian. [Bergou et al. 2010, appendix], combined over the two curvatures.
template <class Scalar>
void bend_twist_hessian(const BendMeasure& measure, const EdgeFrame<Scalar>& f0, const EdgeFrame<Scalar>& f1,
                        const BendTwistStrain<Scalar>& s, const BendTwistStrain<Scalar>& natural,
                        const BendTwistStiffness<Scalar>& k, BendTwistDerivatives<Scalar>& out) {
  BendTwistMoments<Scalar> m = bend_twist_moments<true>(measure, s, natural, k);
  const Scalar K = m.by[0] * s.kappa1 + m.by[1] * s.kappa2;
  const Scalar &c1 = m.by[0], &c2 = m.by[1], &ct = m.by[2];
  const Vec3<Scalar>&t0 = f0.tangent, &t1 = f1.tangent;
  const Scalar i0 = f0.inverse_length, i1 = f1.inverse_length;
  const Scalar inverse_chi = 1.0 / (1.0 + dot(t0, t1));
  const HalfTwist<Scalar> half = half_twist(s.tau);
  apply_half_twist<true>(half, s, m);
  const Vec2<Scalar> kappa = half.to_first({s.kappa1, s.kappa2});
  const Vec3<Scalar> kb = (2.0 * inverse_chi) * cross(t0, t1);
  const Vec3<Scalar> t = inverse_chi * (t0 + t1);
  const Scalar half_ct = 0.5 * ct;
  const Vec3<Scalar> d1 = 2.0 * f0.d1, d2 = 2.0 * f0.d2;
  const Vec3<Scalar> D0 = c1 * d2 - c2 * d1, C = c1 * d1 + c2 * d2, D = inverse_chi * D0;
  const Vec3<Scalar> t1D = cross(t1, D), t0D = cross(t0, D);

  out.energy = m.energy;
  out.gradient_e[0] = i0 * (t1D - K * t + half_ct * kb);
  out.gradient_e[1] = i1 * (half_ct * kb - K * t - t0D);
  const Scalar kbC = dot(kb, C);
  out.gradient_angle[0] = -0.5 * kbC - ct;
  out.gradient_angle[1] = ct;

  // Second derivatives of the strains, weighted by the moments.
  Mat3<Scalar> A{}, B{}, F{};
  const Scalar k_chi = K * inverse_chi;
  add_outer(A, 2.0 * K, t, t);
  F = A;
  B = A;
  add_symmetric_outer(A, Scalar(-1.0), t1D, t);
  add_symmetric_outer(F, Scalar(1.0), t0D, t);
  add_identity(A, -k_chi);
  add_outer(A, k_chi, t0, t0);
  add_identity(F, -k_chi);
  add_outer(F, k_chi, t1, t1);
  add_symmetric_outer(A, Scalar(0.25), kb, D0 - ct * (t0 + t));
  add_symmetric_outer(F, -0.25 * ct, kb, t1 + t);
  add_identity(B, -k_chi);
  add_outer(B, -k_chi, t0, t1);
  add_outer(B, Scalar(-1.0), t1D, t);
  add_outer(B, Scalar(1.0), t, t0D);
  add_cross(B, Scalar(-1.0), D);
  add_cross(B, ct * inverse_chi, t0);
  add_outer(B, -half_ct, kb, t);

  // First derivatives of the curvatures in the first frame and, kb / 2, of the twist.
  const Vec3<Scalar> a1 = inverse_chi * d2, a2 = -(inverse_chi * d1);
  const Vec3<Scalar> p1 = cross(t1, a1) - kappa.x * t, p2 = cross(t1, a2) - kappa.y * t;
  const Vec3<Scalar> q1 = -(cross(t0, a1) + kappa.x * t), q2 = -(cross(t0, a2) + kappa.y * t);
  const Vec3<Scalar> half_kb = 0.5 * kb;
  const Vec3<Scalar> p[3] = {p1, p2, half_kb}, q[3] = {q1, q2, half_kb};
  for (int i = 0; i < 3; ++i) {
    const Vec3<Scalar> u = m.second[i][0] * p1 + m.second[i][1] * p2 + m.second[i][2] * half_kb;
    add_outer(A, Scalar(1.0), u, p[i]);
    add_outer(B, Scalar(1.0), u, q[i]);
    add_outer(F, Scalar(1.0), m.second[i][0] * q1 + m.second[i][1] * q2 + m.second[i][2] * half_kb, q[i]);
  }
  for (int i = 0; i < 3; ++i) {
    out.ee[0][0].row[i] = (i0 * i0) * A.row[i];
    out.ee[0][1].row[i] = (i0 * i1) * B.row[i];
    out.ee[1][1].row[i] = (i1 * i1) * F.row[i];
  }

  // First derivatives of the strains in the first angle, and the second derivatives times these; the second angle is
  // part of the twist only.
  const Scalar w1 = -0.5 * dot(kb, d1), w2 = -0.5 * dot(kb, d2);
  Scalar v[3];
  for (int i = 0; i < 3; ++i) v[i] = m.second[i][0] * w1 + m.second[i][1] * w2 - m.second[i][2];
  const Vec3<Scalar> common = (0.5 * kbC) * t + v[2] * half_kb, twisted = m.second[2][2] * half_kb;
  out.e_angle[0][0] = i0 * (common - inverse_chi * cross(t1, C) + v[0] * p1 + v[1] * p2);
  out.e_angle[1][0] = i1 * (common + inverse_chi * cross(t0, C) + v[0] * q1 + v[1] * q2);
  out.e_angle[0][1] = i0 * (twisted + m.second[2][0] * p1 + m.second[2][1] * p2);
  out.e_angle[1][1] = i1 * (twisted + m.second[2][0] * q1 + m.second[2][1] * q2);
  out.angle_angle[0][0] = v[0] * w1 + v[1] * w2 - v[2] - 0.5 * dot(kb, D0);
  out.angle_angle[0][1] = v[2];
  out.angle_angle[1][1] = m.second[2][2];
}

/// From psi to theta, psi = theta + (spin of direct transport): the term that a finite rotation within a
/// step needs (see EdgeFrame). Changes the blocks in place.
template <class Scalar>
void apply_transport_gradient(const EdgeFrame<Scalar>& f0, const EdgeFrame<Scalar>& f1,
                              BendTwistDerivatives<Scalar>& d) {
  d.gradient_e[0] += d.gradient_angle[0] * f0.spin;
  d.gradient_e[1] += d.gradient_angle[1] * f1.spin;
}

template <class Scalar>
void apply_transport(const EdgeFrame<Scalar>& f0, const EdgeFrame<Scalar>& f1, BendTwistDerivatives<Scalar>& d) {
  const Vec3<Scalar>&a0 = f0.spin, &a1 = f1.spin;
  add_symmetric_outer(d.ee[0][0], Scalar(1.0), a0, d.e_angle[0][0]);
  add_outer(d.ee[0][0], d.angle_angle[0][0], a0, a0);
  add_symmetric_outer(d.ee[0][0], -0.5 * d.gradient_angle[0], a0, f0.bow);
  add_symmetric_outer(d.ee[1][1], Scalar(1.0), a1, d.e_angle[1][1]);
  add_outer(d.ee[1][1], d.angle_angle[1][1], a1, a1);
  add_symmetric_outer(d.ee[1][1], -0.5 * d.gradient_angle[1], a1, f1.bow);
  add_outer(d.ee[0][1], Scalar(1.0), a0, d.e_angle[1][0]);
  add_outer(d.ee[0][1], Scalar(1.0), d.e_angle[0][1], a1);
  add_outer(d.ee[0][1], d.angle_angle[0][1], a0, a1);
  d.e_angle[0][0] += d.angle_angle[0][0] * a0;
  d.e_angle[0][1] += d.angle_angle[0][1] * a0;
  d.e_angle[1][0] += d.angle_angle[0][1] * a1;
  d.e_angle[1][1] += d.angle_angle[1][1] * a1;
  apply_transport_gradient(f0, f1, d);
}

/// Both triangles of the matrix of node, angle, node, angle, node.
template <class Scalar, class Matrix>
void put_bend_twist_matrix(const BendTwistDerivatives<Scalar>& d, Matrix& H) {
  const Mat3<Scalar>&A = d.ee[0][0], &B = d.ee[0][1], &F = d.ee[1][1];
  const auto both = [&](int i, int j, const Scalar& value) { H[i][j] = H[j][i] = value; };
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const Scalar a = A.row[i][j], b = B.row[i][j], f = F.row[i][j];
      H[i][j] = a;
      H[8 + i][8 + j] = f;
      H[4 + i][4 + j] = (a + f) - (b + B.row[j][i]);
      both(i, 4 + j, b - a);
      both(i, 8 + j, -b);
      both(4 + i, 8 + j, b - f);
    }
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 3; ++i) {
      const Scalar g0 = d.e_angle[0][j][i], g1 = d.e_angle[1][j][i];
      both(i, 3 + 4 * j, -g0);
      both(4 + i, 3 + 4 * j, g0 - g1);
      both(8 + i, 3 + 4 * j, g1);
    }
  H[3][3] = d.angle_angle[0][0];
  H[7][7] = d.angle_angle[1][1];
  both(3, 7, d.angle_angle[0][1]);
}

}  // namespace withe
