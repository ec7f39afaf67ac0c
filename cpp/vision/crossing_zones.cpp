#include "vision/crossing_zones.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/Dense>

#include "vision/branch_matching.hpp"
#include "vision/parallel_strands.hpp"
#include "vision/zone_growth.hpp"

namespace withe {

namespace {

/// Disjoint sets of nodes.
class Union {
 public:
  explicit Union(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }
  int root(int a) {
    while (parent_[static_cast<std::size_t>(a)] != a) {
      int& parent = parent_[static_cast<std::size_t>(a)];
      parent = parent_[static_cast<std::size_t>(parent)];
      a = parent;
    }
    return a;
  }
  void join(int a, int b) { parent_[static_cast<std::size_t>(root(a))] = root(b); }

 private:
  std::vector<int> parent_;
};

bool is_junction(const SkeletonGraph& graph, int node) {
  return node >= 0 && graph.nodes[static_cast<std::size_t>(node)].edges.size() >= 3;
}

/// Half width of the mask along the middle of an edge, away from the crossings at its ends.
double inner_half_width(const SkeletonEdge& edge) {
  const std::size_t n = edge.points.size();
  const std::size_t margin = std::min(n / 4, static_cast<std::size_t>(edge.half_width));
  std::vector<float> values;
  for (std::size_t i = margin; i + margin < n; ++i) values.push_back(edge.points[i].half_width);
  if (values.empty()) return edge.half_width;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// For every set of nodes, the edges that leave it; edges that join it with itself do not count.
std::vector<std::vector<int>> edges_leaving(const SkeletonGraph& graph, Union& sets) {
  std::vector<std::vector<int>> leaving(graph.nodes.size());
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    const SkeletonEdge& edge = graph.edges[e];
    if (edge.removed || edge.nodes[0] < 0) continue;
    const int first = sets.root(edge.nodes[0]);
    const int second = sets.root(edge.nodes[1]);
    if (first == second) continue;
    leaving[static_cast<std::size_t>(first)].push_back(static_cast<int>(e));
    leaving[static_cast<std::size_t>(second)].push_back(static_cast<int>(e));
  }
  return leaving;
}

/// Pixels at an end of an edge that the crossing or the tip has displaced.
int distorted_pixels(const SkeletonEdge& edge, int end, const SkeletonNode& node) {
  const int n = static_cast<int>(edge.points.size());
  const auto at = [&](int i) { return edge.points[static_cast<std::size_t>(end == 0 ? i : n - 1 - i)]; };
  const double half_width = inner_half_width(edge);
  if (node.edges.size() < 2) return std::min(n / 3, static_cast<int>(half_width));
  // Within the largest disc around the node the skeleton leads to the node, not along the cable.
  const double disc = 1.25 * node.half_width;
  int skip = 0;
  const int most = std::min(n / 2 - 2, static_cast<int>(8 * half_width));
  while (skip < most &&
         (at(skip).half_width > 1.12 * half_width || (at(skip).position() - node.position).norm() < disc)) {
    ++skip;
  }
  return std::max(skip, 0);
}

/// Point and direction at an end of an edge, from a parabola through its pixels.
Branch measure_branch(const SkeletonGraph& graph, const SkeletonEdge& edge, int end, int skip, int skip_other,
                      double tangent_length) {
  Branch branch;
  branch.half_width = inner_half_width(edge);
  branch.skip = skip;
  const int n = static_cast<int>(edge.points.size());
  const auto at = [&](int i) { return edge.points[static_cast<std::size_t>(end == 0 ? i : n - 1 - i)].position(); };
  const int last = n - 1 - skip_other;
  // On thin cables more pixels are needed because of their noise.
  const double reach = std::max(2 * tangent_length * branch.half_width, 30.0);
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
  double s = 0;
  int used = 0;
  Vector2 far_point = Vector2::Zero();
  for (int i = skip; i <= last; ++i) {
    if (i > skip) s += (at(i) - at(i - 1)).norm();
    if (s > reach && used > 4) break;
    const Eigen::Vector3d basis(1, s / reach, s * s / (reach * reach));
    normal += basis * basis.transpose();
    right += basis * at(i).transpose();
    far_point = at(i);
    ++used;
  }
  const Vector2 node = graph.nodes[static_cast<std::size_t>(edge.nodes[static_cast<std::size_t>(end)])].position;
  const Vector2 other = graph.nodes[static_cast<std::size_t>(edge.nodes[static_cast<std::size_t>(1 - end)])].position;
  if (used < 4) {
    branch.point = n > 0 ? at(std::clamp(skip, 0, n - 1)) : Vector2(0.5 * (node + other));
    branch.tangent = node - other;
  } else if (s < 2 * branch.half_width || used < 8) {  // too short for a parabola
    branch.point = at(skip);
    branch.tangent = at(skip) - far_point;
  } else {
    const Eigen::Matrix<double, 3, 2> c = normal.ldlt().solve(right);
    branch.point = c.row(0).transpose();
    branch.tangent = -c.row(1).transpose();
    // In the direction into the zone the first derivative changes its sign, the second does not.
    const Vector2 second = 2 * c.row(2).transpose();
    const double speed = branch.tangent.norm();
    if (speed > 0) {
      branch.curvature = (branch.tangent.x() * second.y() - branch.tangent.y() * second.x()) / (speed * speed * speed);
    }
  }
  const double norm = branch.tangent.norm();
  branch.tangent = norm > 0 ? Vector2(branch.tangent / norm) : Vector2(1, 0);
  return branch;
}

/// True if a link splits at both ends like a fork with a narrow angle: two cables that lie on each other over some
/// length.
bool is_forked(std::size_t link, const SkeletonGraph& graph, Union& sets, const std::vector<std::vector<int>>& leaving,
               const std::vector<Branch>& branches) {
  const SkeletonEdge& edge = graph.edges[link];
  const Vector2 start = graph.nodes[static_cast<std::size_t>(edge.nodes[0])].position;
  const Vector2 direction = (graph.nodes[static_cast<std::size_t>(edge.nodes[1])].position - start).normalized();
  for (std::size_t end = 0; end < 2; ++end) {
    const int set = sets.root(edge.nodes[end]);
    int prongs = 0;
    for (const int other : leaving[static_cast<std::size_t>(set)]) {
      if (other == static_cast<int>(link)) continue;
      const SkeletonEdge& prong = graph.edges[static_cast<std::size_t>(other)];
      const std::size_t side = sets.root(prong.nodes[0]) == set ? 0 : 1;
      const Vector2 outwards = -branches[2 * static_cast<std::size_t>(other) + side].tangent;
      if (outwards.dot(end == 0 ? -direction : direction) < 0.8) return false;
      ++prongs;
    }
    if (prongs != 2) return false;
  }
  return true;
}

/// Joins nodes to zones and finds the edges inside.
class ZoneFinder {
 public:
  ZoneFinder(const SkeletonGraph& graph, const ZoneOptions& options, Continuations& result)
      : graph_(graph), options_(options), result_(result), sets_(graph.nodes.size()) {}

  void run(const std::vector<char>& known_links) {
    const std::vector<std::size_t> long_links = join_short_links(known_links);
    merge_links(long_links);
    take_in_ways_around_holes();
    number_zones();
    measure_waists();
    attach_branches();
  }

 private:
  const SkeletonNode& node(int number) const { return graph_.nodes[static_cast<std::size_t>(number)]; }

  Zone& zone_at(int node) {
    return result_.zones[static_cast<std::size_t>(zone_of_root_[static_cast<std::size_t>(sets_.root(node))])];
  }

  /// Joins the ends of links that are short, or known to be inside; returns the other links.
  std::vector<std::size_t> join_short_links(const std::vector<char>& known_links) {
    std::vector<std::size_t> long_links;
    for (std::size_t e = 0; e < graph_.edges.size(); ++e) {
      const SkeletonEdge& edge = graph_.edges[e];
      if (edge.removed || !is_junction(graph_, edge.nodes[0]) || !is_junction(graph_, edge.nodes[1])) continue;
      // Between two crossings the mask may be wider than the cable. The narrowest place gives its width.
      const double width = 2 * inner_half_width(edge);
      if (known_links[e] || edge.length < options_.short_link * width)
        take_in(e);
      else
        long_links.push_back(e);
    }
    leaving_ = edges_leaving(graph_, sets_);
    return long_links;
  }

  void take_in(std::size_t link) {
    sets_.join(graph_.edges[link].nodes[0], graph_.edges[link].nodes[1]);
    result_.inside[link] = 1;
  }

  /// Longer links are also inside if two cables lie on each other there.
  void merge_links(const std::vector<std::size_t>& long_links) {
    std::vector<std::size_t> merged;
    for (const std::size_t e : long_links) {
      const SkeletonEdge& edge = graph_.edges[e];
      const auto strands = find_side_by_side(graph_, static_cast<int>(e), result_.branches, ends_at(e));
      if (strands) {
        result_.doubts.push_back({edge.points[edge.points.size() / 2].position(), Doubt::parallel_strands});
        result_.side_by_side.push_back(*strands);
      }
      if (strands || is_wide(e)) merged.push_back(e);
    }
    for (const std::size_t e : merged) take_in(e);
  }

  /// Half edges that leave the sets of nodes at both ends of a link; none if both are one set.
  std::array<std::vector<HalfEdge>, 2> ends_at(std::size_t link) {
    std::array<std::vector<HalfEdge>, 2> ends;
    const std::array<int, 2>& nodes = graph_.edges[link].nodes;
    if (sets_.root(nodes[0]) == sets_.root(nodes[1])) return ends;
    for (const std::size_t end : {0U, 1U}) {
      const int set = sets_.root(nodes[end]);
      for (const int other : leaving_[static_cast<std::size_t>(set)]) {
        if (other == static_cast<int>(link)) continue;
        const bool starts = sets_.root(graph_.edges[static_cast<std::size_t>(other)].nodes[0]) == set;
        ends[end].push_back(2 * other + (starts ? 0 : 1));
      }
    }
    return ends;
  }

  /// True if a link is wider than one cable, or as wide and forked at both ends.
  bool is_wide(std::size_t link) {
    const SkeletonEdge& edge = graph_.edges[link];
    if (edge.length > options_.merged_link * 2 * inner_half_width(edge)) return false;
    double widest = 0;
    for (const int number : edge.nodes) {
      for (const int other : leaving_[static_cast<std::size_t>(sets_.root(number))]) {
        if (other == static_cast<int>(link)) continue;
        widest = std::max(widest, inner_half_width(graph_.edges[static_cast<std::size_t>(other)]));
      }
    }
    const double widening = widest > 0 ? inner_half_width(edge) / widest : 0;
    return widening > options_.merged_widening ||
           (widening > 0.85 && is_forked(link, graph_, sets_, leaving_, result_.branches));
  }

  /// A hole in a zone has two sides: an edge beside a link is inside too. The loop of a cable is excluded, since it is
  /// not straight.
  void take_in_ways_around_holes() {
    for (std::size_t e = 0; e < graph_.edges.size(); ++e) {
      const SkeletonEdge& edge = graph_.edges[e];
      if (edge.removed || result_.inside[e] || edge.nodes[0] < 0) continue;
      if (sets_.root(edge.nodes[0]) != sets_.root(edge.nodes[1])) continue;
      const Vector2 chord = node(edge.nodes[1]).position - node(edge.nodes[0]).position;
      const double longest = options_.merged_link * 2 * inner_half_width(edge);
      if (edge.length < std::min(longest, 1.6 * chord.norm())) result_.inside[e] = 1;
    }
  }

  void number_zones() {
    zone_of_root_.assign(graph_.nodes.size(), -1);
    for (std::size_t n = 0; n < graph_.nodes.size(); ++n) {
      if (graph_.nodes[n].edges.size() < 2) continue;
      int& number = zone_of_root_[static_cast<std::size_t>(sets_.root(static_cast<int>(n)))];
      if (number < 0) {
        number = static_cast<int>(result_.zones.size());
        result_.zones.emplace_back();
      }
      Zone& zone = result_.zones[static_cast<std::size_t>(number)];
      zone.nodes.push_back(static_cast<int>(n));
      zone.center += graph_.nodes[n].position;
    }
    for (Zone& zone : result_.zones) zone.center /= static_cast<double>(zone.nodes.size());
  }

  /// The narrowest place of each zone.
  void measure_waists() {
    for (Zone& zone : result_.zones) {
      zone.waist = std::numeric_limits<double>::infinity();
      for (const int number : zone.nodes) zone.waist = std::min(zone.waist, node(number).half_width);
    }
    for (std::size_t e = 0; e < graph_.edges.size(); ++e) {
      if (!result_.inside[e]) continue;
      double& waist = zone_at(graph_.edges[e].nodes[0]).waist;
      for (const SkeletonPoint& point : graph_.edges[e].points) waist = std::min<double>(waist, point.half_width);
    }
  }

  void attach_branches() {
    for (std::size_t e = 0; e < graph_.edges.size(); ++e) {
      const SkeletonEdge& edge = graph_.edges[e];
      if (edge.removed || result_.inside[e] || edge.nodes[0] < 0) continue;
      for (int end = 0; end < 2; ++end) {
        const int number = edge.nodes[static_cast<std::size_t>(end)];
        if (node(number).edges.size() < 2) continue;
        Zone& zone = zone_at(number);
        const HalfEdge half = 2 * static_cast<int>(e) + end;
        result_.zone_of[static_cast<std::size_t>(half)] = static_cast<int>(&zone - result_.zones.data());
        zone.branches.push_back(half);
      }
    }
  }

  const SkeletonGraph& graph_;
  const ZoneOptions& options_;
  Continuations& result_;
  Union sets_;
  std::vector<std::vector<int>> leaving_;  ///< edges that leave each set of nodes
  std::vector<int> zone_of_root_;
};

void match_zone(const Zone& zone, const ZoneOptions& options, Continuations& result) {
  std::vector<Branch> branches;
  for (const HalfEdge half : zone.branches) branches.push_back(result.branches[static_cast<std::size_t>(half)]);
  const Matching matching = match_branches(branches, zone.waist);
  for (const auto& [a, b] : matching.pairs) {
    const HalfEdge first = zone.branches[static_cast<std::size_t>(a)];
    const HalfEdge second = zone.branches[static_cast<std::size_t>(b)];
    result.partner[static_cast<std::size_t>(first)] = second;
    result.partner[static_cast<std::size_t>(second)] = first;
  }
  // The result is also doubtful if only the assumption about touching cables decides.
  const auto close = [&](double best, double second) {
    return std::isfinite(second) && second - best < options.similar_energies * second;
  };
  if (zone.branches.size() > 2 &&
      (close(matching.energy, matching.second) || close(matching.plain, matching.second_plain))) {
    result.doubts.push_back({zone.center, Doubt::similar_energies});
  }
}

/// Two ends on opposite flanks of a cable, in line with each other, are one cable that crosses it: the edge between
/// their zones becomes a link. Returns true if another one was found.
bool find_split_crossings(const SkeletonGraph& graph, const ZoneOptions& options, const Continuations& links,
                          std::vector<char>& known_links) {
  const auto singles = [&](int zone) {
    std::vector<HalfEdge> result;
    for (const HalfEdge half : links.zones[static_cast<std::size_t>(zone)].branches) {
      if (links.partner[static_cast<std::size_t>(half)] < 0) result.push_back(half);
    }
    return result;
  };
  constexpr double in_line = 0.866;  // 30 degrees
  bool found = false;
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    const SkeletonEdge& edge = graph.edges[e];
    const int first = links.zone_of[2 * e];
    const int second = links.zone_of[2 * e + 1];
    if (edge.removed || links.inside[e] || known_links[e] || first < 0 || second < 0 || first == second) continue;
    const double longest = options.merged_link * 2 * inner_half_width(edge);
    if (edge.length > longest) continue;
    for (const HalfEdge a : singles(first)) {
      for (const HalfEdge b : singles(second)) {
        const Branch& from = links.branches[static_cast<std::size_t>(a)];
        const Branch& to = links.branches[static_cast<std::size_t>(b)];
        const Vector2 chord = to.point - from.point;
        const double length = chord.norm();
        if (edge_of(a) == static_cast<int>(e) || edge_of(b) == static_cast<int>(e) || length > longest) continue;
        if (from.tangent.dot(chord) < in_line * length || to.tangent.dot(chord) > -in_line * length) continue;
        known_links[e] = 1;
        found = true;
      }
    }
  }
  return found;
}

}  // namespace

std::vector<Branch> measure_branches(const SkeletonGraph& graph, const ZoneOptions& options) {
  std::vector<Branch> branches(2 * graph.edges.size());
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    const SkeletonEdge& edge = graph.edges[e];
    if (edge.removed || edge.nodes[0] < 0) continue;
    std::array<int, 2> skips{};
    for (std::size_t end = 0; end < 2; ++end) {
      const SkeletonNode& node = graph.nodes[static_cast<std::size_t>(edge.nodes[end])];
      skips[end] = distorted_pixels(edge, static_cast<int>(end), node);
    }
    for (std::size_t end = 0; end < 2; ++end) {
      branches[2 * e + end] =
          measure_branch(graph, edge, static_cast<int>(end), skips[end], skips[1 - end], options.tangent_length);
      branches[2 * e + end].edge = static_cast<int>(e);
    }
  }
  return branches;
}

Branch measure_tip(const SkeletonGraph& graph, HalfEdge tip, const ZoneOptions& options) {
  const SkeletonEdge& edge = graph.edges[at(edge_of(tip))];
  const int end = end_of(tip);
  const int n = static_cast<int>(edge.points.size());
  const double half_width = inner_half_width(edge);
  constexpr double narrow = 0.87;
  int skip = std::min(n / 3, static_cast<int>(half_width));
  while (skip < n / 2 && edge.points[at(end == 0 ? skip : n - 1 - skip)].half_width < narrow * half_width) ++skip;
  const int other_node = edge.nodes[at(1 - end)];
  const int skip_other = distorted_pixels(edge, 1 - end, graph.nodes[at(other_node)]);
  return measure_branch(graph, edge, end, skip, std::min(skip_other, n - 1 - skip), options.tangent_length);
}

Continuations find_continuations(const SkeletonGraph& graph, const ZoneOptions& options, const ColorImage* image) {
  const std::vector<Branch> branches = measure_branches(graph, options);
  std::vector<char> known_links(graph.edges.size(), 0);
  while (true) {
    Continuations result;
    result.branches = branches;
    result.zone_of.assign(branches.size(), -1);
    result.partner.assign(branches.size(), -1);
    result.inside.assign(graph.edges.size(), 0);
    result.ways.resize(branches.size());
    ZoneFinder(graph, options, result).run(known_links);
    for (const Zone& zone : result.zones) match_zone(zone, options, result);
    for (const SideBySide& strands : result.side_by_side) split_side_by_side(graph, strands, image, result);
    if (!find_split_crossings(graph, options, result, known_links) && !grow_zones(graph, result, known_links)) {
      return result;
    }
  }
}

}  // namespace withe
