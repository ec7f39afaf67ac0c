#pragma once
/// Discrete gradients of bending and twisting. These are moments between two frames whose work over a step equals the
/// change of the energy exactly. With the forces of the edges that transmit them, they apply neither a net force nor a
/// net moment to the stencil.
///
/// In a step a frame F turns from F0 to F1 by a rotation with the Cayley vector w, F1 - F0 = w x (F0 + F1) / 2. A
/// product of vectors of two frames therefore changes exactly by a1 . b1 - a0 . b0 = (w_a - w_b) . (mean a x mean b).
/// It is constant if both frames turn by the same rotation [Gonzalez 1996: discrete gradients in quadratic invariants].
/// The twist and the curvatures v in the directors of the first frame are quotients of such products: with x = t_a .
/// t_b, X = 1 + x,
///   v_i = y_i / X,  y_i = 2 di_a . t_b,
///   X cos(tau) = c = d1_a . d1_b + d2_a . d2_b,  X sin(tau) = s = d2_a . d1_b - d1_a . d2_b,
/// and change exactly (D for differences) by
///   D v_i = (D y_i - mean v_i D x) / mean X,
///   D tau = D tau / (X0 X1 sin D tau) (mean c D s - mean s D c),
/// and the curvatures in the directors of the second frame, y_i = -2 t_a . di_b, change in the same way. The curvatures
/// in the halfway directors are kappa = R v(a) = R^T v(b), where R turns by tau / 2. The mean of both forms, by which a
/// rod drawn backwards has the same moments, gives
///   D kappa = mean R D v(a) / 2 + mean R^T D v(b) / 2 + tan(D tau / 4) sin(D tau / 2) / (2 D tau) D kappa' D tau,
/// where kappa' is the change of kappa over the step: with J (x, y) = (y, -x),
///   D R = (2 tan(D tau / 4) / D tau) J mean R D tau.
/// The energy is a sum of squares of f(|kappa|^2) times strains, with f rational. Its differences are exact products
/// as well. The result is a moment m with m . (w_a - w_b) = E1 - E0, without a quotient of differences. It is as smooth
/// as the energy. Gonzalez's correction along a direction of the unknowns lacks this smoothness: it depends on how
/// little a stencil deforms while it turns.

#include <cmath>

#include "elasticity/bend_twist.hpp"

namespace withe {

/// x / sin(x) and its derivative, given sin(x) and cos(x); |x| < pi.
template <class Scalar>
struct TurnOverSine {
  Scalar value, slope;
};
inline TurnOverSine<double> turn_over_sine(double x, double sine, double cosine) {
  const double square = x * x;
  if (square < 1e-4) return {1.0 + square * (1.0 / 6.0 + 7.0 / 360.0 * square), x * (1.0 / 3.0 + 7.0 / 90.0 * square)};
  return {x / sine, (sine - x * cosine) / (sine * sine)};
}

/// Moments from strains: h_i with sum_i h_i D u_i = E1 - E0 for u = (kappa1, kappa2, tau), and d h_i / d u_j
/// at the end.
template <class Scalar>
struct DividedMoments {
  Scalar by[3];
  Scalar second[3][3];  ///< not symmetric; if requested
};

template <bool second_too, class Scalar>
DividedMoments<Scalar> divided_moments(const BendMeasure& measure, const Vec3<Scalar>& start, const Vec3<Scalar>& end,
                                       const Vec3<Scalar>& natural, const Vec3<Scalar>& stiffness) {
  const Scalar u0[3] = {start.x, start.y, start.z}, u1[3] = {end.x, end.y, end.z};
  const Scalar n[3] = {natural.x, natural.y, natural.z}, K[3] = {stiffness.x, stiffness.y, stiffness.z};
  const Scalar x0 = u0[0] * u0[0] + u0[1] * u0[1], x1 = u1[0] * u1[0] + u1[1] * u1[1];
  const BendFactor<Scalar> f0 = bend_factor(measure, x0), f1 = bend_factor(measure, x1);
  const Scalar f = 0.5 * (f0.value + f1.value);
  // (f1 - f0) / (x1 - x0), and its derivative with respect to x1.
  const Scalar lower = 1.0 / (1.0 + measure.b * x1);
  const Scalar divided = ((measure.a - measure.b) / (1.0 + measure.b * x0)) * lower;
  Scalar u[3], moment[3], work{0.0};
  for (int i = 0; i < 3; ++i) {
    u[i] = 0.5 * (u0[i] + u1[i]);
    moment[i] = K[i] * (0.5 * (f0.value * u0[i] + f1.value * u1[i]) - n[i]);
    work += moment[i] * u[i];
  }
  DividedMoments<Scalar> h;
  const Scalar pull = 2.0 * (work * divided);
  for (int i = 0; i < 3; ++i) h.by[i] = moment[i] * f;
  for (int i = 0; i < 2; ++i) h.by[i] += pull * u[i];
  if constexpr (second_too) {
    const Scalar falling = -measure.b * (lower * divided);  // derivative of `divided` by x1
    Scalar by_moment[3];                                    // of `moment` by u_j: K / 2 (f1 delta_ij + f1' 2 u1_j u1_i)
    for (int j = 0; j < 3; ++j) {
      const Scalar by_x = j < 2 ? Scalar(2.0 * u1[j]) : Scalar{0.0};
      Scalar by_work = 0.5 * moment[j];
      for (int i = 0; i < 3; ++i) {
        by_moment[i] = (0.5 * K[i]) * (f1.first * by_x * u1[i]);
        if (i == j) by_moment[i] += (0.5 * K[i]) * f1.value;
        by_work += by_moment[i] * u[i];
      }
      const Scalar by_pull = 2.0 * (by_work * divided + work * (falling * by_x));
      for (int i = 0; i < 3; ++i) {
        h.second[i][j] = by_moment[i] * f + moment[i] * (0.5 * f1.first * by_x);
        if (i < 2) h.second[i][j] += by_pull * u[i];
        if (i < 2 && i == j) h.second[i][j] += 0.5 * pull;
      }
    }
  }
  return h;
}

/// Moments that belong to the curvatures v in the directors of either frame, and to the twist: factors with
/// sum_i (a_i D v_i(a) + b_i D v_i(b)) + twist D tau = E1 - E0.
template <class Scalar>
struct FrameMoments {
  Vec2<Scalar> a, b;
  Scalar twist;
  /// Derivatives by the curvatures in the first frame and by tau at the end of the step; unset without `second_too`.
  Vec2<Scalar> a_by[3], b_by[3];
  Scalar twist_by[3];
};

/// Converts moments that belong to the halfway curvatures kappa and to tau. `start` and `end`: these strains at both
/// ends of the step. `turn`: finite turn of D tau.
template <bool second_too, class Scalar>
FrameMoments<Scalar> frame_moments(const HalfTwist<Scalar>& half0, const HalfTwist<Scalar>& half1,
                                   const TurnOverSine<Scalar>& turn, const Vec3<Scalar>& start, const Vec3<Scalar>& end,
                                   const DividedMoments<Scalar>& h) {
  const HalfTwist<Scalar> mean{0.5 * (half0.cosine + half1.cosine), 0.5 * (half0.sine + half1.sine)};
  const Scalar C = half0.cosine * half1.cosine + half0.sine * half1.sine;  // cos(D tau / 2)
  const Scalar S = half0.cosine * half1.sine - half0.sine * half1.cosine;
  const Scalar q = 1.0 / (turn.value * C * (1.0 + C));  // 2 tan(D tau / 4) / D tau
  const Vec2<Scalar> moment{h.by[0], h.by[1]}, change{end.x - start.x, end.y - start.y};
  const Scalar along = 0.25 * (q * S);
  FrameMoments<Scalar> out;
  out.a = 0.5 * mean.to_first(moment);
  out.b = 0.5 * mean.to_halfway(moment);
  out.twist = h.by[2] + along * dot(moment, change);
  if constexpr (second_too) {
    const Scalar q_slope = 0.5 * S * (1.0 / (1.0 + C) + 1.0 / C) - turn.slope / turn.value;  // over q
    const Vec2<Scalar> across = half1.to_halfway({0.125 * moment.y, -0.125 * moment.x}),
                       back = half1.to_first({-0.125 * moment.y, 0.125 * moment.x});
    // Derivatives by kappa at the end and by tau, then by the variables that determine kappa.
    Vec2<Scalar> a_by[3], b_by[3];
    Scalar twist_by[3];
    for (int j = 0; j < 3; ++j) {
      const Vec2<Scalar> second{h.second[0][j], h.second[1][j]};
      a_by[j] = 0.5 * mean.to_first(second);
      b_by[j] = 0.5 * mean.to_halfway(second);
      twist_by[j] = h.second[2][j] + along * dot(second, change);
    }
    twist_by[0] += along * moment.x;
    twist_by[1] += along * moment.y;
    a_by[2] += back;
    b_by[2] += across;
    twist_by[2] += (0.25 * (q * q_slope * S) + 0.125 * (q * C)) * dot(moment, change);
    const auto follow = [&](const auto(&by)[3], auto(&into)[3]) {
      into[0] = half1.cosine * by[0] - half1.sine * by[1];
      into[1] = half1.sine * by[0] + half1.cosine * by[1];
      into[2] = by[2] + (0.5 * end.y) * by[0] - (0.5 * end.x) * by[1];
    };
    follow(a_by, out.a_by);
    follow(b_by, out.b_by);
    follow(twist_by, out.twist_by);
  }
  return out;
}

/// The moment m [N m] with m . (w_a - w_b) = E1 - E0, and its derivatives by spins of the two frames at the end.
template <class Scalar>
struct DiscreteMoment {
  Vec3<Scalar> moment;
  Mat3<Scalar> by_a, by_b;  ///< if requested
};

template <bool with_matrix, class Scalar>
void discrete_moment(const BendMeasure& measure, const EdgeFrame<Scalar>& a0, const EdgeFrame<Scalar>& a1,
                     const EdgeFrame<Scalar>& b0, const EdgeFrame<Scalar>& b1, const Vec3<Scalar>& start,
                     const Vec3<Scalar>& end, const Vec3<Scalar>& natural, const Vec3<Scalar>& stiffness,
                     DiscreteMoment<Scalar>& out) {
  const DividedMoments<Scalar> divided = divided_moments<with_matrix>(measure, start, end, natural, stiffness);
  const auto mean = [](const Vec3<Scalar>& p, const Vec3<Scalar>& q) { return Scalar(0.5) * (p + q); };
  const Vec3<Scalar> ta = mean(a0.tangent, a1.tangent), tb = mean(b0.tangent, b1.tangent);
  const Vec3<Scalar> a[2] = {mean(a0.d1, a1.d1), mean(a0.d2, a1.d2)}, b[2] = {mean(b0.d1, b1.d1), mean(b0.d2, b1.d2)};
  const Scalar X0 = 1.0 + dot(a0.tangent, b0.tangent), X1 = 1.0 + dot(a1.tangent, b1.tangent);
  const Scalar inverse = 2.0 / (X0 + X1);
  const Scalar c0 = dot(a0.d1, b0.d1) + dot(a0.d2, b0.d2), s0 = dot(a0.d2, b0.d1) - dot(a0.d1, b0.d2);
  const Scalar c1 = dot(a1.d1, b1.d1) + dot(a1.d2, b1.d2), s1 = dot(a1.d2, b1.d1) - dot(a1.d1, b1.d2);
  const Scalar c = 0.5 * (c0 + c1), s = 0.5 * (s0 + s1);
  const Scalar inverse_chi = 1.0 / (X0 * X1), i1 = inverse_chi * X0;
  const Scalar sine = inverse_chi * (c0 * s1 - s0 * c1), cosine = inverse_chi * (c0 * c1 + s0 * s1);
  const TurnOverSine<Scalar> turn = turn_over_sine(end.z - start.z, sine, cosine);
  const Scalar g = turn.value * inverse_chi;
  const HalfTwist<Scalar> half0 = half_twist(start.z), half1 = half_twist(end.z);
  const FrameMoments<Scalar> h = frame_moments<with_matrix>(half0, half1, turn, start, end, divided);
  // Curvatures in the directors of the first and of the second frame: at the end, and their means.
  const Vec2<Scalar> kappa{end.x, end.y}, u = half1.to_first(kappa), v = half1.to_halfway(kappa);
  const Vec2<Scalar> ka = Scalar(0.5) * (half0.to_first({start.x, start.y}) + u),
                     kb = Scalar(0.5) * (half0.to_halfway({start.x, start.y}) + v);

  // m = sum of weights times the cross products that belong to x, to y1 and y2 of either frame, to c and s.
  const Vec2<Scalar> wa = inverse * h.a, wb = inverse * h.b;
  const Scalar wx = -(dot(wa, ka) + dot(wb, kb));
  const Scalar hg = h.twist * g, ws = hg * c, wc = -(hg * s);
  const Vec3<Scalar> P[3] = {wx * tb - 2.0 * (wb.x * b[0] + wb.y * b[1]), (2.0 * wa.x) * tb + wc * b[0] - ws * b[1],
                             (2.0 * wa.y) * tb + ws * b[0] + wc * b[1]};
  out.moment = cross(ta, P[0]) + cross(a[0], P[1]) + cross(a[1], P[2]);
  if constexpr (with_matrix) {
    const Vec3<Scalar> Q[3] = {wx * ta + 2.0 * (wa.x * a[0] + wa.y * a[1]), wc * a[0] + ws * a[1] - (2.0 * wb.x) * ta,
                               wc * a[1] - ws * a[0] - (2.0 * wb.y) * ta};
    const Vec3<Scalar>*at[3] = {&a1.tangent, &a1.d1, &a1.d2}, *bt[3] = {&b1.tangent, &b1.d1, &b1.d2};
    out.by_a = out.by_b = Mat3<Scalar>{};
    Scalar trace_a{0.0}, trace_b{0.0};
    for (int i = 0; i < 3; ++i) {
      add_outer(out.by_a, Scalar(0.5), *at[i], P[i]);
      add_outer(out.by_b, Scalar(-0.5), *bt[i], Q[i]);
      trace_a += dot(*at[i], P[i]);
      trace_b += dot(*bt[i], Q[i]);
    }
    add_identity(out.by_a, -0.5 * trace_a);
    add_identity(out.by_b, 0.5 * trace_b);

    // The weights depend on the strains and X at the end. These depend on the spin of a minus the spin of b.
    const Vec3<Scalar> x = cross(a1.tangent, b1.tangent);
    const Vec3<Scalar> vx = cross(ta, tb), vc = cross(a[0], b[0]) + cross(a[1], b[1]),
                       vs = cross(a[1], b[0]) - cross(a[0], b[1]);
    const Vec3<Scalar> strain[3] = {i1 * (2.0 * cross(a1.d1, b1.tangent) - u.x * x),
                                    i1 * (2.0 * cross(a1.d2, b1.tangent) - u.y * x), -(i1 * (a1.tangent + b1.tangent))};
    const Vec3<Scalar> ya[2] = {2.0 * cross(a[0], tb), 2.0 * cross(a[1], tb)},
                       yb[2] = {2.0 * cross(b[0], ta), 2.0 * cross(b[1], ta)};
    const Vec3<Scalar> ma[2] = {inverse * (ya[0] - ka.x * vx), inverse * (ya[1] - ka.y * vx)},
                       mb[2] = {inverse * (yb[0] - kb.x * vx), inverse * (yb[1] - kb.y * vx)};
    const Vec3<Scalar> twisting = c * vs - s * vc, mt = g * twisting;
    const Vec3<Scalar> bending = wa.x * ya[0] + wa.y * ya[1] + wb.x * yb[0] + wb.y * yb[1] + wx * vx;
    // Derivative of wx by the mean curvatures; curvatures in the second frame turn with tau.
    const Vec2<Scalar> by_curvature = Scalar(0.5) * (wa + half1.to_first(half1.to_first(wb)));
    const Scalar falling[3] = {by_curvature.x, by_curvature.y, 0.5 * (wb.x * v.y - wb.y * v.x)};
    for (int j = 0; j < 3; ++j) {
      Vec3<Scalar> W = h.a_by[j].x * ma[0] + h.a_by[j].y * ma[1] + h.b_by[j].x * mb[0] + h.b_by[j].y * mb[1] +
                       h.twist_by[j] * mt - falling[j] * vx;
      if (j == 2) W += (h.twist * turn.slope * inverse_chi) * twisting - (0.5 * hg) * (s1 * vs + c1 * vc);
      add_outer(out.by_a, Scalar(1.0), W, strain[j]);
      add_outer(out.by_b, Scalar(-1.0), W, strain[j]);
    }
    const Vec3<Scalar> by_chi =
        (0.5 * hg * i1) * (c1 * vs - s1 * vc) - (hg * i1) * twisting - (0.5 * inverse) * bending;
    add_outer(out.by_a, Scalar(1.0), by_chi, x);
    add_outer(out.by_b, Scalar(-1.0), by_chi, x);
  }
}

/// An edge in a step, and the forces by which it carries a moment m on its frame. Let e be the mean of its vectors at
/// both ends of the step, t the direction of e and l its length. The force
///   f = m x t / l + nu t  on the edge's vector,  m . t on its angle,
/// has the moment m about the mid-step position of the edge. The factor nu makes the work equal to m . w:
///   f . (e1 - e0) + (m . t) D chi = m . w,  D chi = 2 tan(D theta / 2) / (mean of t0 and t1 along t).
template <class Scalar>
struct MovingEdge {
  Vec3<Scalar> t0, t1, t, zeta;  ///< nu = m . zeta
  Scalar inverse_length1, inverse_length, chi, stretch, turned;
  Scalar inverse_mean;  ///< 2 / (l0 + l1)
  Scalar theta;         ///< 2 tan(D theta / 2)

  MovingEdge(const Vec3<Scalar>& start, const Scalar& inverse0, const Vec3<Scalar>& end, const Scalar& inverse1,
             const Vec3<Scalar>& middle, const Scalar& inverse_middle, const Scalar& turn)
      : t0(start), t1(end), t(middle), inverse_length1(inverse1), inverse_length(inverse_middle), theta(turn) {
    const Scalar l0 = 1.0 / inverse0, l1 = 1.0 / inverse1;
    inverse_mean = 2.0 / (l0 + l1);
    chi = 0.5 / (1.0 + dot(t0, t1));
    stretch = (chi * inverse_length * inverse_mean) * (l1 - l0);
    turned = chi * inverse_mean * inverse_mean / inverse_length;
    zeta = stretch * cross(t0, t1) - (turned * theta) * (t1 - t0);
  }

  Vec3<Scalar> force(const Vec3<Scalar>& m) const { return inverse_length * cross(m, t) + dot(m, zeta) * t; }
  Scalar torque(const Vec3<Scalar>& m) const { return dot(m, t); }
};

/// Derivative of the moment of a pair of frames by an edge's vector and angle at the end: that by its spin, times
/// the spin t1 x de / l1 + t1 (spin . de + d theta).
template <class Scalar>
struct EdgeColumns {
  Mat3<Scalar> edge;
  Vec3<Scalar> angle;
};
template <class Scalar>
EdgeColumns<Scalar> edge_columns(const Mat3<Scalar>& by_spin, const EdgeFrame<Scalar>& end) {
  EdgeColumns<Scalar> out;
  const Vec3<Scalar>& t = end.tangent;
  Scalar angle[3];
  for (int i = 0; i < 3; ++i) {
    angle[i] = dot(by_spin.row[i], t);
    out.edge.row[i] = end.inverse_length * cross(by_spin.row[i], t) + angle[i] * end.spin;
  }
  out.angle = {angle[0], angle[1], angle[2]};
  return out;
}

/// Rows of an edge, force and torque, by vectors and angles at the end.
template <class Scalar>
struct EdgeBlock {
  Mat3<Scalar> ee;
  Vec3<Scalar> e_angle;  ///< force by angle
  Vec3<Scalar> angle_e;  ///< torque by edge
  Scalar angle_angle;
};

/// Contribution of changes of the moment. `sign` is -1 for the frame on which the opposite moment acts.
template <class Scalar>
EdgeBlock<Scalar> edge_block(const MovingEdge<Scalar>& edge, double sign, const EdgeColumns<Scalar>& c) {
  EdgeBlock<Scalar> out;
  const Mat3<Scalar>& C = c.edge;
  const Vec3<Scalar>& t = edge.t;
  const Vec3<Scalar> along_t = t.x * C.row[0] + t.y * C.row[1] + t.z * C.row[2];
  const Vec3<Scalar> axial = edge.zeta.x * C.row[0] + edge.zeta.y * C.row[1] + edge.zeta.z * C.row[2];
  const Scalar k = sign * edge.inverse_length;
  out.ee.row[0] = k * (t.z * C.row[1] - t.y * C.row[2]) + (sign * t.x) * axial;
  out.ee.row[1] = k * (t.x * C.row[2] - t.z * C.row[0]) + (sign * t.y) * axial;
  out.ee.row[2] = k * (t.y * C.row[0] - t.x * C.row[1]) + (sign * t.z) * axial;
  out.angle_e = Scalar(sign) * along_t;
  out.e_angle = Scalar(sign) * edge.force(c.angle);
  out.angle_angle = sign * dot(t, c.angle);
  return out;
}

/// Contribution of the motion of the edge at constant moment.
template <class Scalar>
void add_edge_geometry(const MovingEdge<Scalar>& edge, const Vec3<Scalar>& m, EdgeBlock<Scalar>& out) {
  const Vec3<Scalar>&t0 = edge.t0, &t1 = edge.t1, &t = edge.t;
  const Scalar i1 = edge.inverse_length1, i = edge.inverse_length;
  const Scalar p = dot(m, cross(t0, t1)), q = dot(m, t1 - t0), nu = dot(m, edge.zeta);
  const auto normal = [&](const Vec3<Scalar>& v) { return i1 * (v - dot(v, t1) * t1); };
  const Vec3<Scalar> by_chi = (2.0 * edge.chi) * normal(t0);
  const Scalar turned = edge.turned * edge.theta;
  const Vec3<Scalar> by_nu = normal(edge.stretch * cross(m, t0) - turned * m) +
                             p * ((edge.chi * i * edge.inverse_mean) * t1 -
                                  edge.stretch * (by_chi + (0.5 * i) * t + (0.5 * edge.inverse_mean) * t1)) -
                             (q * turned) * ((0.5 * i) * t - edge.inverse_mean * t1 - by_chi);
  const Vec3<Scalar> across = cross(m, t);
  add_cross(out.ee, 0.5 * i * i, m);
  add_outer(out.ee, -(i * i), across, t);
  add_outer(out.ee, Scalar(1.0), t, by_nu);
  add_identity(out.ee, 0.5 * nu * i);
  add_outer(out.ee, -0.5 * nu * i, t, t);
  out.e_angle += (-q * edge.turned * (1.0 + 0.25 * edge.theta * edge.theta)) * t;
  out.angle_e += (0.5 * i) * (m - dot(m, t) * t);
}

/// Converts torques on directors into torques on angles. The direct transport of directors adds a force on the nodes,
/// torque times spin, which does no work in a step.
template <class Scalar>
void add_transport(const EdgeFrame<Scalar>& middle, EdgeBlock<Scalar>& out) {
  add_outer(out.ee, Scalar(1.0), middle.spin, out.angle_e);
  out.e_angle += out.angle_angle * middle.spin;
}
/// Derivative of spin by the middle, which moves half as much as the end: d spin = -s x de / (l^2 (1 + s . t)) - spin
/// (bow . de), s the tangent at the start.
template <class Scalar>
void add_spin_change(const MovingEdge<Scalar>& edge, const EdgeFrame<Scalar>& middle, const Scalar& torque,
                     EdgeBlock<Scalar>& out) {
  const Scalar i = edge.inverse_length, half = 0.5 * torque;
  add_cross(out.ee, -(half * i * i) / (1.0 + dot(edge.t0, edge.t)), edge.t0);
  add_outer(out.ee, -half, middle.spin, middle.bow);
}

/// 2 tan(D theta / 2) of the angle by which an edge's directors turn beyond parallel transport in a step.
template <class Scalar>
Scalar turn_of_directors(const EdgeFrame<Scalar>& start, const EdgeFrame<Scalar>& end) {
  const Scalar sine = dot(start.d2, end.d1) - dot(start.d1, end.d2);
  const Scalar cosine = dot(start.d1, end.d1) + dot(start.d2, end.d2);
  return 2.0 * sine / (1.0 + dot(start.tangent, end.tangent) + cosine);
}

}  // namespace withe
