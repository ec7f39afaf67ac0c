#include "vision/hidden_bridges.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "vision/branch_matching.hpp"
#include "vision/cable_ends.hpp"
#include "vision/strand_classes.hpp"

namespace withe {

namespace {

constexpr double kLongest = 12;          ///< longest hidden stretch [widths]
constexpr double kLongestChange = 4;     ///< longest hidden stretch between clearly different colours [widths]
constexpr double kTouching = 3;          ///< greatest distance of ends that touch: skeletons end before [widths]
constexpr double kSteepest = 0.5;        ///< least cosine of the angle of each end to the stretch
constexpr double kSteepestChange = 0.9;  ///< least cosine between clearly different colours
constexpr double kLikeWidths = 0.65;     ///< least ratio of the widths of both ends
constexpr double kCovered = 0.65;        ///< least share of the stretch in the mask: shadows leave gaps
constexpr double kBlob = 2.5;            ///< pieces up to this long show no direction [widths]
constexpr double kLikeBlobs = 0.4;       ///< least ratio of the widths of a strand and such a piece
constexpr double kCutWidth = 3;          ///< a cut between colours, and pixels of its border [px]
constexpr int kPiece = 4;                ///< shortest piece of a strand that a stretch may not pass over [px]
constexpr double kColorWeight = 0.8;     ///< energy of clearly different colours [energy of a single end]

struct End {
  HalfEdge half;
  Branch branch;
  LogColor color;
  bool has_direction = true;  ///< False for a piece about as long as wide: its skeleton does not lead along the strand
};

/// True if a smooth curve from one end to the other lies in the mask, and leaves the colour of the ends only once. From
/// one end to the next but one, the curve would pass over a piece of the strand.
bool is_covered(const BitImage& mask, const StrandClasses& classes, const Branch& from, const Branch& to) {
  const double length = (to.point - from.point).norm();
  const int steps = std::max(4, static_cast<int>(length));
  const auto class_at = [&](const Vector2& point) {
    return classes.at(static_cast<int>(std::lround(point.x())), static_cast<int>(std::lround(point.y())));
  };
  const int first = class_at(from.point), last = class_at(to.point);
  int inside = 0, own = 0, left = 0;
  for (int i = 0; i <= steps; ++i) {
    const Vector2 point = way_place(from.point, from.tangent, to.point, -to.tangent, static_cast<double>(i) / steps);
    inside += mask.at(static_cast<int>(std::lround(point.x())), static_cast<int>(std::lround(point.y()))) ? 1 : 0;
    const int here = class_at(point);
    if (here == first || here == last) {
      ++own;
    } else {
      left += own >= kPiece ? 1 : 0;
      own = 0;
    }
  }
  return inside >= kCovered * (steps + 1) && left <= 1;
}

/// True if a piece is so short that its skeleton does not show its direction.
bool is_blob(const SkeletonGraph& graph, const SkeletonEdge& edge) {
  for (const int node : edge.nodes) {
    if (graph.nodes[at(node)].edges.size() != 1) return false;
  }
  return edge.length < kBlob * 2 * edge.half_width;
}

/// Keeps the middle of the skeleton of a blob: towards its ends it leads to the corners.
void shrink(SkeletonEdge& edge, Continuations& links, HalfEdge half) {
  const auto n = static_cast<std::ptrdiff_t>(edge.points.size());
  const std::ptrdiff_t margin = edge.length < 2 * edge.half_width ? (n - 1) / 2 : n / 3;
  if (n > 2) edge.points = {edge.points.begin() + margin, edge.points.end() - margin};
  for (const HalfEdge side : {half, opposite(half)}) {
    Branch& branch = links.branches[at(side)];
    if (n > 0) branch.point = (end_of(side) == 0 ? edge.points.front() : edge.points.back()).position();
    branch.curvature = 0;
    branch.skip = 0;
  }
}

/// True if two ends may be one strand, by their widths, directions, colours and distance.
bool may_continue(const SkeletonGraph& graph, const End& first, const End& second) {
  const Branch &a = first.branch, &b = second.branch;
  const Vector2 chord = b.point - a.point;
  const double length = chord.norm(), width = a.half_width + b.half_width;
  const bool differ = color_difference(first.color, second.color) > 1;
  if (!first.has_direction && !second.has_direction) return false;
  const bool blob = !first.has_direction || !second.has_direction;
  if (length > (differ || blob ? kLongestChange : kLongest) * width) return false;
  const double alike = std::min(a.half_width, b.half_width) / std::max(a.half_width, b.half_width);
  if (alike < (blob ? kLikeBlobs : kLikeWidths)) return false;
  const int edge = edge_of(first.half);
  if (edge == edge_of(second.half) && graph.edges[at(edge)].length < 2 * kLongest * width) return false;
  const double least = (differ || blob ? kSteepestChange : kSteepest) * length;
  return (!first.has_direction || a.tangent.dot(chord) >= least) &&
         (!second.has_direction || b.tangent.dot(chord) <= -least);
}

/// Bending energy of a pair. An end without direction may take that of least energy.
double energy_of(const End& first, const End& second) {
  if (first.has_direction && second.has_direction) return bending_energy(first.branch, second.branch);
  const End& directed = first.has_direction ? first : second;
  const Vector2 chord = (first.has_direction ? second : first).branch.point - directed.branch.point;
  const double angle = std::atan2(cross(directed.branch.tangent, chord), directed.branch.tangent.dot(chord));
  return 1.5 * angle * angle / std::max({chord.norm(), directed.branch.half_width, 1.0});
}

/// True if no third strand lies between two ends, and they are close.
bool touch(const StrandClasses& classes, const Branch& a, const Branch& b) {
  const double length = (b.point - a.point).norm();
  if (length > kTouching * (a.half_width + b.half_width)) return false;
  const auto class_at = [&](const Vector2& point) {
    return classes.at(static_cast<int>(std::lround(point.x())), static_cast<int>(std::lround(point.y())));
  };
  const int first = class_at(a.point), last = class_at(b.point);
  bool changed = false;
  constexpr double step = 0.5;
  double others = 0;  // blended colours of the border may be most similar to a third one
  for (double s = 0; s < length; s += step) {
    const int here = class_at(a.point + s / length * (b.point - a.point));
    changed = changed || here == last;
    if (here != (changed ? last : first)) others += step;
  }
  return others < kCutWidth;
}

void join(const End& a, const End& b, SkeletonGraph& graph, Continuations& links) {
  const int zone = static_cast<int>(links.zones.size());
  const Vector2 middle = 0.5 * (a.branch.point + b.branch.point);
  links.zones.push_back({{}, {a.half, b.half}, middle, std::min(a.branch.half_width, b.branch.half_width)});
  for (const End* end : {&a, &b}) {
    const End& other = end == &a ? b : a;
    Branch& branch = links.branches[at(end->half)];
    if (end->has_direction) {
      branch = end->branch;
    } else {
      shrink(graph.edges[at(edge_of(end->half))], links, end->half);
      branch.tangent = (other.branch.point - branch.point).normalized();
      Branch& beyond = links.branches[at(opposite(end->half))];
      if (links.partner[at(opposite(end->half))] < 0) beyond.tangent = -branch.tangent;
    }
    if (links.zone_of[at(end->half)] < 0) links.zone_of[at(end->half)] = zone;
  }
  links.partner[at(a.half)] = b.half;
  links.partner[at(b.half)] = a.half;
  if (color_difference(a.color, b.color) > 1) links.doubts.push_back({middle, Doubt::different_colors});
}

}  // namespace

void bridge_hidden(SkeletonGraph& graph, const BitImage& mask, const ColorImage& image, const StrandClasses& classes,
                   const ZoneOptions& options, Continuations& links) {
  std::vector<End> ends;
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    const SkeletonEdge& edge = graph.edges[e];
    if (edge.removed || links.inside[e] || edge.nodes[0] < 0) continue;
    for (const int side : {0, 1}) {
      const auto half = static_cast<HalfEdge>(2 * e) + side;
      if (links.partner[at(half)] >= 0) continue;
      End end{half, links.branches[at(half)], {}};
      if (is_blob(graph, edge)) {
        end.has_direction = false;
        if (!edge.points.empty()) end.branch.point = edge.points[edge.points.size() / 2].position();
      } else if (links.zone_of[at(half)] < 0) {
        end.branch = measure_tip(graph, half, options);
      }
      end.color = branch_color(image, graph, links, half);
      ends.push_back(end);
    }
  }
  std::vector<double> singles;
  for (const End& end : ends) singles.push_back(single_energy(2 * end.branch.half_width));
  std::vector<PairCandidate> candidates;
  std::vector<std::vector<HalfEdge>> touching(links.branches.size());  // by half-edge
  const auto add = [&](std::size_t i, std::size_t j) {
    // Ends of clearly different colours still cost less than two single ends.
    const double difference = std::min<double>(color_difference(ends[i].color, ends[j].color), 1);
    const double color_energy = kColorWeight * difference * 0.5 * (singles[i] + singles[j]);
    candidates.push_back({static_cast<int>(i), static_cast<int>(j), energy_of(ends[i], ends[j]) + color_energy});
  };
  const auto for_each_pair = [&](auto&& visit) {
    for (std::size_t i = 0; i < ends.size(); ++i) {
      for (std::size_t j = i + 1; j < ends.size(); ++j) {
        if (may_continue(graph, ends[i], ends[j])) visit(i, j);
      }
    }
  };
  for_each_pair([&](std::size_t i, std::size_t j) {
    if (!touch(classes, ends[i].branch, ends[j].branch)) return;
    add(i, j);
    touching[at(ends[i].half)].push_back(ends[j].half);
    touching[at(ends[j].half)].push_back(ends[i].half);
  });
  // Stripes of one colour do not continue each other beneath the stripe between them, which touches both.
  const auto ends_near = [&](HalfEdge a, HalfEdge b) {
    const Branch& tip = links.branches[at(b)];
    return std::any_of(touching[at(a)].begin(), touching[at(a)].end(), [&](HalfEdge beside) {
      const Vector2 apart = links.branches[at(opposite(beside))].point - tip.point;
      return apart.norm() < kTouching * 2 * tip.half_width;
    });
  };
  for_each_pair([&](std::size_t i, std::size_t j) {
    const Branch &a = ends[i].branch, &b = ends[j].branch;
    if (touch(classes, a, b) || !is_covered(mask, classes, a, b)) return;
    if (!ends_near(ends[i].half, ends[j].half) && !ends_near(ends[j].half, ends[i].half)) add(i, j);
  });
  for (const auto& [i, j] : pair_ends(singles, candidates)) join(ends[at(i)], ends[at(j)], graph, links);
}

void extend_beneath(const BitImage& mask, const StrandClasses& classes, double half_width, std::vector<Vector2>& end) {
  if (end.size() < 2) return;
  const Vector2 tip = end.back();
  const Vector2 way = tip - end[end.size() > 6 ? end.size() - 6 : 0];
  if (way.norm() == 0) return;
  const Vector2 direction = way.normalized();
  const double reach = reach_border(mask, tip, direction, 8 * half_width);
  if (reach < half_width + kCutWidth) return;
  const BitImage own = classes.region_of(tip);
  const double visible = reach_border(own, tip, direction, 2 * half_width);
  const double covered = reach - visible;
  if (covered < kCutWidth || covered > 4 * half_width) return;
  // An end that lies on the other strand, or beside it, is visible as a whole and round.
  constexpr double round = 0.15;  // between a straight border and a half disc [half widths]
  const Vector2 before = tip - std::max(half_width - visible, 0.0) * direction;
  if (measure_end(own, before, direction, half_width).fallen > round) return;
  const double beyond = visible + 0.5 * covered;
  for (double s = 1; s < beyond; s += 1) end.push_back(tip + s * direction);
}

}  // namespace withe
