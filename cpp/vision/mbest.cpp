#include "vision/mbest.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "vision/cable_paths.hpp"
#include "vision/skeleton_graph.hpp"
#include "vision/thinning.hpp"

namespace withe {

namespace {

/// Nodes of one intersection, the middle of which replaces them.
struct Intersection {
  std::vector<int> nodes;
  Vector2 center = Vector2::Zero();
  std::vector<HalfEdge> ends;
};

double largest_half_width(const SkeletonGraph& graph) {
  double largest = 0;
  for (const SkeletonNode& node : graph.nodes) largest = std::max(largest, node.half_width);
  for (const SkeletonEdge& edge : graph.edges) {
    for (const SkeletonPoint& point : edge.points) largest = std::max(largest, static_cast<double>(point.half_width));
  }
  return largest;
}

/// Discrete curvature (8.1) of the way from one place over a second to a third.
double curvature(const Vector2& from, const Vector2& over, const Vector2& to) {
  const Vector2 a = (over - from).normalized();
  const Vector2 b = (to - over).normalized();
  const double cross = a.x() * b.y() - a.y() * b.x();
  const double denominator = 1 + a.dot(b);
  return denominator > 1e-9 ? std::abs(2 * cross) / denominator : 1e9;
}

/// Clusters nodes and matches Y-shaped ones. `inside`: for every edge, true if it lies inside an intersection.
std::vector<Intersection> match_intersections(const SkeletonGraph& graph, double reach, std::vector<char>& inside) {
  std::vector<int> junctions;
  for (std::size_t n = 0; n < graph.nodes.size(); ++n) {
    if (graph.nodes[n].edges.size() >= 3) junctions.push_back(static_cast<int>(n));
  }
  const auto node = [&](int number) -> const SkeletonNode& { return graph.nodes[static_cast<std::size_t>(number)]; };
  struct Pair {
    double distance;
    int a, b;
    bool operator<(const Pair& other) const { return distance < other.distance; }
  };
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < junctions.size(); ++i) {
    for (std::size_t j = i + 1; j < junctions.size(); ++j) {
      const int a = junctions[i];
      const int b = junctions[j];
      if (node(a).edges.size() != 3 || node(b).edges.size() != 3) continue;
      const double distance = (node(a).position - node(b).position).norm();
      if (distance <= reach) pairs.push_back({distance, a, b});
    }
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<int> partner(graph.nodes.size(), -1);
  for (const Pair& pair : pairs) {
    int& a = partner[static_cast<std::size_t>(pair.a)];
    int& b = partner[static_cast<std::size_t>(pair.b)];
    if (a >= 0 || b >= 0) continue;
    a = pair.b;
    b = pair.a;
  }
  std::vector<Intersection> result;
  for (const int number : junctions) {
    const int other = partner[static_cast<std::size_t>(number)];
    if (other >= 0 && other < number) continue;
    Intersection intersection;
    intersection.nodes = {number};
    intersection.center = node(number).position;
    if (other >= 0) {
      intersection.nodes.push_back(other);
      intersection.center = 0.5 * (node(number).position + node(other).position);
      // The shortest line between both is the middle of the crossing.
      int link = -1;
      for (const int e : node(number).edges) {
        const SkeletonEdge& edge = graph.edges[static_cast<std::size_t>(e)];
        if ((edge.nodes[0] == other || edge.nodes[1] == other) && edge.nodes[0] != edge.nodes[1] &&
            (link < 0 || edge.length < graph.edges[static_cast<std::size_t>(link)].length)) {
          link = e;
        }
      }
      if (link >= 0) inside[static_cast<std::size_t>(link)] = 1;
    }
    result.push_back(std::move(intersection));
  }
  for (Intersection& intersection : result) {
    for (const int number : intersection.nodes) {
      int seen = -1;
      for (const int e : node(number).edges) {
        if (inside[static_cast<std::size_t>(e)] || e == seen) continue;
        seen = e;
        for (int end = 0; end < 2; ++end) {
          if (graph.edges[static_cast<std::size_t>(e)].nodes[static_cast<std::size_t>(end)] == number) {
            intersection.ends.push_back(2 * e + end);
          }
        }
      }
    }
    std::sort(intersection.ends.begin(), intersection.ends.end());
    intersection.ends.erase(std::unique(intersection.ends.begin(), intersection.ends.end()), intersection.ends.end());
  }
  return result;
}

/// The pairs of the first four ends with the least sum of curvatures; for three ends, one pair.
void pair_ends(const std::vector<Vector2>& points, const Intersection& intersection, std::vector<HalfEdge>& partner) {
  const std::size_t n = intersection.ends.size();
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto cost = [&](std::size_t a, std::size_t b) { return curvature(points[a], intersection.center, points[b]); };
  const auto join = [&](std::size_t a, std::size_t b) {
    partner[static_cast<std::size_t>(intersection.ends[a])] = intersection.ends[b];
    partner[static_cast<std::size_t>(intersection.ends[b])] = intersection.ends[a];
  };
  if (n >= 4) {
    double best = std::numeric_limits<double>::infinity();
    std::size_t mate = 1;
    for (std::size_t k = 1; k < 4; ++k) {
      const std::size_t c = k == 1 ? 2 : 1;
      const std::size_t d = k == 3 ? 2 : 3;
      const double sum = cost(0, k) + cost(c, d);
      if (sum < best) {
        best = sum;
        mate = k;
      }
    }
    join(0, mate);
    join(mate == 1 ? 2 : 1, mate == 3 ? 2 : 3);
  } else if (n >= 2) {
    std::size_t a = 0;
    std::size_t b = 1;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) {
        if (cost(i, j) < cost(a, b)) a = i, b = j;
      }
    }
    join(a, b);
  }
}

/// Ends of edges that meet in intersections, in pairs with the least bending.
struct Meeting {
  std::vector<Intersection> intersections;
  std::vector<int> intersection_of;  ///< per half edge, or -1
  std::vector<int> trimmed;          ///< points left out of each half edge, where the mask is widened
};

Meeting meet(const SkeletonGraph& graph, double widest, Continuations& links) {
  Meeting meeting;
  meeting.intersections = match_intersections(graph, 10 * widest, links.inside);
  meeting.intersection_of.assign(2 * graph.edges.size(), -1);
  meeting.trimmed.assign(2 * graph.edges.size(), 0);
  for (std::size_t i = 0; i < meeting.intersections.size(); ++i) {
    const Intersection& intersection = meeting.intersections[i];
    std::vector<Vector2> points;
    for (const HalfEdge half : intersection.ends) {
      meeting.intersection_of[static_cast<std::size_t>(half)] = static_cast<int>(i);
      const SkeletonEdge& edge = graph.edges[static_cast<std::size_t>(edge_of(half))];
      const int n = static_cast<int>(edge.points.size());
      // The new ends are outside the widened part of the mask.
      const int trim = std::clamp(static_cast<int>(widest), 0, std::max(n / 2 - 1, 0));
      meeting.trimmed[static_cast<std::size_t>(half)] = trim;
      points.push_back(n == 0
                           ? intersection.center
                           : edge.points[static_cast<std::size_t>(end_of(half) == 0 ? trim : n - 1 - trim)].position());
    }
    pair_ends(points, intersection, links.partner);
  }
  return meeting;
}

/// The rows of one cable, in their order.
class Rows {
 public:
  bool empty() const { return rows_.empty(); }

  void add(const Vector2& point, double width, bool hidden) {
    rows_.push_back(point);
    cable_.widths.push_back(width);
    cable_.hidden.push_back(hidden ? 1 : 0);
  }

  /// Adds a straight hidden path with one row per pixel, as wide as the row before it. Its end point is excluded.
  void lead_to(const Vector2& to) {
    const Vector2 from = rows_.back();
    const double width = cable_.widths.back();
    const int steps = static_cast<int>((to - from).norm());
    for (int k = 1; k < steps; ++k) add(from + static_cast<double>(k) / steps * (to - from), width, true);
  }

  /// Adds a path across the middle of an intersection.
  void lead_over(const Vector2& center) {
    lead_to(center);
    add(center, cable_.widths.back(), true);
  }

  Cable finished(bool closed) {
    cable_.closed = closed;
    cable_.centreline.resize(static_cast<Eigen::Index>(rows_.size()), 2);
    for (std::size_t i = 0; i < rows_.size(); ++i)
      cable_.centreline.row(static_cast<Eigen::Index>(i)) = rows_[i].transpose();
    return std::move(cable_);
  }

 private:
  std::vector<Vector2> rows_;
  Cable cable_;
};

Rows rows_of(const SkeletonGraph& graph, const Meeting& meeting, const CablePath& path) {
  Rows rows;
  for (const HalfEdge entry : path.entries) {
    const SkeletonEdge& edge = graph.edges[static_cast<std::size_t>(edge_of(entry))];
    const int n = static_cast<int>(edge.points.size());
    const int first = meeting.trimmed[static_cast<std::size_t>(entry)];
    const int last = n - 1 - meeting.trimmed[static_cast<std::size_t>(opposite(entry))];
    const int at = meeting.intersection_of[static_cast<std::size_t>(entry)];
    for (int i = first; i <= last; ++i) {
      const SkeletonPoint& point = edge.points[static_cast<std::size_t>(end_of(entry) == 0 ? i : n - 1 - i)];
      if (i == first && !rows.empty()) {
        if (at >= 0) rows.lead_over(meeting.intersections[static_cast<std::size_t>(at)].center);
        rows.lead_to(point.position());
      }
      rows.add(point.position(), 2 * point.half_width + 1, false);
    }
  }
  return rows;
}

/// Finds crossings: two strands across the same middle cross.
void find_crossings(const std::vector<Intersection>& intersections, Tracing& tracing) {
  for (const Intersection& intersection : intersections) {
    std::vector<CableRow> visits;
    for (std::size_t c = 0; c < tracing.cables.size(); ++c) {
      const MatrixX2& line = tracing.cables[c].centreline;
      for (Eigen::Index row = 0; row < line.rows(); ++row) {
        if (line.row(row).transpose() == intersection.center)
          visits.push_back({static_cast<int>(c), static_cast<int>(row)});
      }
    }
    if (visits.size() == 2) tracing.crossings.push_back({intersection.center, visits[0], visits[1], 0});
  }
}

}  // namespace

Tracing trace_mbest(const BitImage& mask) {
  Tracing tracing;
  const BitImage skeleton = thin(mask);
  SkeletonGraph graph = build_graph(skeleton, mask, 200);
  const double widest = largest_half_width(graph) + 0.5;

  // Split ends: shorter than the diameter of the widest cable.
  prune_short_ends(graph, 2 * widest);

  Continuations links;
  links.partner.assign(2 * graph.edges.size(), -1);
  links.inside.assign(graph.edges.size(), 0);
  const Meeting meeting = meet(graph, widest, links);
  for (const CablePath& path : collect_paths(graph, links)) {
    Rows rows = rows_of(graph, meeting, path);
    if (!rows.empty()) tracing.cables.push_back(rows.finished(path.closed));
  }
  find_crossings(meeting.intersections, tracing);
  return tracing;
}

void decide_order_mbest(const ColorImage& image, Tracing& tracing) {
  const auto spread = [&](const CableRow& at) {
    const Cable& cable = tracing.cables[static_cast<std::size_t>(at.cable)];
    const int n = static_cast<int>(cable.centreline.rows());
    int first = at.row;
    int last = at.row;
    while (first > 0 && cable.hidden[static_cast<std::size_t>(first - 1)]) --first;
    while (last + 1 < n && cable.hidden[static_cast<std::size_t>(last + 1)]) ++last;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Vector3d squares = Eigen::Vector3d::Zero();
    for (int row = first; row <= last; ++row) {
      const Vector2 center = cable.centreline.row(row).transpose();
      Eigen::Vector3d color = Eigen::Vector3d::Zero();
      for (int dy = -2; dy <= 2; ++dy) {
        for (int dx = -2; dx <= 2; ++dx) color += image.sample(center + Vector2(dx, dy)).cast<double>() / 25;
      }
      sum += color;
      squares += color.cwiseProduct(color);
    }
    const double count = last - first + 1;
    return (squares / count - (sum / count).cwiseProduct(sum / count)).cwiseMax(0).cwiseSqrt().sum();
  };
  for (Crossing& crossing : tracing.crossings) {
    const double a = spread(crossing.over);
    const double b = spread(crossing.under);
    if (b < a) std::swap(crossing.over, crossing.under);
    crossing.confidence = a + b > 0 ? std::abs(a - b) / (a + b) : 0;
  }
}

}  // namespace withe
