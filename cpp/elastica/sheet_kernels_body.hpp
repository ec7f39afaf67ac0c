// The kernels of sheet_kernels.hpp on packs; included once by the translation unit of each instruction set.

#include "common/pack.hpp"
#include "elastica/runge_kutta.hpp"
#include "elastica/sheet_kernels.hpp"
#include "elastica/sheet_slope.hpp"

namespace withe::WITHE_INSTRUCTION_SET {
namespace {

static_assert(kSheetSegments % kLanes == 0);

using PackDual = Dual<kSheetUnknowns, Pack>;
constexpr int kByLength = kSheetUnknowns - 1;

/// A number and its slope by the length.
void put(Pack& to, Pack value, Pack /*by_length*/) { to = value; }
void put(PackDual& to, Pack value, Pack by_length) {
  to = value;
  to.slope[kByLength] = by_length;
}

/// A constant and a share of the length.
template <class Scalar>
Scalar along(Pack constant, Pack by_length, double length) {
  Scalar s;
  put(s, constant + by_length * length, by_length);
  return s;
}

/// Takes kLanes segments from `first` on across all steps; calls see(step) after each.
template <class Scalar, class See>
void step_across(const SheetSegments& segments, int first, SheetSlope<Scalar, Pack>& slope, std::array<Scalar, 4>& y,
                 const See& see) {
  slope.even = segments.even;
  put(slope.weight, segments.weight, segments.weight_by_length);
  for (int i = 0; i < segments.count; ++i) {
    const SheetStep& step = segments.steps[i];
    const auto s = along<Scalar>(load(step.s + first), load(step.s_by_length + first), segments.length);
    const auto h = along<Scalar>(load(step.h + first), load(step.h_by_length + first), segments.length);
    if (!segments.even) {
      slope.piece = {load(step.begin + first), load(step.width + first), load(step.slope + first),
                     load(step.weight + first)};
    }
    runge_kutta_step<2>(slope, s, h, y);
    see(i);
  }
}

void advance(const SheetSegments& segments, BySegment* states) {
  for (int first = 0; first < kSheetSegments; first += kLanes) {
    SheetSlope<Pack, Pack> slope{segments.up, segments.forward, segments.length};
    std::array<Pack, 4> y;
    for (int j = 0; j < 4; ++j) y[j] = load(segments.start[j] + first);
    step_across(segments, first, slope, y, [&](int i) {
      for (int j = 0; j < 4; ++j) store(states[4 * i + j] + first, y[j]);
    });
  }
}

void linearise(const SheetSegments& segments, BySegment (*ends)[1 + kSheetUnknowns]) {
  for (int first = 0; first < kSheetSegments; first += kLanes) {
    SheetSlope<PackDual, Pack> slope{PackDual::unknown(segments.up, 2), PackDual::unknown(segments.forward, 3),
                                     PackDual::unknown(segments.length, kByLength)};
    std::array<PackDual, 4> y;
    for (int j = 0; j < 4; ++j) {
      y[j] = load(segments.start[j] + first);
      if (j < 2) y[j].slope[j] = 1.0;
    }
    step_across(segments, first, slope, y, [](int /*step*/) {});
    for (int j = 0; j < 4; ++j) {
      store(ends[j][0] + first, y[j].value);
      for (int k = 0; k < kSheetUnknowns; ++k) store(ends[j][1 + k] + first, y[j].slope[k]);
    }
  }
}

}  // namespace

extern const SheetKernels kSheetKernels;
const SheetKernels kSheetKernels{&advance, &linearise};

}  // namespace withe::WITHE_INSTRUCTION_SET
