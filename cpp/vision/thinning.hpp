#pragma once
/// Thinning of a binary image to lines one pixel wide.

#include "vision/bit_image.hpp"

namespace withe {

/// Skeleton by the two-pass parallel rule of [Zhang and Suen 1984], with 25 of the 256 neighbourhoods decided
/// otherwise so that no staircases stay that look like crossings. The result is that of scikit-image's
/// `skeletonize`, pixel by pixel.
BitImage thin(const BitImage& image);

}  // namespace withe
