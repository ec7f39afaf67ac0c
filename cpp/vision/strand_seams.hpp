#pragma once
/// Cables that touch along their whole length, or to the end of one of them: the skeleton shows a single wide line.

#include <vector>

#include "vision/color_image.hpp"
#include "vision/crossing_zones.hpp"

namespace withe {

/// Cuts the mask between strands that lie side by side. Returns true if it did, and adds the places to `doubts`. A line
/// of constant width counts as several strands in these cases:
///
/// - The picture shows several hues across it, or the same shading twice.
/// - The line continues narrower along one of its flanks.
/// - The line forks into branches that are together as wide.
/// - The line is two, three, ... times as wide as all other cables. Exceptions are a line with the shading of a single
///   strand, and a line that thickens a cable to both sides.
///
/// Links that fork at both ends are left to `split_side_by_side`.
bool cut_seams(const SkeletonGraph& graph, const ZoneOptions& options, const ColorImage* image, BitImage& mask,
               std::vector<DoubtfulZone>& doubts);

}  // namespace withe
