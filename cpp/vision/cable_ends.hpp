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

/// Shape of the end of a cable. Between 0.5 and 0.8 of the half width from the middle a half disc falls back by 0.24
/// half widths on average; the pixels of a straight cut by about 0.06.
struct EndShape {
  double middle = 0;  ///< extent of the mask beyond a point, along the middle [px]
  double fallen = 0;  ///< by how much less the mask extends nearer to the flanks [half widths]
};
EndShape measure_end(const BitImage& mask, const Vector2& point, const Vector2& tangent, double half_width);

}  // namespace withe
