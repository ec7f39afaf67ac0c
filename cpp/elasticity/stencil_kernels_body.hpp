// The kernels of stencil_kernels.hpp on packs; included once by the translation unit of each instruction set.

#include "common/pack.hpp"
#include "elasticity/bend_planar.hpp"
#include "elasticity/bend_twist.hpp"
#include "elasticity/stencil_kernels.hpp"
#include "elasticity/stretch.hpp"
#include "geometry/frame_kernels.hpp"

namespace withe::WITHE_INSTRUCTION_SET {
namespace {

/// Numbers that travel together to and from memory. Neighbouring stencils overlap by whole blocks of four unknowns
/// (in a plane: two), so reads find what was just written.
constexpr int kBlock = kLanes < 4 ? kLanes : 4;
using Block = double __attribute__((vector_size(8 * kBlock)));
using Pair = double __attribute__((vector_size(16)));

template <class Vector>
void add_to(double* place, Vector v) {
  struct [[gnu::packed, gnu::may_alias]] Anywhere {
    Vector v;
  };
  reinterpret_cast<Anywhere*>(place)->v += v;
}

/// Which rows of the tables one pack of stencils reads. `inner`: kLanes stencils that follow one another.
template <bool inner>
struct Lanes {
  int live, row[kLanes], edge[2][kLanes];
  Pack owned[2];

  Lanes(const StencilBatch& batch, int first)
      : live(inner || batch.count - first > kLanes ? kLanes : batch.count - first) {
    int entry[2][kLanes];
    for (int l = 0; l < kLanes; ++l) {
      const int s = inner || first + l < batch.count ? first + l : batch.count - 1;
      row[l] = inner ? batch.stencil[first] + l : batch.stencil[s];
      for (int k = 0; k < 2; ++k) {
        entry[k][l] = 2 * s + k;
        edge[k][l] = inner ? batch.edges[2 * first + k] + l : batch.edges[2 * s + k];
      }
    }
    for (int k = 0; k < 2; ++k) owned[k] = gather(batch.owned, entry[k]);
  }

  Pack of(const double* table) const { return inner ? load(table + row[0]) : gather(table, row); }
  Pack of_edge(const double* table, int k) const { return inner ? load(table + edge[k][0]) : gather(table, edge[k]); }
  Vec3<Pack> three(const double* table, std::ptrdiff_t column) const {
    return {of(table), of(table + column), of(table + 2 * column)};
  }
};

EdgeFrame<Pack> frames_of(const double* frames, const int (&edge)[kLanes]) {
  const double* place[kLanes];
  for (int l = 0; l < kLanes; ++l) place[l] = frames + std::ptrdiff_t{kFrameNumbers} * edge[l];
  Pack number[kFrameNumbers];
  load_rows<kFrameNumbers>(place, number);
  return {{number[0], number[1], number[2]},    {number[3], number[4], number[5]},
          {number[6], number[7], number[8]},    number[9],
          {number[10], number[11], number[12]}, {number[13], number[14], number[15]}};
}

/// place(lane) += `count` numbers of that lane; `numbers` has zeros beyond its end up to a whole number of packs. Moves
/// in pieces of type Piece.
template <class Piece, int count, class Place>
void add_rows(const Place& place, int live, const Pack* numbers) {
  constexpr int kPiece = sizeof(Piece) / sizeof(double);
  for (int k = 0; k < count; k += kLanes) {
    Pack block[kLanes];
    transpose(numbers + k, block);
    for (int l = 0; l < kLanes; ++l) {
      if (l >= live) break;
      if constexpr (kPiece == kLanes) {
        add_to(place(l) + k, static_cast<Piece>(block[l].v));
      } else {
        static_assert(kLanes == 4 && kPiece == 2);
        add_to(place(l) + k, static_cast<Piece>(__builtin_shufflevector(block[l].v, block[l].v, 0, 1)));
        if (k + kPiece < count)
          add_to(place(l) + k + kPiece, static_cast<Piece>(__builtin_shufflevector(block[l].v, block[l].v, 2, 3)));
      }
    }
  }
}

template <class Piece, bool lower, int kSize, int kWidth, int line = 0>
void add_lines(const StencilBatch& batch, int first, int live, const Pack (&matrix)[kSize][kWidth]) {
  if constexpr (line < kSize) {
    constexpr int kSkipped = lower ? line : 0;
    const std::ptrdiff_t* lines = batch.lines + static_cast<std::ptrdiff_t>(kSize) * first + line;
    add_rows<Piece, kSize - kSkipped>([&](int l) { return batch.values + lines[kSize * l]; }, live,
                                      &matrix[line][kSkipped]);
    add_lines<Piece, lower, kSize, kWidth, line + 1>(batch, first, live, matrix);
  }
}

/// A symmetric matrix [kSize][kSize + zeros] line by line.
template <class Piece, int kSize, int kWidth>
void add_matrix(const StencilBatch& batch, int first, int live, const Pack (&matrix)[kSize][kWidth]) {
  if (batch.lower)
    add_lines<Piece, true>(batch, first, live, matrix);
  else
    add_lines<Piece, false>(batch, first, live, matrix);
}

/// Adds to one number per unknown.
template <class Piece, int count>
void add_vector(const StencilBatch& batch, int first, int live, const Pack* numbers, double* out) {
  const int* unknown = batch.first_unknown + first;
  add_rows<Piece, count>([&](int l) { return out + unknown[l]; }, live, numbers);
}

double sum_of_live(Pack energy, int live) {
  double total = 0.0;
  for (int l = 0; l < live; ++l) total += energy[l];
  return total;
}

void put(Pack* out, const Vec3<Pack>& v) { out[0] = v.x, out[1] = v.y, out[2] = v.z; }
void put_absolute(Pack* out, const Vec3<Pack>& v) {
  out[0] = absolute(v.x), out[1] = absolute(v.y), out[2] = absolute(v.z);
}
void add_absolute(Pack* out, const Vec3<Pack>& v) {
  out[0] += absolute(v.x), out[1] += absolute(v.y), out[2] += absolute(v.z);
}

/// Fills the lower and the upper triangle from the blocks of the two edges and angles.
template <int kWidth>
void fill(const BendTwistDerivatives<Pack>& d, Pack (&H)[11][kWidth]) {
  const Mat3<Pack>&A = d.ee[0][0], &B = d.ee[0][1], &F = d.ee[1][1];
  const auto entry = [](const Mat3<Pack>& m, int i, int j) {
    return j == 0 ? m.row[i].x : j == 1 ? m.row[i].y : m.row[i].z;
  };
  const auto of = [](const Vec3<Pack>& v, int i) { return i == 0 ? v.x : i == 1 ? v.y : v.z; };
  const auto both = [&](int i, int j, Pack value) { H[i][j] = H[j][i] = value; };
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const Pack a = entry(A, i, j), b = entry(B, i, j), f = entry(F, i, j);
      H[i][j] = a;
      H[8 + i][8 + j] = f;
      H[4 + i][4 + j] = (a + f) - (b + entry(B, j, i));
      both(i, 4 + j, b - a);
      both(i, 8 + j, -b);
      both(4 + i, 8 + j, b - f);
    }
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 3; ++i) {
      const Pack g0 = of(d.e_angle[0][j], i), g1 = of(d.e_angle[1][j], i);
      both(i, 3 + 4 * j, -g0);
      both(4 + i, 3 + 4 * j, g0 - g1);
      both(8 + i, 3 + 4 * j, g1);
    }
  H[3][3] = d.angle_angle[0][0];
  H[7][7] = d.angle_angle[1][1];
  both(3, 7, d.angle_angle[0][1]);
}

/// What is wanted of a pack: forces of an explicit step; the gradient and its absolute sums; the matrix with them.
enum class Wanted { forces, gradient, matrix };

/// The forces at their heads by which two edges that spin and turn get their couples.
template <bool inner>
void spin_couples(const StencilBatch& batch, int first, const Lanes<inner>& lanes, const EdgeFrame<Pack>& f0,
                  const EdgeFrame<Pack>& f1, Vec3<Pack> (&out)[2]) {
  const double* place[kLanes];
  for (int l = 0; l < kLanes; ++l)
    place[l] = batch.velocity + batch.first_unknown[first + l < batch.count ? first + l : batch.count - 1];
  const auto numbers_from = [&](int at, Pack* into) {
    const double* from[kLanes];
    for (int l = 0; l < kLanes; ++l) from[l] = place[l] + at;
    load_rows<4>(from, into);
  };
  Pack v[12];  // the last angle comes twice
  numbers_from(0, v);
  numbers_from(4, v + 4);
  numbers_from(7, v + 8);
  const EdgeFrame<Pack>* frame[2] = {&f0, &f1};
  for (int k = 0; k < 2; ++k) {
    const EdgeFrame<Pack>& f = *frame[k];
    const Pack *tail = v + 4 * k, *head = v + (k == 0 ? 4 : 9);
    const Vec3<Pack> rate{head[0] - tail[0], head[1] - tail[1], head[2] - tail[2]};
    const Pack factor = lanes.of_edge(batch.edge_inertia, k) * v[4 * k + 3] * (f.inverse_length * f.inverse_length);
    out[k] = factor * cross(rate, f.tangent);
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
  Pack gradient[11 + kLanes];
  for (int i = 11; i < 11 + kLanes; ++i) gradient[i] = 0.0;
  const Vec3<Pack> bending = d.gradient_e[0] - d.gradient_e[1];
  put(gradient, -(d.gradient_e[0] + tension[0]));
  put(gradient + 4, bending + tension[0] - tension[1]);
  put(gradient + 8, d.gradient_e[1] + tension[1]);
  for (int j = 0; j < 2; ++j) gradient[3 + 4 * j] = d.gradient_angle[j];
  add_vector<Block, 11>(batch, first, live, gradient, batch.residual);
  if constexpr (forces_only) return 0.0;

  Pack magnitude[11 + kLanes];
  for (int i = 11; i < 11 + kLanes; ++i) magnitude[i] = 0.0;
  put_absolute(magnitude, d.gradient_e[0]);
  put_absolute(magnitude + 4, bending);
  put_absolute(magnitude + 8, d.gradient_e[1]);
  add_absolute(magnitude, tension[0]);
  add_absolute(magnitude + 4, tension[0]);
  add_absolute(magnitude + 4, tension[1]);
  add_absolute(magnitude + 8, tension[1]);
  for (int j = 0; j < 2; ++j) magnitude[3 + 4 * j] = absolute(d.gradient_angle[j]);
  add_vector<Block, 11>(batch, first, live, magnitude, batch.magnitude);
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

/// Whether the kLanes stencils from `first` follow one another.
bool are_inner(const StencilBatch& batch, int first) {
  const int last = first + kLanes - 1;
  if (last >= batch.count || batch.stencil[last] != batch.stencil[first] + kLanes - 1) return false;
  for (int k = 0; k < 2; ++k)
    for (int l = 1; l < kLanes; ++l)
      if (batch.edges[2 * (first + l) + k] != batch.edges[2 * first + k] + l) return false;
  return true;
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
const StencilKernels kStencilKernels{bend, planar_bend, bend_forces, planar_bend_forces};

}  // namespace withe::WITHE_INSTRUCTION_SET
