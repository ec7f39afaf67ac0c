#pragma once
/// Which cable every pixel of the mask belongs to.

#include <cstdint>
#include <vector>

#include "vision/tracing.hpp"

namespace withe {

/// Writes cable number + 1 into every pixel of the mask (rows one after the other, zeros before): that of the nearest
/// centreline, measured in half widths; at crossings whose order is known the upper cable in its full width.
/// Parts of the mask that no cable runs through stay 0.
void paint_labels(const BitImage& mask, const Tracing& tracing, std::int32_t* labels);

/// The published way: discs around every row, as wide as half of the cable's rows or more, in whole pixels; later
/// cables over earlier ones, then the upper cable of every crossing.
void paint_discs(const BitImage& mask, const Tracing& tracing, std::int32_t* labels);

}  // namespace withe
