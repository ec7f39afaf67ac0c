#pragma once
// Frames of packs of edges, for the kernels of frames and of stencils. Included by those only.

#include "common/pack.hpp"
#include "geometry/curvature.hpp"
#include "geometry/frame_kernels.hpp"

namespace withe::WITHE_INSTRUCTION_SET {
namespace {

/// Of kLanes edges, from a table.
EdgeFrame<Pack> frames_of(const double* frames, const int (&edge)[kLanes]) {
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
