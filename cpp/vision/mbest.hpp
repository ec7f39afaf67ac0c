#pragma once
/// The published method mBEST [Choi et al. 2023; Choi, dissertation chapter 8], for comparison.

#include "vision/color_image.hpp"
#include "vision/tracing.hpp"

namespace withe {

/// Traces a mask in the published steps:
///
/// - compute the skeleton
/// - find ends and intersections by counting neighbours
/// - prune split ends up to twice the largest half width
/// - cluster intersections. Match Y-shaped ones within ten largest half widths in pairs, the nearest first, and replace
///   each pair by its middle
/// - pair the ends at each intersection with the least sum of discrete curvatures (8.2)
/// - follow the pixels of the skeleton
Tracing trace_mbest(const BitImage& mask);

/// Step seven (8.2.7): the upper path through a crossing has the smaller sum of standard deviations of its colours,
/// measured in the picture blurred by a 5 x 5 box.
void decide_order_mbest(const ColorImage& image, Tracing& tracing);

}  // namespace withe
