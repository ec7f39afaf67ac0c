// The kernels of stencil_kernels.hpp on packs; included once by the translation unit of each instruction set.

#include "elasticity/bend_planar.hpp"
#include "elasticity/momentum_kernel_body.hpp"
#include "elasticity/stencil_packs.hpp"

namespace withe::WITHE_INSTRUCTION_SET {
namespace {

/// The forces at their heads by which two edges that spin and turn get their couples.
template <bool inner>
void spin_couples(const StencilBatch& batch, int first, const Lanes<inner>& lanes, const EdgeFrame<Pack>& f0,
                  const EdgeFrame<Pack>& f1, Vec3<Pack> (&out)[2]) {
  const EdgeChanges rate = edge_changes(batch, first, batch.velocity);
  const EdgeFrame<Pack>* frame[2] = {&f0, &f1};
  for (int k = 0; k < 2; ++k) {
    const EdgeFrame<Pack>& f = *frame[k];
    const Pack factor = lanes.of_edge(batch.edge_inertia, k) * rate.angle[k] * (f.inverse_length * f.inverse_length);
    out[k] = factor * cross(rate.edge[k], f.tangent);
  }
}

/// The pack of stencils from number `first`; everything within is inlined. Returns their energy.
template <Wanted wanted, bool inner>
[[gnu::flatten]] double bend_pack(const StencilBatch& batch, int first) {
  constexpr bool with_matrix = wanted == Wanted::matrix, forces_only = wanted == Wanted::forces;
  const Lanes<inner> lanes(batch, first);
  const int live = inner ? kLanes : lanes.live;
  const EdgeFrame<Pack> f0 = frames_of(batch.frames, lanes.edge[0]), f1 = frames_of(batch.frames, lanes.edge[1]);
  const Vec3<Pack> s = lanes.three(batch.strain, batch.column), n = lanes.three(batch.natural, batch.column);
  const Vec3<Pack> k = lanes.three(batch.stiffness, batch.column);
  BendTwistDerivatives<Pack> d;
  if constexpr (with_matrix) {
    bend_twist_hessian<Pack>(batch.measure, f0, f1, {s.x, s.y, s.z}, {n.x, n.y, n.z}, {k.x, k.y, k.z}, d);
    apply_transport(f0, f1, d);
  } else {
    bend_twist_gradient<Pack>(batch.measure, f0, f1, {s.x, s.y, s.z}, {n.x, n.y, n.z}, {k.x, k.y, k.z}, d);
    if constexpr (!forces_only) apply_transport_gradient(f0, f1, d);
  }

  Vec3<Pack> tension[2] = {lanes.of_edge(batch.force, 0) * f0.tangent, lanes.of_edge(batch.force, 1) * f1.tangent};
  if constexpr (forces_only) {
    Vec3<Pack> couple[2];
    spin_couples(batch, first, lanes, f0, f1, couple);
    for (int j = 0; j < 2; ++j) tension[j] += couple[j];
  }
  for (int j = 0; j < 2; ++j) tension[j] = lanes.owned[j] * tension[j];
  add_forces<!forces_only>(batch, first, live, d, tension);
  if constexpr (forces_only) return 0.0;

  if constexpr (with_matrix) {
    for (int j = 0; j < 2; ++j) {
      const EdgeFrame<Pack>& f = j == 0 ? f0 : f1;
      const Pack g = lanes.owned[j] * (lanes.of_edge(batch.geometric, j) * f.inverse_length);
      add_identity(d.ee[j][j], g);
      add_outer(d.ee[j][j], lanes.owned[j] * lanes.of_edge(batch.modulus, j) - g, f.tangent, f.tangent);
    }
    Pack H[11][11 + kLanes];
    for (auto& row : H)
      for (int i = 11; i < 11 + kLanes; ++i) row[i] = 0.0;
    fill(d, H);
    add_matrix<Block>(batch, first, live, H);
  }
  return sum_of_live(d.energy, live);
}

template <Wanted wanted, bool inner>
[[gnu::flatten]] double planar_pack(const StencilBatch& batch, int first) {
  const Lanes<inner> lanes(batch, first);
  const int live = inner ? kLanes : lanes.live;
  const PlanarBend<Pack> p =
      withe::planar_bend(batch.measure, lanes.of(batch.strain), lanes.of(batch.natural), lanes.of(batch.stiffness));
  // phi = angle(e1) - angle(e0): an edge's angle has the gradient n = (-ty, tx) / l and the Hessian
  // -(t n^T + n t^T) / l.
  Pack tx[2], ty[2], nx[2], ny[2], inverse[2], fx[2], fy[2];
  for (int j = 0; j < 2; ++j) {
    tx[j] = gather(batch.frames, lanes.edge[j], kFrameNumbers, 0);
    ty[j] = gather(batch.frames, lanes.edge[j], kFrameNumbers, 1);
    inverse[j] = gather(batch.frames, lanes.edge[j], kFrameNumbers, kInverseLength);
    nx[j] = -(ty[j] * inverse[j]);
    ny[j] = tx[j] * inverse[j];
    const Pack force = lanes.owned[j] * lanes.of_edge(batch.force, j);
    fx[j] = force * tx[j], fy[j] = force * ty[j];
  }
  const Pack m = p.slope;
  const Pack turn[6] = {nx[0], ny[0], -(nx[0] + nx[1]), -(ny[0] + ny[1]), nx[1], ny[1]};
  const Pack pull[6] = {-fx[0], -fy[0], fx[0] - fx[1], fy[0] - fy[1], fx[1], fy[1]};
  Pack gradient[6 + kLanes];
  for (int i = 6; i < 6 + kLanes; ++i) gradient[i] = 0.0;
  for (int i = 0; i < 6; ++i) gradient[i] = m * turn[i] + pull[i];
  add_vector<Pair, 6>(batch, first, live, gradient, batch.residual);
  if constexpr (wanted == Wanted::forces) return 0.0;

  Pack magnitude[6 + kLanes];
  for (int i = 6; i < 6 + kLanes; ++i) magnitude[i] = 0.0;
  for (int i = 0; i < 6; ++i) magnitude[i] = absolute(m * turn[i]);
  magnitude[0] += absolute(fx[0]), magnitude[1] += absolute(fy[0]);
  magnitude[2] += absolute(fx[0]) + absolute(fx[1]), magnitude[3] += absolute(fy[0]) + absolute(fy[1]);
  magnitude[4] += absolute(fx[1]), magnitude[5] += absolute(fy[1]);
  add_vector<Pair, 6>(batch, first, live, magnitude, batch.magnitude);
  if constexpr (wanted == Wanted::matrix) {
    // Blocks of the two edge vectors: xx, xy, yy.
    Pack E[2][3];
    for (int j = 0; j < 2; ++j) {
      const Pack g = lanes.owned[j] * (lanes.of_edge(batch.geometric, j) * inverse[j]);
      const Pack axial = lanes.owned[j] * lanes.of_edge(batch.modulus, j) - g;
      const Pack w = (j == 0 ? m : -m) * inverse[j];
      E[j][0] = g + axial * (tx[j] * tx[j]) + (2.0 * w) * (tx[j] * nx[j]);
      E[j][1] = axial * (tx[j] * ty[j]) + w * (tx[j] * ny[j] + nx[j] * ty[j]);
      E[j][2] = g + axial * (ty[j] * ty[j]) + (2.0 * w) * (ty[j] * ny[j]);
    }
    Pack H[6][6 + kLanes];
    for (auto& row : H)
      for (int i = 6; i < 6 + kLanes; ++i) row[i] = 0.0;
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j <= i; ++j) {
        Pack h = p.curvature * (turn[i] * turn[j]);
        const int part = i % 2 + j % 2, a = i / 2, b = j / 2;  // nodes of the row and of the column
        if (a == b && a < 2) h += E[0][part];
        if (a == b && a > 0) h += E[1][part];
        if (a == b + 1) h -= E[b][part];
        H[i][j] = H[j][i] = h;
      }
    add_matrix<Pair>(batch, first, live, H);
  }
  return sum_of_live(p.energy, live);
}

template <Wanted wanted>
double bend_packs(const StencilBatch& batch) {
  double energy = 0.0;
  for (int first = 0; first < batch.count; first += kLanes)
    energy += are_inner(batch, first) ? bend_pack<wanted, true>(batch, first) : bend_pack<wanted, false>(batch, first);
  return energy;
}
template <Wanted wanted>
double planar_packs(const StencilBatch& batch) {
  double energy = 0.0;
  for (int first = 0; first < batch.count; first += kLanes)
    energy +=
        are_inner(batch, first) ? planar_pack<wanted, true>(batch, first) : planar_pack<wanted, false>(batch, first);
  return energy;
}

double bend(const StencilBatch& batch) {
  return batch.values ? bend_packs<Wanted::matrix>(batch) : bend_packs<Wanted::gradient>(batch);
}
double planar_bend(const StencilBatch& batch) {
  return batch.values ? planar_packs<Wanted::matrix>(batch) : planar_packs<Wanted::gradient>(batch);
}
void bend_forces(const StencilBatch& batch) { bend_packs<Wanted::forces>(batch); }
void planar_bend_forces(const StencilBatch& batch) { planar_packs<Wanted::forces>(batch); }

}  // namespace

extern const StencilKernels kStencilKernels;
const StencilKernels kStencilKernels{bend, planar_bend, bend_forces, planar_bend_forces, momentum_bend};

}  // namespace withe::WITHE_INSTRUCTION_SET
