#pragma once
/// Which of two strands that cross lies on top.

#include "vision/color_image.hpp"
#include "vision/tracing.hpp"

namespace withe {

/// Decides the order of every crossing from the picture. The upper strand looks the same inside, before and behind the
/// crossing, flank by flank; the lower strand does not. The picture inside is compared with the cross-profiles of each
/// strand just outside, interpolated along the strand. The upper strand is the one with the smaller squared difference.
/// The confidence is the difference of the two squared differences, relative to their sum.
void decide_order(const ColorImage& image, Tracing& tracing);

}  // namespace withe
