#include "vision/cable_paths.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <unordered_map>

namespace withe {

void bridge_gaps(Continuations& links, const std::vector<std::vector<Vector2>>& ends, const GapOptions& options) {
  struct Bridge {
    double length;
    HalfEdge a, b;
    bool operator<(const Bridge& other) const { return length < other.length; }
  };
  // Tips in cells of the size of the longest gap, so that only near ones are compared.
  std::unordered_map<std::int64_t, std::vector<HalfEdge>> cells;
  // An end at the flank of a cable was measured before that cable, which the bridge crosses.
  double widest = 0;
  for (std::size_t h = 0; h < ends.size(); ++h) {
    if (!ends[h].empty()) widest = std::max(widest, 2 * links.branches[h].half_width);
  }
  const auto half_width = [&](HalfEdge half) { return links.branches[static_cast<std::size_t>(half)].half_width; };
  const auto is_bridge = [&](HalfEdge a, HalfEdge b, const Vector2& bridge) {
    const double length = bridge.norm();
    double beyond = 0;
    for (const HalfEdge half : {a, b}) {
      // An end that may be round is assumed a little before the mask ends.
      beyond += (links.zone_of[static_cast<std::size_t>(half)] >= 0 ? 4.0 : 0.25) * half_width(half);
    }
    const auto fits = [&](double longest, double degrees) {
      if (length > longest + beyond) return false;
      const double least = std::cos(degrees * std::numbers::pi / 180) * length;
      return length == 0 || (links.branches[static_cast<std::size_t>(a)].tangent.dot(bridge) >= least &&
                             links.branches[static_cast<std::size_t>(b)].tangent.dot(bridge) <= -least);
    };
    if (fits(options.longest, options.angle)) return true;
    const double narrow = std::min(half_width(a), half_width(b));
    const double wide = std::max(half_width(a), half_width(b));
    return narrow >= options.like_widths * wide &&
           fits(options.longest_straight * (narrow + wide), options.straight_angle);
  };
  const double size = std::max(options.longest, options.longest_straight * widest) + 4 * widest;
  const auto cell = [&](const Vector2& point, int dx, int dy) {
    const auto column = static_cast<std::int64_t>(std::floor(point.x() / size)) + dx;
    const auto row = static_cast<std::int64_t>(std::floor(point.y() / size)) + dy;
    return (row << 32) + column;
  };
  std::vector<Bridge> bridges;
  for (std::size_t h = 0; h < ends.size(); ++h) {
    if (ends[h].empty()) continue;
    const auto half = static_cast<HalfEdge>(h);
    const Vector2 tip = ends[h].back();
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const auto found = cells.find(cell(tip, dx, dy));
        if (found == cells.end()) continue;
        for (const HalfEdge other : found->second) {
          const Vector2 bridge = ends[static_cast<std::size_t>(other)].back() - tip;
          if (is_bridge(half, other, bridge)) bridges.push_back({bridge.norm(), half, other});
        }
      }
    }
    cells[cell(tip, 0, 0)].push_back(half);
  }
  std::sort(bridges.begin(), bridges.end());
  for (const Bridge& bridge : bridges) {
    HalfEdge& a = links.partner[static_cast<std::size_t>(bridge.a)];
    HalfEdge& b = links.partner[static_cast<std::size_t>(bridge.b)];
    if (a >= 0 || b >= 0) continue;
    a = bridge.b;
    b = bridge.a;
  }
}

std::vector<CablePath> collect_paths(const SkeletonGraph& graph, const Continuations& links) {
  std::vector<CablePath> paths;
  std::vector<char> used(graph.edges.size(), 0);
  const auto follow = [&](HalfEdge entry) {
    CablePath path;
    const HalfEdge start = entry;
    while (true) {
      used[static_cast<std::size_t>(edge_of(entry))] = 1;
      path.entries.push_back(entry);
      const HalfEdge next = links.partner[static_cast<std::size_t>(opposite(entry))];
      if (next < 0) break;
      if (next == start) {
        path.closed = true;
        break;
      }
      entry = next;
    }
    paths.push_back(std::move(path));
  };
  const auto available = [&](std::size_t e) { return !graph.edges[e].removed && !links.inside[e] && !used[e]; };
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    for (int end = 0; end < 2; ++end) {
      const HalfEdge half = 2 * static_cast<int>(e) + end;
      if (available(e) && graph.edges[e].nodes[0] >= 0 && links.partner[static_cast<std::size_t>(half)] < 0) {
        follow(half);
      }
    }
  }
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    if (!available(e)) continue;
    if (graph.edges[e].nodes[0] < 0) {
      used[e] = 1;
      paths.push_back({{2 * static_cast<int>(e)}, true});
    } else {
      follow(2 * static_cast<int>(e));
    }
  }
  return paths;
}

}  // namespace withe
