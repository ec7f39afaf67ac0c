// Kernels for gradients of ordinary stencils in space, on packs: changes of strains, the rates' part of an exact
// matrix, and products of a matrix that nobody needs whole; included by stencil_kernels_body.hpp.

#include "elasticity/momentum_kernel_body.hpp"

namespace withe::WITHE_INSTRUCTION_SET {
namespace {

/// The gradients of the strains f (kappa1, kappa2, tau), by edges' vectors and angles; see bend_twist_gradient.
struct StrainRows {
  Vec3<Pack> edge[3][2];
  Pack angle[3][2];

  StrainRows(const BendMeasure& measure, const EdgeFrame<Pack>& f0, const EdgeFrame<Pack>& f1, const Vec3<Pack>& s) {
    const Pack inverse_chi = 1.0 / (1.0 + dot(f0.tangent, f1.tangent));
    const HalfTwist<Pack> half = half_twist(s.z);
    const Vec2<Pack> kappa = half.to_first({s.x, s.y});
    const Vec3<Pack> kb = (2.0 * inverse_chi) * cross(f0.tangent, f1.tangent);
    const Vec3<Pack> t = inverse_chi * (f0.tangent + f1.tangent);
    const Vec3<Pack> a[2] = {(2.0 * inverse_chi) * f0.d2, (-2.0 * inverse_chi) * f0.d1};
    for (int k = 0; k < 2; ++k) {
      const Vec3<Pack> shortened = (k == 0 ? kappa.x : kappa.y) * t;
      edge[k][0] = f0.inverse_length * (cross(f1.tangent, a[k]) - shortened);
      edge[k][1] = -(f1.inverse_length * (cross(f0.tangent, a[k]) + shortened));
      angle[k][0] = -dot(kb, k == 0 ? f0.d1 : f0.d2);
      angle[k][1] = 0.0;
    }
    edge[2][0] = (0.5 * f0.inverse_length) * kb;
    edge[2][1] = (0.5 * f1.inverse_length) * kb;
    angle[2][0] = -1.0;
    angle[2][1] = 1.0;
    const auto halfway = [&half, &s](auto& first, auto& second, const auto& twist) {
      const auto along = half.cosine * first + half.sine * second;
      second = half.cosine * second - half.sine * first - (0.5 * s.x) * twist;
      first = along + (0.5 * s.y) * twist;
    };
    for (int j = 0; j < 2; ++j) {
      halfway(edge[0][j], edge[1][j], edge[2][j]);
      halfway(angle[0][j], angle[1][j], angle[2][j]);
    }
    apply_measure(measure, s);
    for (int k = 0; k < 3; ++k) {
      edge[k][0] += angle[k][0] * f0.spin;
      edge[k][1] += angle[k][1] * f1.spin;
    }
  }

  Pack along(int k, const EdgeChanges& by) const {
    return dot(edge[k][0], by.edge[0]) + dot(edge[k][1], by.edge[1]) + angle[k][0] * by.angle[0] +
           angle[k][1] * by.angle[1];
  }

  void put(int k, Pack (&row)[11]) const { put_row(row, edge[k], angle[k]); }

 private:
  void apply_measure(const BendMeasure& measure, const Vec3<Pack>& s) {
    const BendFactor<Pack> f = bend_factor(measure, s.x * s.x + s.y * s.y);
    const Pack bent = 2.0 * f.first;
    for (int j = 0; j < 2; ++j) {
      const Vec3<Pack> by_edge = bent * (s.x * edge[0][j] + s.y * edge[1][j]);
      const Pack by_angle = bent * (s.x * angle[0][j] + s.y * angle[1][j]);
      for (int k = 0; k < 3; ++k) {
        edge[k][j] = f.value * edge[k][j] + s[k] * by_edge;
        angle[k][j] = f.value * angle[k][j] + s[k] * by_angle;
      }
    }
  }
};

template <bool inner>
void put_columns(const Lanes<inner>& lanes, int live, const Pack (&numbers)[3], std::ptrdiff_t column, double* out) {
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < live; ++l) out[k * column + lanes.row[l]] = numbers[k][l];
}

template <bool inner>
[[gnu::flatten]] void change_pack(const StencilBatch& batch, const double* change, double* out, int first) {
  const Lanes<inner> lanes(batch, first);
  const StrainRows rows(batch.measure, frames_of(batch.frames, lanes.edge[0]), frames_of(batch.frames, lanes.edge[1]),
                        lanes.three(batch.strain, batch.column));
  const EdgeChanges by = edge_changes(batch, first, change);
  put_columns(lanes, inner ? kLanes : lanes.live, {rows.along(0, by), rows.along(1, by), rows.along(2, by)},
              batch.column, out);
}

void strain_changes(const StencilBatch& batch, const double* change, double* out) {
  for (int first = 0; first < batch.count; first += kLanes)
    are_inner(batch, first) ? change_pack<true>(batch, change, out, first)
                            : change_pack<false>(batch, change, out, first);
}

template <bool inner>
[[gnu::flatten]] void rate_pack(const StencilBatch& batch, const MomentumBatch& step, int first) {
  const Lanes<inner> lanes(batch, first);
  const StrainRows middle(batch.measure, frames_of(batch.frames, lanes.edge[0]), frames_of(batch.frames, lanes.edge[1]),
                          lanes.three(batch.strain, batch.column));
  const StrainRows end(batch.measure, frames_of(step.end_frames, lanes.edge[0]),
                       frames_of(step.end_frames, lanes.edge[1]), lanes.three(step.end_strain, batch.column));
  const Vec3<Pack> stiffness = lanes.three(batch.stiffness, batch.column);
  Pack H[11][11 + kLanes];
  for (auto& row : H)
    for (Pack& entry : row) entry = 0.0;
  for (int k = 0; k < 3; ++k) {
    Pack force[11], apart[11];
    middle.put(k, force);
    end.put(k, apart);
    for (int i = 0; i < 11; ++i) apart[i] -= force[i];
    for (int i = 0; i < 11; ++i) {
      const Pack push = stiffness[k] * force[i];
      for (int j = 0; j < 11; ++j) H[i][j] += push * apart[j];
    }
  }
  if (!batch.by_rows) exchange_triangles(H);
  add_lines<Block, false>(batch, first, inner ? kLanes : lanes.live, H);
}

void rate_slopes(const StencilBatch& batch, const MomentumBatch& step) {
  for (int first = 0; first < batch.count; first += kLanes)
    are_inner(batch, first) ? rate_pack<true>(batch, step, first) : rate_pack<false>(batch, step, first);
}

/// rows^T times the derivatives by the end of the step. They are half of the derivatives by the middle.
template <bool inner>
[[gnu::flatten]] void momentum_product_pack(const StencilBatch& batch, const MomentumBatch& step, const double* rows,
                                            double* out, int first) {
  const Lanes<inner> lanes(batch, first);
  Pack H[11][11 + kLanes];
  momentum_matrix<false>(batch, momentum_forces<true>(batch, step, lanes), lanes, H);
  Pack by[12];
  load_unknowns(batch, first, rows, by);
  Pack product[11 + kLanes];
  for (Pack& entry : product) entry = 0.0;
  for (int i = 0; i < 11; ++i) {
    const Pack half = 0.5 * by[i < 8 ? i : i + 1];
    for (int j = 0; j < 11; ++j) product[j] += half * H[i][j];
  }
  add_vector<Block, 11>(batch, first, inner ? kLanes : lanes.live, product, out);
}

void momentum_product(const StencilBatch& batch, const MomentumBatch& step, const double* rows, double* out) {
  for (int first = 0; first < batch.count; first += kLanes)
    are_inner(batch, first) ? momentum_product_pack<true>(batch, step, rows, out, first)
                            : momentum_product_pack<false>(batch, step, rows, out, first);
}

/// Moments are linear in K_i (mean strain_i - n_i). Returns rows^T times the forces of one of these, with the others
/// zero.
template <bool inner>
[[gnu::flatten]] void momentum_change_pack(const StencilBatch& batch, const MomentumBatch& step, const double* rows,
                                           double* out, int first) {
  const Lanes<inner> lanes(batch, first);
  const Vec3<Pack> s0 = lanes.three(step.start_strain, batch.column), s1 = lanes.three(step.end_strain, batch.column);
  const MomentumFrames<inner> f(batch, step, lanes);
  const MovingEdge<Pack> edge[2] = {f.moving(0), f.moving(1)};
  const EdgeChanges by = edge_changes(batch, first, rows);
  // The work of a moment m is m . turned.
  Vec3<Pack> turned{0.0, 0.0, 0.0};
  for (int j = 0; j < 2; ++j) {
    const MovingEdge<Pack>& e = edge[j];
    const Vec3<Pack> turn =
        e.inverse_length * cross(e.t, by.edge[j]) + dot(e.t, by.edge[j]) * e.zeta + by.angle[j] * e.t;
    turned += j == 0 ? turn : -turn;
  }
  // Without a measure moments are K (mean strain - n) themselves.
  constexpr BendMeasure kPlain{0.0, 0.0};
  const Vec3<Pack> natural{0.5 * (s0.x + s1.x) - 1.0, 0.5 * (s0.y + s1.y) - 1.0, 0.5 * (s0.z + s1.z) - 1.0};
  Pack along[3];
  for (int k = 0; k < 3; ++k) {
    const Vec3<Pack> unit{k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0};
    DiscreteMoment<Pack> m;
    discrete_moment<false>(kPlain, f.start[0], f.end[0], f.start[1], f.end[1], s0, s1, natural, unit, m);
    along[k] = dot(m.moment, turned);
  }
  // As divided_moments makes moments of these.
  const BendMeasure& measure = batch.measure;
  const Pack x0 = s0.x * s0.x + s0.y * s0.y, x1 = s1.x * s1.x + s1.y * s1.y;
  const Pack f_mean = 0.5 * (bend_factor(measure, x0).value + bend_factor(measure, x1).value);
  const Pack divided = (measure.a - measure.b) / ((1.0 + measure.b * x0) * (1.0 + measure.b * x1));
  const Pack u[3] = {0.5 * (s0.x + s1.x), 0.5 * (s0.y + s1.y), 0.5 * (s0.z + s1.z)};
  const Pack pulled = 2.0 * (divided * (along[0] * u[0] + along[1] * u[1]));
  put_columns(lanes, inner ? kLanes : lanes.live,
              {f_mean * along[0] + pulled * u[0], f_mean * along[1] + pulled * u[1], f_mean * along[2] + pulled * u[2]},
              batch.column, out);
}

void momentum_changes(const StencilBatch& batch, const MomentumBatch& step, const double* rows, double* out) {
  for (int first = 0; first < batch.count; first += kLanes)
    are_inner(batch, first) ? momentum_change_pack<true>(batch, step, rows, out, first)
                            : momentum_change_pack<false>(batch, step, rows, out, first);
}

}  // namespace
}  // namespace withe::WITHE_INSTRUCTION_SET
