#pragma once
/// Crossing zones, in which cables meet. There the skeleton does not represent single cables. Pairs of branches
/// continue each other through a zone with the least bending energy.

#include <array>
#include <vector>

#include "vision/color_image.hpp"
#include "vision/skeleton_graph.hpp"

namespace withe {

/// One end of an edge: 2 edge + end.
using HalfEdge = int;
inline int edge_of(HalfEdge half) { return half / 2; }
inline int end_of(HalfEdge half) { return half % 2; }
inline HalfEdge opposite(HalfEdge half) { return half ^ 1; }

/// An end of an edge, seen from the node to which it leads.
struct Branch {
  Vector2 point = Vector2::Zero();    ///< last place at which the skeleton is reliable
  Vector2 tangent = Vector2::Zero();  ///< unit vector into the zone, or out of the cable's tip
  double curvature = 0;               ///< positive to the left of the tangent [1/px]
  double half_width = 0;              ///< [px]
  int skip = 0;                       ///< pixels between the point and the end of the edge
  int edge = -1;                      ///< whose end it is; -1 if it is not of a graph
};

struct Zone {
  std::vector<int> nodes;
  std::vector<HalfEdge> branches;
  Vector2 center = Vector2::Zero();
  double waist = 0;  ///< half width of the mask at the narrowest place of its skeleton [px]
};

/// A link of the skeleton in which two cables lie side by side, and the two branches at each of its ends.
struct SideBySide {
  int link = -1;
  std::array<std::array<HalfEdge, 2>, 2> branches{};
};

/// Reason why a result is uncertain.
enum class Doubt { similar_energies, parallel_strands, different_colors, ends_on_itself };

struct DoubtfulZone {
  Vector2 point = Vector2::Zero();
  Doubt reason = Doubt::similar_energies;
};

struct ZoneOptions {
  double short_link = 2;           ///< links up to this long join zones [widths]
  double merged_link = 12;         ///< also links up to this long, if the mask is wider than the cables [widths]
  double merged_widening = 1.1;    ///< width of the mask in such links, relative to the cables
  double tangent_length = 4;       ///< length over which tangents are fitted [widths]
  double similar_energies = 0.38;  ///< two matchings closer than this are ambiguous, relative
};

/// Pairs of branches that continue each other.
struct Continuations {
  std::vector<Zone> zones;
  std::vector<Branch> branches;   ///< by half-edge
  std::vector<int> zone_of;       ///< by half-edge; -1 at a tip
  std::vector<HalfEdge> partner;  ///< by half-edge; -1 at an end of a cable
  std::vector<char> inside;       ///< by edge: part of a zone
  std::vector<SideBySide> side_by_side;
  std::vector<std::vector<Vector2>> ways;  ///< by half-edge: known places on the way to its partner
  std::vector<DoubtfulZone> doubts;
};

/// Point and direction of both ends of every edge.
std::vector<Branch> measure_branches(const SkeletonGraph& graph, const ZoneOptions& options);

/// A tip without the part where it is narrower than its edge: an oblique cut shortens it and pulls its skeleton aside.
Branch measure_tip(const SkeletonGraph& graph, HalfEdge tip, const ZoneOptions& options);

/// The picture, if there is one, is used to distinguish strands that lie side by side.
Continuations find_continuations(const SkeletonGraph& graph, const ZoneOptions& options,
                                 const ColorImage* image = nullptr);

}  // namespace withe
