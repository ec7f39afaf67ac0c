#pragma once
/// Two cables that lie side by side and touch for a while: one wide line of the skeleton, split by widths and colours.

#include <array>
#include <optional>
#include <vector>

#include "vision/color_image.hpp"
#include "vision/crossing_zones.hpp"

namespace withe {

/// The branches of a link if two cables go through it side by side: two branches at either end, and the link as wide
/// as both together. `leaving` holds the half-edges at either end of the link, without its own.
std::optional<SideBySide> find_side_by_side(const SkeletonGraph& graph, int link, const std::vector<Branch>& branches,
                                            const std::array<std::vector<HalfEdge>, 2>& leaving);

/// Says which branches are one cable and where it goes inside the link, a half width from its flank. The strands change
/// sides where the link is as narrow as one of them, unless widths, or then colours (if there is a picture), say that
/// they arrive otherwise.
void split_side_by_side(const SkeletonGraph& graph, const SideBySide& strands, const ColorImage* image,
                        Continuations& links);

}  // namespace withe
