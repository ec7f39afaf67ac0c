#pragma once
// Packs of stencils: reading of their data and adding of their results. Only the kernels of stencil_kernels.hpp include
// this file.

#include "common/pack.hpp"
#include "elasticity/bend_twist.hpp"
#include "elasticity/stencil_kernels.hpp"
#include "geometry/frame_packs.hpp"

namespace withe::WITHE_INSTRUCTION_SET {
namespace {

/// Numbers that are read and written together. Neighbouring stencils overlap by whole blocks of four unknowns
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

/// For a matrix that is kept by columns.
template <int kSize, int kWidth>
void exchange_triangles(Pack (&matrix)[kSize][kWidth]) {
  for (int i = 0; i < kSize; ++i)
    for (int j = 0; j < i; ++j) {
      const Pack swapped = matrix[i][j];
      matrix[i][j] = matrix[j][i];
      matrix[j][i] = swapped;
    }
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

/// True if the kLanes stencils from `first` follow one another.
bool are_inner(const StencilBatch& batch, int first) {
  const int last = first + kLanes - 1;
  if (last >= batch.count || batch.stencil[last] != batch.stencil[first] + kLanes - 1) return false;
  for (int k = 0; k < 2; ++k)
    for (int l = 1; l < kLanes; ++l)
      if (batch.edges[2 * (first + l) + k] != batch.edges[2 * first + k] + l) return false;
  return true;
}

/// Results of a pack: forces of an explicit step; the gradient and its absolute sums; the matrix with them.
enum class Wanted { forces, gradient, matrix };

/// Adds the gradient of a pack of stencils in space, with the axial forces of the edges that they own, and its absolute
/// sums.
template <bool with_magnitude>
void add_forces(const StencilBatch& batch, int first, int live, const BendTwistDerivatives<Pack>& d,
                const Vec3<Pack> (&tension)[2]) {
  Pack gradient[11 + kLanes];
  for (int i = 11; i < 11 + kLanes; ++i) gradient[i] = 0.0;
  const Vec3<Pack> bending = d.gradient_e[0] - d.gradient_e[1];
  put(gradient, -(d.gradient_e[0] + tension[0]));
  put(gradient + 4, bending + tension[0] - tension[1]);
  put(gradient + 8, d.gradient_e[1] + tension[1]);
  for (int j = 0; j < 2; ++j) gradient[3 + 4 * j] = d.gradient_angle[j];
  add_vector<Block, 11>(batch, first, live, gradient, batch.residual);
  if constexpr (!with_magnitude) return;

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
}

/// Changes, or rates, of the unknowns of two edges.
struct EdgeChanges {
  Vec3<Pack> edge[2];
  Pack angle[2];
};

/// One number per unknown of a pack of stencils; the last angle comes twice, in the places 7 and 8.
void load_unknowns(const StencilBatch& batch, int first, const double* table, Pack (&v)[12]) {
  const double* place[kLanes];
  for (int l = 0; l < kLanes; ++l)
    place[l] = table + batch.first_unknown[first + l < batch.count ? first + l : batch.count - 1];
  const auto numbers_from = [&](int at, Pack* into) {
    const double* from[kLanes];
    for (int l = 0; l < kLanes; ++l) from[l] = place[l] + at;
    load_rows<4>(from, into);
  };
  numbers_from(0, v);
  numbers_from(4, v + 4);
  numbers_from(7, v + 8);
}

/// From one number per unknown.
EdgeChanges edge_changes(const StencilBatch& batch, int first, const double* table) {
  Pack v[12];
  load_unknowns(batch, first, table, v);
  return {{{v[4] - v[0], v[5] - v[1], v[6] - v[2]}, {v[9] - v[4], v[10] - v[5], v[11] - v[6]}}, {v[3], v[7]}};
}

}  // namespace
}  // namespace withe::WITHE_INSTRUCTION_SET
