#include "vision/parallel_strands.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "vision/skeleton_line.hpp"

namespace withe {

namespace {

/// Mean colour of a branch where it leaves the zone.
Eigen::Vector3f mean_color(const ColorImage& image, const SkeletonEdge& edge, int end, const Branch& branch) {
  const int n = static_cast<int>(edge.points.size());
  const int last = std::min(n, branch.skip + 1 + static_cast<int>(8 * branch.half_width));
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (int i = branch.skip; i < last; ++i) sum += image.sample(edge.points[at(end == 0 ? i : n - 1 - i)].position());
  return sum / static_cast<float>(std::max(1, last - branch.skip));
}

/// Rows, from the first to the last, at which the mask is as narrow as one strand: there they change sides.
std::vector<std::pair<int, int>> find_waists(const SkeletonLine& line, double both) {
  std::vector<std::pair<int, int>> waists;
  const int apart = static_cast<int>(std::lround(0.5 * both));
  for (int i = 0; i < line.count(); ++i) {
    if (line.half_width(i) > 0.65 * 0.5 * both) continue;
    if (!waists.empty() && i - waists.back().second < apart) {
      waists.back().second = i;
    } else {
      waists.emplace_back(i, i);
    }
  }
  return waists;
}

/// True if the strand on the left of the first end is that on the right of the second, by widths, or then by colours;
/// otherwise as `expected`.
bool change_sides(const SkeletonGraph& graph, const std::array<HalfEdge, 2>& first,
                  const std::array<HalfEdge, 2>& second, const ColorImage* image, const std::vector<Branch>& branches,
                  bool expected) {
  const auto width = [&](HalfEdge half) { return 2 * branches[at(half)].half_width; };
  const auto difference = [&](auto&& apart) {
    return apart(first[0], second[0]) + apart(first[1], second[1]) - apart(first[0], second[1]) -
           apart(first[1], second[0]);
  };
  const double by_width = difference([&](HalfEdge a, HalfEdge b) { return std::abs(width(a) - width(b)); });
  const double clear = 0.15 * (width(first[0]) + width(first[1]) + width(second[0]) + width(second[1]));
  if (std::abs(by_width) > clear) return by_width > 0;
  if (image == nullptr) return expected;
  const auto color = [&](HalfEdge half) {
    return mean_color(*image, graph.edges[at(edge_of(half))], end_of(half), branches[at(half)]);
  };
  const double by_color =
      difference([&](HalfEdge a, HalfEdge b) { return static_cast<double>((color(a) - color(b)).norm()); });
  constexpr double grain = 30;  // [grey levels]
  return std::abs(by_color) > grain ? by_color > 0 : expected;
}

}  // namespace

std::optional<SideBySide> find_side_by_side(const SkeletonGraph& graph, int link, const std::vector<Branch>& branches,
                                            const std::array<std::vector<HalfEdge>, 2>& leaving) {
  if (leaving[0].size() != 2 || leaving[1].size() != 2) return std::nullopt;
  const SkeletonLine line(graph.edges[at(link)]);
  double both = 0;  // widths of both strands, or half widths of all four branches
  for (const auto& end : leaving) both += branches[at(end[0])].half_width + branches[at(end[1])].half_width;
  if (line.count() < 8 || graph.edges[at(link)].length < 4 * 0.5 * both) return std::nullopt;
  const int margin = std::min(line.count() / 4, static_cast<int>(0.5 * both));
  // The skeleton of a line with an even number of pixels lies half a pixel beside its middle: counted for two, not one.
  const double full = 0.5 * both + 0.5;
  int wide = 0;
  for (int i = margin; i < line.count() - margin; ++i) wide += line.half_width(i) > 0.8 * full ? 1 : 0;
  // If two cables cross at a small angle, less than half of the link is as wide as that.
  if (wide < 0.6 * (line.count() - 2 * margin)) return std::nullopt;
  return SideBySide{link, {{{leaving[0][0], leaving[0][1]}, {leaving[1][0], leaving[1][1]}}}};
}

void split_side_by_side(const SkeletonGraph& graph, const SideBySide& strands, const ColorImage* image,
                        Continuations& links) {
  const int zone = links.zone_of[at(strands.branches[0][0])];
  for (const auto& end : strands.branches) {
    for (const HalfEdge half : end) {
      if (links.zone_of[at(half)] != zone) return;
    }
  }
  if (zone < 0 || links.zones[at(zone)].branches.size() != 4) return;
  const SkeletonLine line(graph.edges[at(strands.link)]);

  // Left and right are seen along the link.
  std::array<std::array<HalfEdge, 2>, 2> sides = strands.branches;
  for (const int end : {0, 1}) {
    const int row = end == 0 ? 0 : line.count() - 1;
    const auto aside = [&](HalfEdge half) {
      return cross(line.tangent(row), links.branches[at(half)].point - line.position(row));
    };
    std::array<HalfEdge, 2>& pair = sides[at(end)];
    if (aside(pair[0]) < aside(pair[1])) std::swap(pair[0], pair[1]);
  }
  double both = 0;
  for (const auto& end : sides) both += links.branches[at(end[0])].half_width + links.branches[at(end[1])].half_width;
  const std::vector<std::pair<int, int>> waists = find_waists(line, both);
  const bool expected = waists.size() % 2 == 1;
  const bool change = change_sides(graph, sides[0], sides[1], image, links.branches, expected);
  // From 1 on the left to -1 on the right. Where widths or colours contradict the waists, the way over is gradual.
  const auto side = [&](int i) {
    if (change != expected) return change ? 1 - 2.0 * i / line.count() : 1.0;
    double result = 1;
    for (const auto& [first, last] : waists) {
      const double t = std::clamp((i - first + 1.0) / (last - first + 2.0), 0.0, 1.0);
      result *= 1 - 2 * t;
    }
    return result;
  };
  for (const int strand : {0, 1}) {
    const HalfEdge from = sides[0][at(strand)];
    const HalfEdge to = sides[1][at(change ? 1 - strand : strand)];
    links.partner[at(from)] = to;
    links.partner[at(to)] = from;
    const double half_width = 0.5 * (links.branches[at(from)].half_width + links.branches[at(to)].half_width);
    const int margin = std::min(line.count() / 4, static_cast<int>(std::lround(half_width)));
    const int step = std::max(2, static_cast<int>(std::lround(half_width)));
    const double start = strand == 0 ? 1 : -1;
    std::vector<Vector2> way;
    for (int i = margin; i < line.count() - margin; i += step) {
      const double aside = start * side(i) * std::max(0.0, line.half_width(i) - half_width);
      way.push_back(line.position(i) + aside * line.normal(i));
    }
    links.ways[at(from)] = way;
    std::reverse(way.begin(), way.end());
    links.ways[at(to)] = std::move(way);
  }
}

}  // namespace withe
