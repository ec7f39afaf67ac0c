#pragma once
/// A skeleton as a graph: lines of pixels between the places where they meet or end.

#include <array>
#include <vector>

#include "common/types.hpp"
#include "vision/bit_image.hpp"

namespace withe {

/// A pixel of the skeleton and the half width of the mask there: distance to the background less half a pixel [px].
struct SkeletonPoint {
  int x = 0;
  int y = 0;
  float half_width = 0;
  Vector2 position() const { return {static_cast<double>(x), static_cast<double>(y)}; }
};

/// A line of skeleton pixels from one node to another; pixels of the nodes themselves are not part of it.
struct SkeletonEdge {
  std::array<int, 2> nodes{-1, -1};  ///< -1 at both ends: a closed line without node
  std::vector<SkeletonPoint> points;
  double length = 0;      ///< node to node [px]
  double half_width = 0;  ///< median along the line [px]
  bool removed = false;
};

/// Node where lines meet (a cluster of skeleton pixels) or one line ends (its last pixel).
struct SkeletonNode {
  Vector2 position = Vector2::Zero();
  double half_width = 0;
  std::vector<int> edges;  ///< an edge that starts and ends here is listed twice
};

/// An end of the skeleton that was removed: a fray, or a cable that ends close to a crossing.
struct Spur {
  Vector2 root = Vector2::Zero();
  Vector2 tip = Vector2::Zero();
};

struct SkeletonGraph {
  std::vector<SkeletonNode> nodes;
  std::vector<SkeletonEdge> edges;
  std::vector<Spur> spurs;
};

/// Builds the graph of a skeleton; half widths are measured in the mask that it is the skeleton of, up to `limit`.
SkeletonGraph build_graph(const BitImage& skeleton, const BitImage& mask, double limit);

/// Removes ends of lines shorter than `ratio` half widths of the mask where they sprout, the shortest first, and joins
/// the two lines that remain at a node.
void prune_spurs(SkeletonGraph& graph, double ratio);

/// Removes ends of lines up to `length` px long one after the other, as they come.
void prune_short_ends(SkeletonGraph& graph, double length);

/// The nodes where an edge starts (0) or ends (1), read from either side.
inline int other_end(const SkeletonEdge& edge, int end) { return edge.nodes[static_cast<std::size_t>(1 - end)]; }

}  // namespace withe
