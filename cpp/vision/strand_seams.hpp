#pragma once
/// Cables that touch along their whole length, or to the end of one of them: the skeleton shows a single wide line.

#include <vector>

#include "vision/color_image.hpp"
#include "vision/crossing_zones.hpp"

namespace withe {

/// Cuts the mask between strands that lie side by side and says whether it did; `doubts` receives where. What is wide
/// for a while is several strands where the picture shows several hues across it, or the same shading twice; where the
/// line goes on narrower and keeps to one of its flanks; where it forks into branches that are together as wide; or
/// where it is two, three, ... times as wide as all other cables, unless its shading is that of a single one or it
/// thickens a cable to both sides. Links that fork at both ends are left to `split_side_by_side`.
bool cut_seams(const SkeletonGraph& graph, const ZoneOptions& options, const ColorImage* image, BitImage& mask,
               std::vector<DoubtfulZone>& doubts);

}  // namespace withe
