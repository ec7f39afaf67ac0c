#pragma once
/// The published method mBEST [Choi et al. 2023; Choi, dissertation chapter 8], for comparison.

#include "vision/color_image.hpp"
#include "vision/tracing.hpp"

namespace withe {

/// Traces a mask in the seven published steps: skeleton; ends and intersections by counting neighbours; split ends up
/// to twice the largest half width pruned; intersections clustered, Y-shaped ones within ten largest half widths
/// matched in pairs, the nearest first, and replaced by their middle; the pairs of ends with the least sum of
/// discrete curvatures (8.2) continue each other; paths follow the pixels of the skeleton.
Tracing trace_mbest(const BitImage& mask);

/// Step seven (8.2.7): over is the path through the crossing with the smaller sum of standard deviations of its
/// colours, measured in the picture blurred by a 5 x 5 box.
void decide_order_mbest(const ColorImage& image, Tracing& tracing);

}  // namespace withe
