#pragma once
/// Which of two strands that cross lies on top.

#include "vision/color_image.hpp"
#include "vision/tracing.hpp"

namespace withe {

/// Decides every crossing from the picture: the upper strand looks in the crossing as it does before and behind it,
/// flank by flank, the lower one does not. The picture inside the crossing is compared with the cross-profiles of
/// either strand just outside, interpolated along it; over is the one with the smaller squared difference, and the
/// confidence is the difference of both relative to their sum.
void decide_order(const ColorImage& image, Tracing& tracing);

}  // namespace withe
