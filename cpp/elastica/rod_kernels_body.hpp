// The kernels of rod_kernels.hpp on packs; included once by the translation unit of each instruction set.

#include "common/pack.hpp"
#include "elastica/rod_kernels.hpp"
#include "elastica/rod_slope.hpp"
#include "elastica/runge_kutta.hpp"

namespace withe::WITHE_INSTRUCTION_SET {
namespace {

static_assert(kRodBlock % kLanes == 0);

using PackDual = Dual<kRodUnknowns, Pack>;

/// Takes kLanes segments from `first` on to their ends; calls see(part) after each part.
template <class Scalar, std::size_t count, class See>
void across(const RodSlope<Scalar, Pack>& slope, const RodBlock& block, int first, std::array<Scalar, count>& y,
            const See& see) {
  add_lever(load(block.lever + first), load(block.behind + first), slope.floor, y);
  const Pack start = load(block.s + first), part = load(block.part + first), steps = load(block.steps + first);
  const Pack h = part / steps;
  constexpr int kCoupled = count == kRodWithRotation ? kRodWithRotation : kRodTurning;
  for (int i = 0; i < block.parts; ++i) {
    for (int j = 0; j < block.most_steps; ++j) {  // a segment that has come to the end of the part rests
      const Pack s = start + static_cast<double>(i) * part + static_cast<double>(j) * h;
      const Pack step = select(Pack(static_cast<double>(j)).v < steps.v, h, 0.0);
      runge_kutta_step<kCoupled>(slope, s, step, y);
    }
    see(i);
  }
}

template <std::size_t count>
void advance(const RodField& field, const RodBlock& block, ByRodSegment* states) {
  const RodSlope<Pack, Pack> slope{{field.floor[0], field.floor[1], field.floor[2]}, field.compliance};
  for (int first = 0; first < kRodBlock; first += kLanes) {
    std::array<Pack, count> y;
    for (std::size_t j = 0; j < count; ++j)
      y[j] = j < kRodTurning ? load(block.state[j] + first) : Pack(j == kRodWithPosition ? 1.0 : 0.0);
    across(slope, block, first, y, [&](int part) {
      for (std::size_t j = 0; j < count; ++j) store(states[static_cast<std::size_t>(part) * count + j] + first, y[j]);
    });
  }
}

template <std::size_t count>
void linearise(const RodField& field, const RodBlock& block, ByRodSegment (*ends)[1 + kRodUnknowns]) {
  RodSlope<PackDual, Pack> slope{{Pack(field.floor[0]), Pack(field.floor[1]), Pack(field.floor[2])}, field.compliance};
  for (int i = 0; i < 2; ++i) slope.floor[field.unknown[i]].slope[kRodTurning + i] = 1.0;
  for (int first = 0; first < kRodBlock; first += kLanes) {
    std::array<PackDual, count> y;
    for (std::size_t j = 0; j < kRodTurning; ++j) {
      y[j] = load(block.state[j] + first);
      y[j].slope[j] = 1.0;
    }
    across(slope, block, first, y, [](int /*part*/) {});
    for (std::size_t j = 0; j < count; ++j) {
      store(ends[j][0] + first, y[j].value);
      for (int k = 0; k < kRodUnknowns; ++k) store(ends[j][1 + k] + first, y[j].slope[k]);
    }
  }
}

}  // namespace

extern const RodKernels kRodKernels;
const RodKernels kRodKernels{&advance<kRodTurning>, &advance<kRodWithPosition>, &advance<kRodWithRotation>,
                             &linearise<kRodTurning>, &linearise<kRodWithPosition>};

}  // namespace withe::WITHE_INSTRUCTION_SET
