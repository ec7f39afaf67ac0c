// The kernels of stencil_kernels.hpp on packs; included once by the translation unit of each instruction set.

#include "elasticity/adjoint_kernel_body.hpp"
#include "elasticity/momentum_kernel_body.hpp"
#include "elasticity/planar_kernel_body.hpp"
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
      const Pack transverse = lanes.owned[j] * (lanes.of_edge(batch.geometric, j) * f.inverse_length);
      add_stretch_hessian(f.tangent, f.tangent, lanes.owned[j] * lanes.of_edge(batch.modulus, j), transverse,
                          d.ee[j][j]);
    }
    Pack H[11][11 + kLanes];
    for (auto& row : H)
      for (int i = 11; i < 11 + kLanes; ++i) row[i] = 0.0;
    put_bend_twist_matrix(d, H);
    add_matrix<Block>(batch, first, live, H);
  }
  return sum_of_live(d.energy, live);
}

template <Wanted wanted>
double bend_packs(const StencilBatch& batch) {
  double energy = 0.0;
  for (int first = 0; first < batch.count; first += kLanes)
    energy += are_inner(batch, first) ? bend_pack<wanted, true>(batch, first) : bend_pack<wanted, false>(batch, first);
  return energy;
}

double bend(const StencilBatch& batch) {
  return batch.values ? bend_packs<Wanted::matrix>(batch) : bend_packs<Wanted::gradient>(batch);
}
void bend_forces(const StencilBatch& batch) { bend_packs<Wanted::forces>(batch); }

}  // namespace

extern const StencilKernels kStencilKernels;
const StencilKernels kStencilKernels{
    bend,           planar_bend, bend_forces,      planar_bend_forces, momentum_bend, planar_momentum_bend,
    strain_changes, rate_slopes, momentum_changes, momentum_product};

}  // namespace withe::WITHE_INSTRUCTION_SET
