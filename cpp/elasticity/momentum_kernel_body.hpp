// The discrete gradient of bending and twisting in space, and of stretching, on packs; included by
// stencil_kernels_body.hpp.

#include "elasticity/stencil_packs.hpp"

namespace withe::WITHE_INSTRUCTION_SET {
namespace {

/// Bending and twisting energy of strains kappa1, kappa2, tau.
Pack energy_of(const BendMeasure& measure, const Vec3<Pack>& strain, const Vec3<Pack>& natural,
               const Vec3<Pack>& stiffness) {
  const Pack f = bend_factor(measure, strain.x * strain.x + strain.y * strain.y).value;
  const Vec3<Pack> off = f * strain - natural;
  return 0.5 * (stiffness.x * (off.x * off.x) + stiffness.y * (off.y * off.y) + stiffness.z * (off.z * off.z));
}

/// From edges and angles to the unknowns of a stencil.
void put_changes(Pack (&out)[11], const EdgeChanges& v) {
  put(out, -v.edge[0]);
  put(out + 4, v.edge[0] - v.edge[1]);
  put(out + 8, v.edge[1]);
  out[3] = v.angle[0];
  out[7] = v.angle[1];
}

/// H += a b^T.
template <int kWidth>
void add_outer_product(Pack (&H)[11][kWidth], const Pack (&a)[11], const Pack (&b)[11]) {
  for (int i = 0; i < 11; ++i)
    for (int j = 0; j < 11; ++j) H[i][j] += a[i] * b[j];
}

/// The same for vectors of the edge whose tail begins at unknown `tail`.
template <int kWidth>
void add_edge_product(Pack (&H)[11][kWidth], int tail, const Vec3<Pack>& a, const Vec3<Pack>& b) {
  const Pack left[3] = {a.x, a.y, a.z}, right[3] = {b.x, b.y, b.z};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const Pack product = left[i] * right[j];
      H[tail + i][tail + j] += product;
      H[tail + 4 + i][tail + 4 + j] += product;
      H[tail + i][tail + 4 + j] -= product;
      H[tail + 4 + i][tail + j] -= product;
    }
}

/// The Hessian of the middle times a change.
EdgeChanges times(const BendTwistDerivatives<Pack>& d, const EdgeChanges& v) {
  const Mat3<Pack>& B = d.ee[0][1];
  const auto along = [](const Mat3<Pack>& m, const Vec3<Pack>& a) {
    return Vec3<Pack>{dot(m.row[0], a), dot(m.row[1], a), dot(m.row[2], a)};
  };
  const Vec3<Pack>& e = v.edge[0];
  EdgeChanges out;
  out.edge[0] = along(d.ee[0][0], v.edge[0]) + along(B, v.edge[1]);
  out.edge[1] = along(d.ee[1][1], v.edge[1]) + e.x * B.row[0] + e.y * B.row[1] + e.z * B.row[2];
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) out.edge[i] += v.angle[j] * d.e_angle[i][j];
    out.angle[j] = dot(d.e_angle[0][j], v.edge[0]) + dot(d.e_angle[1][j], v.edge[1]) +
                   d.angle_angle[j][j] * v.angle[j] + d.angle_angle[0][1] * v.angle[1 - j];
  }
  return out;
}

Pack product(const EdgeChanges& a, const Vec3<Pack> (&edge)[2], const Pack (&angle)[2]) {
  return dot(a.edge[0], edge[0]) + dot(a.edge[1], edge[1]) + a.angle[0] * angle[0] + a.angle[1] * angle[1];
}

/// Gonzalez's correction with u = G D, D = q1 - q0: adds r u / (u . D) to the gradient, and the symmetric part of what
/// comes of that to the Hessian; u `by_middle`^T is the rest. Where nothing moves there is nothing to correct.
struct Correction {
  EdgeChanges u, by_middle;
  Pack inverse;  ///< 1 / (u . D)
};

template <bool with_matrix>
Correction correct(const EdgeChanges& D, const Pack (&weight)[2], Pack gain, const BendTwistDerivatives<Pack>& end,
                   BendTwistDerivatives<Pack>& d) {
  constexpr double kLeast = 1e-24;
  Correction c;
  for (int k = 0; k < 2; ++k) {
    c.u.edge[k] = weight[k] * D.edge[k];
    c.u.angle[k] = D.angle[k];
  }
  const Pack square = product(c.u, D.edge, D.angle);
  c.inverse = select(square.v > Pack(kLeast).v, 1.0 / larger(square, kLeast), 0.0);
  const Pack share = c.inverse * (gain - product(D, d.gradient_e, d.gradient_angle));
  if constexpr (with_matrix) {
    const EdgeChanges HD = times(d, D);
    for (int k = 0; k < 2; ++k) {
      c.by_middle.edge[k] = c.inverse * (2.0 * (end.gradient_e[k] - d.gradient_e[k]) - HD.edge[k]) -
                            (4.0 * share * c.inverse) * c.u.edge[k];
      c.by_middle.angle[k] = c.inverse * (2.0 * (end.gradient_angle[k] - d.gradient_angle[k]) - HD.angle[k]) -
                             (4.0 * share * c.inverse) * c.u.angle[k];
      add_identity(d.ee[k][k], 2.0 * share * weight[k]);
      d.angle_angle[k][k] += 2.0 * share;
    }
  }
  for (int k = 0; k < 2; ++k) {
    d.gradient_e[k] += share * c.u.edge[k];
    d.gradient_angle[k] += share * c.u.angle[k];
  }
  return c;
}

template <bool with_matrix, bool inner>
[[gnu::flatten]] void momentum_pack(const StencilBatch& batch, const MomentumBatch& step, int first) {
  const Lanes<inner> lanes(batch, first);
  const int live = inner ? kLanes : lanes.live;
  const Vec3<Pack> n = lanes.three(batch.natural, batch.column), k = lanes.three(batch.stiffness, batch.column);
  const Vec3<Pack> s0 = lanes.three(step.start_strain, batch.column);
  const Vec3<Pack> s = lanes.three(batch.strain, batch.column), s1 = lanes.three(step.end_strain, batch.column);
  const EdgeFrame<Pack> g[2] = {frames_of(step.end_frames, lanes.edge[0]), frames_of(step.end_frames, lanes.edge[1])};
  BendTwistDerivatives<Pack> d, end;
  bend_twist_gradient<Pack>(batch.measure, g[0], g[1], {s1.x, s1.y, s1.z}, {n.x, n.y, n.z}, {k.x, k.y, k.z}, end);
  apply_transport_gradient(g[0], g[1], end);
  const EdgeFrame<Pack> f[2] = {frames_of(batch.frames, lanes.edge[0]), frames_of(batch.frames, lanes.edge[1])};
  if constexpr (with_matrix) {
    bend_twist_hessian<Pack>(batch.measure, f[0], f[1], {s.x, s.y, s.z}, {n.x, n.y, n.z}, {k.x, k.y, k.z}, d);
    apply_transport(f[0], f[1], d);
  } else {
    bend_twist_gradient<Pack>(batch.measure, f[0], f[1], {s.x, s.y, s.z}, {n.x, n.y, n.z}, {k.x, k.y, k.z}, d);
    apply_transport_gradient(f[0], f[1], d);
  }

  const Pack start = energy_of(batch.measure, s0, n, k), energy = larger(start, end.energy);
  Pack weight[2];
  for (int j = 0; j < 2; ++j) {
    const Pack inverse = lanes.of_edge(step.inverse_rest, j);
    weight[j] = inverse * inverse;
  }
  const EdgeChanges D = edge_changes(batch, first, step.change);
  const Correction c = correct<with_matrix>(D, weight, end.energy - start, end, d);

  // A strain rounds as positions do, and its moment sqrt(2 K E) makes it an energy: the rounding of the correction.
  const Pack stiffest = larger(k.x, larger(k.y, k.z));
  const Pack rounding = step.rounding * (square_root(2.0 * stiffest * energy) + energy) * c.inverse;
  Pack u[11], floor[11 + kLanes];
  put_changes(u, c.u);
  for (int i = 0; i < 11; ++i) floor[i] = rounding * absolute(u[i]);
  for (int i = 11; i < 11 + kLanes; ++i) floor[i] = 0.0;
  add_vector<Block, 11>(batch, first, live, floor, step.floor);

  Vec3<Pack> mean[2], tension[2];
  for (int j = 0; j < 2; ++j) {
    mean[j] = (lanes.owned[j] * lanes.of_edge(step.inverse_mean, j) / f[j].inverse_length) * f[j].tangent;
    tension[j] = lanes.of_edge(batch.force, j) * mean[j];
  }
  add_forces<true>(batch, first, live, d, tension);
  if constexpr (with_matrix) {
    Pack geometric[2];
    for (int j = 0; j < 2; ++j) {
      geometric[j] = lanes.of_edge(batch.geometric, j) * lanes.of_edge(step.inverse_mean, j);
      add_identity(d.ee[j][j], lanes.owned[j] * geometric[j]);
    }
    Pack H[11][11 + kLanes], by_middle[11];
    for (auto& row : H)
      for (int i = 11; i < 11 + kLanes; ++i) row[i] = 0.0;
    fill(d, H);
    put_changes(by_middle, c.by_middle);
    if (batch.by_rows)
      add_outer_product(H, u, by_middle);
    else
      add_outer_product(H, by_middle, u);
    for (int j = 0; j < 2; ++j) {
      const Vec3<Pack> pull = (lanes.of_edge(batch.modulus, j) - geometric[j]) * g[j].tangent;
      if (batch.by_rows)
        add_edge_product(H, 4 * j, mean[j], pull);
      else
        add_edge_product(H, 4 * j, pull, mean[j]);
    }
    add_lines<Block, false>(batch, first, live, H);
  }
}

template <bool with_matrix>
void momentum_packs(const StencilBatch& batch, const MomentumBatch& step) {
  for (int first = 0; first < batch.count; first += kLanes) {
    if (are_inner(batch, first))
      momentum_pack<with_matrix, true>(batch, step, first);
    else
      momentum_pack<with_matrix, false>(batch, step, first);
  }
}

void momentum_bend(const StencilBatch& batch, const MomentumBatch& step) {
  if (batch.values)
    momentum_packs<true>(batch, step);
  else
    momentum_packs<false>(batch, step);
}

}  // namespace
}  // namespace withe::WITHE_INSTRUCTION_SET
