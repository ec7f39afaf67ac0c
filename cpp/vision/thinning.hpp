#pragma once
/// Thinning of a binary image to lines one pixel wide.

#include "vision/bit_image.hpp"

namespace withe {

/// Skeleton by the two-pass parallel rule of [Zhang and Suen 1984], with a different decision for 25 of the 256
/// neighbourhoods, so that no staircases remain that look like crossings. The result equals that of scikit-image's
/// `skeletonize` in every pixel.
BitImage thin(const BitImage& image);

}  // namespace withe
