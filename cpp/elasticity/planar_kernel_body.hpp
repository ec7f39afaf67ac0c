// Bending in a plane, and its discrete gradient, with stretching, on packs; included by stencil_kernels_body.hpp.

#include "elasticity/discrete_planar.hpp"
#include "elasticity/stencil_packs.hpp"
#include "elasticity/stretch.hpp"

namespace withe::WITHE_INSTRUCTION_SET {
namespace {

PlanarEdge<Pack> planar_edges_of(const double* frames, const int (&edge)[kLanes]) {
  const double* place[kLanes];
  for (int l = 0; l < kLanes; ++l) place[l] = frames + std::ptrdiff_t{kFrameNumbers} * edge[l];
  Pack tangent[4];
  load_rows<4>(place, tangent);
  return {{tangent[0], tangent[1]}, gather(frames, edge, kFrameNumbers, kInverseLength)};
}

/// Adds the gradient of a pack of stencils in a plane, with the axial forces of the edges that they own, and its
/// absolute sums.
template <bool with_magnitude>
void add_planar_forces(const StencilBatch& batch, int first, int live, const Vec2<Pack> (&force)[2],
                       const Vec2<Pack> (&tension)[2]) {
  Pack gradient[6 + kLanes], magnitude[6 + kLanes];
  for (int i = 6; i < 6 + kLanes; ++i) gradient[i] = magnitude[i] = 0.0;
  for (int i = 0; i < 2; ++i) {
    const Pack middle = force[0][i] - force[1][i];
    gradient[i] = -(force[0][i] + tension[0][i]);
    gradient[2 + i] = middle + tension[0][i] - tension[1][i];
    gradient[4 + i] = force[1][i] + tension[1][i];
    const Pack pull[2] = {absolute(tension[0][i]), absolute(tension[1][i])};
    magnitude[i] = absolute(force[0][i]) + pull[0];
    magnitude[2 + i] = absolute(middle) + pull[0] + pull[1];
    magnitude[4 + i] = absolute(force[1][i]) + pull[1];
  }
  add_vector<Pair, 6>(batch, first, live, gradient, batch.residual);
  if constexpr (with_magnitude) add_vector<Pair, 6>(batch, first, live, magnitude, batch.magnitude);
}

template <Wanted wanted, bool inner>
[[gnu::flatten]] double planar_pack(const StencilBatch& batch, int first) {
  constexpr bool with_matrix = wanted == Wanted::matrix;
  const Lanes<inner> lanes(batch, first);
  const int live = inner ? kLanes : lanes.live;
  const PlanarBend<Pack> p =
      withe::planar_bend(batch.measure, lanes.of(batch.strain), lanes.of(batch.natural), lanes.of(batch.stiffness));
  const PlanarEdge<Pack> edge[2] = {planar_edges_of(batch.frames, lanes.edge[0]),
                                    planar_edges_of(batch.frames, lanes.edge[1])};
  PlanarForces<Pack> f;
  withe::planar_bend_forces<with_matrix>(p, edge, f);
  Vec2<Pack> tension[2];
  for (int j = 0; j < 2; ++j) tension[j] = (lanes.owned[j] * lanes.of_edge(batch.force, j)) * edge[j].tangent;
  add_planar_forces<wanted != Wanted::forces>(batch, first, live, f.force, tension);
  if constexpr (with_matrix) {
    for (int j = 0; j < 2; ++j) {
      const Pack transverse = lanes.owned[j] * (lanes.of_edge(batch.geometric, j) * edge[j].inverse_length);
      add_stretch_hessian(edge[j].tangent, edge[j].tangent, lanes.owned[j] * lanes.of_edge(batch.modulus, j),
                          transverse, f.by[j][j]);
    }
    Pack H[6][6 + kLanes];
    for (auto& row : H)
      for (int i = 6; i < 6 + kLanes; ++i) row[i] = 0.0;
    put_planar_matrix(f, H);
    add_matrix<Pair>(batch, first, live, H);
  }
  return sum_of_live(p.energy, live);
}

template <bool with_matrix, bool inner>
[[gnu::flatten]] void planar_momentum_pack(const StencilBatch& batch, const MomentumBatch& step, int first) {
  const Lanes<inner> lanes(batch, first);
  const int live = inner ? kLanes : lanes.live;
  PlanarEdge<Pack> start[2], middle[2], end[2];
  for (int j = 0; j < 2; ++j) {
    start[j] = planar_edges_of(step.start_frames, lanes.edge[j]);
    middle[j] = planar_edges_of(batch.frames, lanes.edge[j]);
    end[j] = planar_edges_of(step.end_frames, lanes.edge[j]);
  }
  const PlanarMoment<Pack> m = planar_moment(batch.measure, start[0].tangent, end[0].tangent, start[1].tangent,
                                             end[1].tangent, lanes.of(step.start_strain), lanes.of(step.end_strain),
                                             lanes.of(batch.natural), lanes.of(batch.stiffness));
  const PlanarMovingEdge<Pack> edge[2] = {{start[0], middle[0], end[0]}, {start[1], middle[1], end[1]}};
  PlanarForces<Pack> f;
  planar_discrete_forces<with_matrix>(m, edge, f);
  Vec2<Pack> mean[2], tension[2];
  for (int j = 0; j < 2; ++j) {
    mean[j] = (edge[j].inverse_mean / middle[j].inverse_length) * middle[j].tangent;
    tension[j] = (lanes.owned[j] * lanes.of_edge(batch.force, j)) * mean[j];
  }
  add_planar_forces<true>(batch, first, live, f.force, tension);
  if constexpr (with_matrix) {
    for (int j = 0; j < 2; ++j) {
      const Pack transverse = lanes.owned[j] * (lanes.of_edge(batch.geometric, j) * edge[j].inverse_mean);
      add_stretch_hessian(mean[j], end[j].tangent, lanes.owned[j] * lanes.of_edge(batch.modulus, j), transverse,
                          f.by[j][j]);
    }
    Pack H[6][6 + kLanes];
    for (auto& row : H)
      for (int i = 6; i < 6 + kLanes; ++i) row[i] = 0.0;
    put_planar_matrix(f, H);
    if (!batch.by_rows) exchange_triangles(H);
    add_lines<Pair, false>(batch, first, live, H);
  }
}

template <Wanted wanted>
double planar_packs(const StencilBatch& batch) {
  double energy = 0.0;
  for (int first = 0; first < batch.count; first += kLanes)
    energy +=
        are_inner(batch, first) ? planar_pack<wanted, true>(batch, first) : planar_pack<wanted, false>(batch, first);
  return energy;
}

template <bool with_matrix>
void planar_momentum_packs(const StencilBatch& batch, const MomentumBatch& step) {
  for (int first = 0; first < batch.count; first += kLanes) {
    if (are_inner(batch, first))
      planar_momentum_pack<with_matrix, true>(batch, step, first);
    else
      planar_momentum_pack<with_matrix, false>(batch, step, first);
  }
}

double planar_bend(const StencilBatch& batch) {
  return batch.values ? planar_packs<Wanted::matrix>(batch) : planar_packs<Wanted::gradient>(batch);
}
void planar_bend_forces(const StencilBatch& batch) { planar_packs<Wanted::forces>(batch); }
void planar_momentum_bend(const StencilBatch& batch, const MomentumBatch& step) {
  if (batch.values)
    planar_momentum_packs<true>(batch, step);
  else
    planar_momentum_packs<false>(batch, step);
}

}  // namespace
}  // namespace withe::WITHE_INSTRUCTION_SET
