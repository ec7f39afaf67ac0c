#pragma once
/// Walks from edge to edge along continuations: which edges make which cable, in which order.

#include <vector>

#include "vision/bit_image.hpp"
#include "vision/crossing_zones.hpp"

namespace withe {

/// The edges of one cable in order; every edge is entered at a half-edge and left at the opposite one.
struct CablePath {
  std::vector<HalfEdge> entries;
  bool closed = false;
};

/// Bridges gaps between tips: at most `longest` px long, both ends within `angle` degrees of the bridge, the shortest
/// first. `ends` holds the grown end of every tip, by half-edge; ends on the flank of a cable may be bridged across it.
void bridge_gaps(Continuations& links, const std::vector<std::vector<Vector2>>& ends, double longest, double angle);

/// Every edge outside zones in exactly one path; open paths first.
std::vector<CablePath> collect_paths(const SkeletonGraph& graph, const Continuations& links);

}  // namespace withe
