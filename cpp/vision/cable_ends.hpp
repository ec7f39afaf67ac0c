#pragma once
/// Ends of cables: thinning eats them, so they are grown back to the end of the mask.

#include "vision/bit_image.hpp"
#include "vision/crossing_zones.hpp"

namespace withe {

/// Points from a branch outwards to the end of its cable, in the middle of the mask, about 1 px apart. An end cut
/// straight is where the mask ends, the end of a line drawn with a round brush half a width before.
std::vector<Vector2> grow_end(const BitImage& mask, const Branch& tip);

/// Distance from a point of the mask to its border along a unit vector, at most `limit` [px].
double reach_border(const BitImage& mask, const Vector2& from, const Vector2& direction, double limit);

/// Distances along and against a unit normal from a point of the mask to its flanks [px].
struct Flanks {
  double left = 0;
  double right = 0;
};
Flanks measure_flanks(const BitImage& mask, const Vector2& from, const Vector2& normal, double limit);

}  // namespace withe
