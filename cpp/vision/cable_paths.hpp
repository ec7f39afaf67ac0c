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

struct GapOptions {
  double longest = 16;          ///< longest gap [px]
  double angle = 25;            ///< greatest angle of each end to the bridge [degrees]
  double longest_straight = 4;  ///< longest gap between ends of like widths that nearly face each other [widths]
  double straight_angle = 15;   ///< greatest angle of these ends to the bridge [degrees]
  double like_widths = 0.75;    ///< least ratio of these widths
};

/// Bridges gaps between tips, the shortest first. `ends` holds the grown end of every tip, by half-edge; ends on the
/// flank of a cable may be bridged across it.
void bridge_gaps(Continuations& links, const std::vector<std::vector<Vector2>>& ends, const GapOptions& options);

/// Every edge outside zones in exactly one path; open paths first.
std::vector<CablePath> collect_paths(const SkeletonGraph& graph, const Continuations& links);

}  // namespace withe
