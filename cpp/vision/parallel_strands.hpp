#pragma once
/// Two cables that lie side by side and touch over some length. They are one wide line of the skeleton, which is split
/// by widths and colours.

#include <array>
#include <optional>
#include <vector>

#include "vision/color_image.hpp"
#include "vision/crossing_zones.hpp"

namespace withe {

/// Returns the branches of a link if two cables lie in it side by side: two branches at each end, and a link as wide as
/// both together. `leaving` holds the half-edges at each end of the link, without its own.
std::optional<SideBySide> find_side_by_side(const SkeletonGraph& graph, int link, const std::vector<Branch>& branches,
                                            const std::array<std::vector<HalfEdge>, 2>& leaving);

/// Determines which branches are one cable, and its path inside the link, at half a width from its flank. The strands
/// exchange sides where the link is as narrow as one of them. Widths, or then colours (if there is a picture), can show
/// that they do not exchange sides.
void split_side_by_side(const SkeletonGraph& graph, const SideBySide& strands, const ColorImage* image,
                        Continuations& links);

}  // namespace withe
