#pragma once
// The discrete gradient of bending and twisting in space, and of stretching, on packs; included by
// stencil_kernels_body.hpp.

#include "elasticity/discrete_gradient.hpp"
#include "elasticity/stencil_packs.hpp"
#include "elasticity/stretch.hpp"

namespace withe::WITHE_INSTRUCTION_SET {

// Found by its argument's namespace, so in no other.
inline TurnOverSine<Pack> turn_over_sine(Pack x, Pack sine, Pack cosine) {
  const Pack square = x * x;
  const auto small = static_cast<Pack::Integers>(square.v < Pack(1e-4).v);
  const Pack safe = select(small, 1.0, sine);
  return {select(small, 1.0 + square * (1.0 / 6.0 + 7.0 / 360.0 * square), x / safe),
          select(small, x * (1.0 / 3.0 + 7.0 / 90.0 * square), (sine - x * cosine) / (safe * safe))};
}

namespace {

MovingEdge<Pack> moving_edge(const EdgeFrame<Pack>& start, const EdgeFrame<Pack>& middle, const EdgeFrame<Pack>& end) {
  return {start.tangent,         start.inverse_length,         end.tangent, end.inverse_length, middle.tangent,
          middle.inverse_length, turn_of_directors(start, end)};
}

/// One row of the block of an edge, of its force or of its torque: its entries for nodes and angles.
void put_row(Pack (&row)[11], const Vec3<Pack> (&edge)[2], const Pack (&angle)[2]) {
  put(row, -edge[0]);
  put(row + 4, edge[0] - edge[1]);
  put(row + 8, edge[1]);
  row[3] = angle[0];
  row[7] = angle[1];
}

/// Frames of a step, per edge of a stencil.
template <bool inner>
struct MomentumFrames {
  EdgeFrame<Pack> start[2], middle[2], end[2];

  MomentumFrames(const StencilBatch& batch, const MomentumBatch& step, const Lanes<inner>& lanes)
      : start{frames_of(step.start_frames, lanes.edge[0]), frames_of(step.start_frames, lanes.edge[1])},
        middle{frames_of(batch.frames, lanes.edge[0]), frames_of(batch.frames, lanes.edge[1])},
        end{frames_of(step.end_frames, lanes.edge[0]), frames_of(step.end_frames, lanes.edge[1])} {}

  MovingEdge<Pack> moving(int j) const { return moving_edge(start[j], middle[j], end[j]); }
};

/// Moment between the two frames of a stencil, and the resulting forces on its edges.
template <bool inner>
struct MomentumForces {
  MomentumFrames<inner> frames;
  DiscreteMoment<Pack> m;
  MovingEdge<Pack> edge[2];
  Vec3<Pack> moment[2], mean[2];
  BendTwistDerivatives<Pack> d;  ///< its gradient only
};

template <bool with_matrix, bool inner>
MomentumForces<inner> momentum_forces(const StencilBatch& batch, const MomentumBatch& step, const Lanes<inner>& lanes) {
  const Vec3<Pack> n = lanes.three(batch.natural, batch.column), k = lanes.three(batch.stiffness, batch.column);
  const Vec3<Pack> s0 = lanes.three(step.start_strain, batch.column), s1 = lanes.three(step.end_strain, batch.column);
  const MomentumFrames<inner> f(batch, step, lanes);
  DiscreteMoment<Pack> m;
  discrete_moment<with_matrix>(batch.measure, f.start[0], f.end[0], f.start[1], f.end[1], s0, s1, n, k, m);
  MomentumForces<inner> out{f, m, {f.moving(0), f.moving(1)}, {m.moment, -m.moment}, {}, {}};
  for (int j = 0; j < 2; ++j) {
    out.d.gradient_e[j] = out.edge[j].force(out.moment[j]);
    out.d.gradient_angle[j] = out.edge[j].torque(out.moment[j]);
    out.mean[j] = (out.edge[j].inverse_mean / f.middle[j].inverse_length) * f.middle[j].tangent;
  }
  return out;
}

/// Derivatives by the middle. The end moves twice as far as the middle. `transported`: see DiscreteStep.
template <bool transported, bool inner>
void momentum_matrix(const StencilBatch& batch, const MomentumForces<inner>& forces, const Lanes<inner>& lanes,
                     Pack (&H)[11][11 + kLanes]) {
  const MomentumFrames<inner>& f = forces.frames;
  const MovingEdge<Pack>(&edge)[2] = forces.edge;
  const EdgeColumns<Pack> columns[2] = {edge_columns(forces.m.by_a, f.end[0]), edge_columns(forces.m.by_b, f.end[1])};
  for (auto& row : H)
    for (Pack& entry : row) entry = 0.0;
  const auto add_node_rows = [&](int tail, int i, const Pack(&row)[11]) {
    for (int j = 0; j < 11; ++j) {
      H[tail + i][j] -= row[j];
      H[tail + 4 + i][j] += row[j];
    }
  };
  for (int i = 0; i < 2; ++i) {
    EdgeBlock<Pack> block[2];
    for (int j = 0; j < 2; ++j) block[j] = edge_block(edge[i], i == 0 ? 1.0 : -1.0, columns[j]);
    add_edge_geometry(edge[i], forces.moment[i], block[i]);
    if constexpr (transported) {
      for (EdgeBlock<Pack>& b : block) add_transport(f.middle[i], b);
      add_spin_change(edge[i], f.middle[i], forces.d.gradient_angle[i], block[i]);
    }
    // The end moves twice as far as the middle. The mixed method has its own axial forces.
    const Pack transverse = lanes.owned[i] * (lanes.of_edge(batch.geometric, i) * edge[i].inverse_mean);
    Mat3<Pack> stretching{};
    add_stretch_hessian(forces.mean[i], f.end[i].tangent, lanes.owned[i] * lanes.of_edge(batch.modulus, i), transverse,
                        stretching);
    Pack row[11];
    for (int r = 0; r < 3; ++r) {
      Vec3<Pack> by_edge[2] = {2.0 * block[0].ee.row[r], 2.0 * block[1].ee.row[r]};
      by_edge[i] += stretching.row[r];
      const Pack by_angle[2] = {2.0 * block[0].e_angle[r], 2.0 * block[1].e_angle[r]};
      put_row(row, by_edge, by_angle);
      add_node_rows(4 * i, r, row);
    }
    const Vec3<Pack> by_edge[2] = {2.0 * block[0].angle_e, 2.0 * block[1].angle_e};
    const Pack by_angle[2] = {2.0 * block[0].angle_angle, 2.0 * block[1].angle_angle};
    put_row(row, by_edge, by_angle);
    for (int j = 0; j < 11; ++j) H[3 + 4 * i][j] = row[j];
  }
}

template <bool with_matrix, bool inner>
[[gnu::flatten]] void momentum_pack(const StencilBatch& batch, const MomentumBatch& step, int first) {
  const Lanes<inner> lanes(batch, first);
  const int live = inner ? kLanes : lanes.live;
  MomentumForces<inner> forces = momentum_forces<with_matrix>(batch, step, lanes);
  Vec3<Pack> tension[2];
  for (int j = 0; j < 2; ++j) tension[j] = (lanes.owned[j] * lanes.of_edge(batch.force, j)) * forces.mean[j];
  apply_transport_gradient(forces.frames.middle[0], forces.frames.middle[1], forces.d);
  add_forces<true>(batch, first, live, forces.d, tension);
  if constexpr (with_matrix) {
    Pack H[11][11 + kLanes];
    momentum_matrix<true>(batch, forces, lanes, H);
    if (!batch.by_rows) exchange_triangles(H);
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
