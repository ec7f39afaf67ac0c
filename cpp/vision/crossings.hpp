#pragma once
/// Crossings of the fitted cables, and ends of cables on the flank of another.

#include <vector>

#include "vision/cable_fit.hpp"
#include "vision/tracing.hpp"

namespace withe {

/// Crossings of cables inside zones. Two cables that meet an even number of times within one zone only touch there.
/// From zone `first_bridge` on, a zone is a stretch of one cable beneath others, which are visible there.
std::vector<Crossing> find_crossings(const std::vector<Cable>& cables, const std::vector<HiddenStretch>& stretches,
                                     int first_bridge);

/// First hit of a ray on one of the stretches; `row` is -1 where it meets none within `longest`.
struct RayHit {
  CableRow through;
  double distance = 0;
  double sine = 1;  ///< sine of the angle between ray and cable
};
RayHit cast_ray(const std::vector<Cable>& cables, const std::vector<HiddenStretch>& stretches, int zone,
                const Vector2& from, const Vector2& direction, double longest);

}  // namespace withe
