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

/// The same by discs of the local width around every row, later cables over earlier ones.
void paint_discs(const BitImage& mask, const Tracing& tracing, std::int32_t* labels);

}  // namespace withe
