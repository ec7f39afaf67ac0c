#pragma once
// Frames and unknowns of packs of edges, for the kernels of frames, of stencils and of inertia. Only these include this
// file.

#include "common/pack.hpp"
#include "geometry/curvature.hpp"
#include "geometry/frame_kernels.hpp"

namespace withe::WITHE_INSTRUCTION_SET {

inline HalfTwist<Pack> half_twist(Pack tau) {
  const SineCosine half = sine_cosine(0.5 * tau);
  return {half.cosine, half.sine};
}

namespace {

/// The kLanes indices from `first`, the last one repeated; returns how many are real.
inline int lanes_from(int first, int count, int (&index)[kLanes]) {
  for (int l = 0; l < kLanes; ++l) index[l] = first + l < count ? first + l : count - 1;
  return count - first < kLanes ? count - first : kLanes;
}

inline void store_first(double* place, Pack a, int count) {
  if (count == kLanes) return store(place, a);
  for (int l = 0; l < count; ++l) place[l] = a[l];
}

/// Rows of a table of three columns.
inline Vec3<Pack> rows_from(const double* table, int first, int live) {
  Pack number[3];
  load_threes(table + std::ptrdiff_t{3} * first, live, number);
  return {number[0], number[1], number[2]};
}
inline void store_rows(double* table, int first, int live, const Vec3<Pack>& v) {
  store_threes(table + std::ptrdiff_t{3} * first, live, {v.x, v.y, v.z});
}

/// Three unknowns from each index on. The one before is read with them, since there may be none after them.
inline Vec3<Pack> three_unknowns(const double* q, const int (&index)[kLanes]) {
  const double* place[kLanes];
  for (int l = 0; l < kLanes; ++l) {
    if (index[l] == 0) return {gather(q, index), gather(q + 1, index), gather(q + 2, index)};
    place[l] = q + index[l] - 1;
  }
  Pack number[4];
  load_rows<4>(place, number);
  return {number[1], number[2], number[3]};
}

/// Frames of kLanes edges, from a table.
inline EdgeFrame<Pack> frames_of(const double* frames, const int (&edge)[kLanes]) {
  const double* place[kLanes];
  for (int l = 0; l < kLanes; ++l) place[l] = frames + std::ptrdiff_t{kFrameNumbers} * edge[l];
  Pack number[kFrameNumbers];
  load_rows<kFrameNumbers>(place, number);
  return {{number[0], number[1], number[2]},    {number[3], number[4], number[5]},
          {number[6], number[7], number[8]},    number[9],
          {number[10], number[11], number[12]}, {number[13], number[14], number[15]}};
}

}  // namespace
}  // namespace withe::WITHE_INSTRUCTION_SET
