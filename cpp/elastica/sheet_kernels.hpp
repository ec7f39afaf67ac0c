#pragma once
/// Integration across the segments of a sheet, by the instruction set in use. The segments of multiple shooting are
/// independent of each other. They are therefore integrated at once, in packs.

#include "common/instruction_set.hpp"

namespace withe {

constexpr int kSheetSegments = 8;
/// By theta and m at the start of a segment, R, T and the length.
constexpr int kSheetUnknowns = 5;

/// One number a segment.
using BySegment = double[kSheetSegments];

/// A step of each segment, from s to s + h. Both are a constant plus a share of the length. A segment that has reached
/// its end has h = 0. The piece of the width is as in `WidthPiece`.
struct SheetStep {
  BySegment s, s_by_length, h, h_by_length, begin, width, slope, weight;
};

struct SheetSegments {
  double up, forward, length;
  double weight, weight_by_length;  ///< weight of the lifted part
  bool even;                        ///< steps are of equal shares of the length, and b = 1
  int count;                        ///< of steps
  const SheetStep* steps;
  const BySegment* start;  ///< theta, m, X, Z
};

struct SheetKernels {
  /// States after each step: four rows a step.
  void (*advance)(const SheetSegments& segments, BySegment* states);
  /// States at the ends: of each, its value and its slopes by the unknowns.
  void (*linearise)(const SheetSegments& segments, BySegment (*ends)[1 + kSheetUnknowns]);
};

const SheetKernels& sheet_kernels();

}  // namespace withe
