#pragma once
/// Integration across the segments of a rod, by the instruction set in use. The segments of multiple shooting are
/// independent of each other. They are therefore integrated at once, in packs.

#include "common/instruction_set.hpp"

namespace withe {

constexpr int kRodBlock = 4;  ///< segments that are integrated together
constexpr int kRodTurning = 6, kRodWithPosition = 9, kRodWithRotation = 13;
/// By t and m at the start of a segment, and by two components of the floor's force.
constexpr int kRodUnknowns = 8;

/// One number a segment.
using ByRodSegment = double[kRodBlock];

struct RodField {
  double floor[3];
  double compliance;  ///< 1 / EA
  int unknown[2];     ///< components of the floor's force
};

/// From s on in parts; each part takes as many steps, of a size that is each segment's own.
struct RodBlock {
  ByRodSegment s, part, steps;
  int parts, most_steps;
  ByRodSegment lever, behind;  ///< of the floor's force; zero except at the lift-off of a rod
  ByRodSegment state[kRodTurning];
};

struct RodKernels {
  /// States after each part. Positions begin at zero, quaternions at one.
  void (*turn)(const RodField& field, const RodBlock& block, ByRodSegment* states);
  void (*move)(const RodField& field, const RodBlock& block, ByRodSegment* states);
  void (*rotate)(const RodField& field, const RodBlock& block, ByRodSegment* states);
  /// State at the end of a block in one part: the value of each number and its slopes by the unknowns.
  void (*linearise_turn)(const RodField& field, const RodBlock& block, ByRodSegment (*ends)[1 + kRodUnknowns]);
  void (*linearise_move)(const RodField& field, const RodBlock& block, ByRodSegment (*ends)[1 + kRodUnknowns]);
};

const RodKernels& rod_kernels();

}  // namespace withe
