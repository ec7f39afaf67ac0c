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

/// One row of an edge's block, of its force or of its torque: what it says of nodes and angles.
void put_row(Pack (&row)[11], const Vec3<Pack> (&edge)[2], const Pack (&angle)[2]) {
  put(row, -edge[0]);
  put(row + 4, edge[0] - edge[1]);
  put(row + 8, edge[1]);
  row[3] = angle[0];
  row[7] = angle[1];
}

template <bool with_matrix, bool inner>
[[gnu::flatten]] void momentum_pack(const StencilBatch& batch, const MomentumBatch& step, int first) {
  const Lanes<inner> lanes(batch, first);
  const int live = inner ? kLanes : lanes.live;
  const Vec3<Pack> n = lanes.three(batch.natural, batch.column), k = lanes.three(batch.stiffness, batch.column);
  const Vec3<Pack> s0 = lanes.three(step.start_strain, batch.column), s1 = lanes.three(step.end_strain, batch.column);
  const EdgeFrame<Pack> f0[2] = {frames_of(step.start_frames, lanes.edge[0]),
                                 frames_of(step.start_frames, lanes.edge[1])};
  const EdgeFrame<Pack> f1[2] = {frames_of(step.end_frames, lanes.edge[0]), frames_of(step.end_frames, lanes.edge[1])};
  const EdgeFrame<Pack> f[2] = {frames_of(batch.frames, lanes.edge[0]), frames_of(batch.frames, lanes.edge[1])};
  DiscreteMoment<Pack> m;
  discrete_moment<with_matrix>(batch.measure, f0[0], f1[0], f0[1], f1[1], s0, s1, n, k, m);
  const MovingEdge<Pack> edge[2] = {moving_edge(f0[0], f[0], f1[0]), moving_edge(f0[1], f[1], f1[1])};
  const Vec3<Pack> moment[2] = {m.moment, -m.moment};

  BendTwistDerivatives<Pack> d;  // its gradient only
  Vec3<Pack> mean[2], tension[2];
  for (int j = 0; j < 2; ++j) {
    d.gradient_e[j] = edge[j].force(moment[j]);
    d.gradient_angle[j] = edge[j].torque(moment[j]);
    mean[j] = (edge[j].inverse_mean / f[j].inverse_length) * f[j].tangent;
    tension[j] = (lanes.owned[j] * lanes.of_edge(batch.force, j)) * mean[j];
  }
  apply_transport_gradient(f[0], f[1], d);
  add_forces<true>(batch, first, live, d, tension);
  if constexpr (with_matrix) {
    const EdgeColumns<Pack> columns[2] = {edge_columns(m.by_a, f1[0]), edge_columns(m.by_b, f1[1])};
    Pack H[11][11 + kLanes];
    for (int i = 0; i < 11; ++i)
      for (int j = 0; j < 11 + kLanes; ++j) H[i][j] = 0.0;
    const auto add_node_rows = [&](int tail, int i, const Pack(&row)[11]) {
      for (int j = 0; j < 11; ++j) {
        H[tail + i][j] -= row[j];
        H[tail + 4 + i][j] += row[j];
      }
    };
    for (int i = 0; i < 2; ++i) {
      EdgeBlock<Pack> block[2];
      for (int j = 0; j < 2; ++j) block[j] = edge_block(edge[i], i == 0 ? 1.0 : -1.0, columns[j]);
      add_edge_geometry(edge[i], moment[i], block[i]);
      for (EdgeBlock<Pack>& b : block) add_transport(f[i], b);
      add_spin_change(edge[i], f[i], d.gradient_angle[i], block[i]);
      // Changes of the end are twice those of the middle; the mixed method has axial forces of its own.
      const Pack transverse = lanes.owned[i] * (lanes.of_edge(batch.geometric, i) * edge[i].inverse_mean);
      Mat3<Pack> stretching{};
      add_stretch_hessian(mean[i], f1[i].tangent, lanes.owned[i] * lanes.of_edge(batch.modulus, i), transverse,
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
