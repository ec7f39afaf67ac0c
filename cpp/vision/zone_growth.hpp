#pragma once
/// Zones that cannot be explained alone are merged with their neighbours.

#include <vector>

#include "vision/crossing_zones.hpp"

namespace withe {

/// Finds unions of zones that explain what single zones do not. A zone calls for a union if a branch is left over in
/// it, or if its matching bends the cables sharply. The unions are tried from small to large: with one neighbour, with
/// two, with all that hang together by links up to four lengths. The first size with a matching of all branches, and of
/// less energy than the single zones, is taken: its links become `known_links`. Returns true if there is one.
bool grow_zones(const SkeletonGraph& graph, const Continuations& links, std::vector<char>& known_links);

}  // namespace withe
