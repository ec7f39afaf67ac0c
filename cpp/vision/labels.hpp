#pragma once
/// Which cable every pixel of the mask belongs to.

#include <cstdint>
#include <vector>

#include "vision/tracing.hpp"

namespace withe {

/// Writes cable number + 1 into every pixel of the mask, row by row; `labels` must be zero before. A pixel belongs to
/// the nearest centreline, measured in half widths. At crossings with known order the upper cable has its full width.
/// Parts of the mask without a cable stay 0.
void paint_labels(const BitImage& mask, const Tracing& tracing, std::int32_t* labels);

/// Share of the mask that belongs to cables, from 0 to 1; 1 for an empty mask. Specks of single pixels do not count,
/// unless there is nothing else: the mask is opened by 3 x 3 pixels before.
double labelled_share(const BitImage& mask, const std::int32_t* labels);

/// The published method: discs around every row, as wide as half of the cable's rows or more, in whole pixels. Later
/// cables cover earlier ones, and finally the upper cable of every crossing is drawn.
void paint_discs(const BitImage& mask, const Tracing& tracing, std::int32_t* labels);

}  // namespace withe
