#include "vision/skeleton_graph.hpp"

#include <algorithm>
#include <cmath>
#include <queue>
#include <utility>

#include "common/hypotenuse.hpp"

namespace withe {

namespace {

/// The up to eight neighbours of a skeleton pixel, as indices. Neighbours that share a side come first, so that a walk
/// does not cut a corner.
struct NeighbourList {
  std::array<int, 8> of;
  int count = 0;
};

NeighbourList neighbours(const BitImage& skeleton, const PixelIndex& index, Pixel p) {
  static constexpr std::array<Pixel, 8> kSteps{{{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 1}, {-1, 1}, {-1, -1}, {1, -1}}};
  NeighbourList list;
  for (const Pixel step : kSteps) {
    const int x = p.x + step.x;
    const int y = p.y + step.y;
    if (skeleton.at(x, y)) list.of[static_cast<std::size_t>(list.count++)] = index(x, y);
  }
  return list;
}

double step_length(const SkeletonPoint& a, const SkeletonPoint& b) { return hypotenuse(a.x - b.x, a.y - b.y); }

double median_half_width(const std::vector<SkeletonPoint>& points) {
  if (points.empty()) return 0;
  std::vector<float> values;
  values.reserve(points.size());
  for (const SkeletonPoint& point : points) values.push_back(point.half_width);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

class Builder {
 public:
  Builder(const BitImage& skeleton, const BitImage& mask, double limit) : index_(skeleton) {
    const std::vector<Pixel>& pixels = index_.pixels();
    const std::size_t count = pixels.size();
    points_.reserve(count);
    around_.reserve(count);
    for (const Pixel pixel : pixels) {
      const double distance = distance_to_background(mask, pixel, limit, false);
      points_.push_back({pixel.x, pixel.y, static_cast<float>(distance - 0.5)});
      around_.push_back(neighbours(skeleton, index_, pixel));
    }
    node_of_.assign(count, -1);
    visited_.assign(count, 0);
  }

  SkeletonGraph build() {
    const int count = static_cast<int>(points_.size());
    for (int p = 0; p < count; ++p) {
      if (around(p).count >= 3 && node_of(p) < 0) add_cluster(p);
    }
    const std::size_t clusters = cluster_pixels_.size();
    for (std::size_t node = 0; node < clusters; ++node) {
      for (const int p : cluster_pixels_[node]) {
        const NeighbourList& list = around(p);
        for (int k = 0; k < list.count; ++k) {
          const int next = list.of[static_cast<std::size_t>(k)];
          if (node_of(next) < 0 && !visited(next)) walk(static_cast<int>(node), p, next);
        }
      }
    }
    for (int p = 0; p < count; ++p) {
      if (node_of(p) < 0 && !visited(p) && around(p).count < 2) {
        const int node = add_tip(p);
        const NeighbourList& list = around(p);
        if (list.count == 1 && node_of(list.of[0]) < 0) {
          walk(node, p, list.of[0]);
        } else {
          finish({{node, add_tip(p)}, {}, 0, 0, false}, points_[static_cast<std::size_t>(p)].half_width);
        }
      }
    }
    for (int p = 0; p < count; ++p) {
      if (node_of(p) < 0 && !visited(p)) walk(-1, -1, p);
    }
    return std::move(graph_);
  }

 private:
  const NeighbourList& around(int p) const { return around_[static_cast<std::size_t>(p)]; }
  int& node_of(int p) { return node_of_[static_cast<std::size_t>(p)]; }
  bool visited(int p) const { return visited_[static_cast<std::size_t>(p)] != 0; }

  void add_cluster(int seed) {
    const int node = static_cast<int>(graph_.nodes.size());
    std::vector<int> pending{seed};
    std::vector<int> members;
    node_of(seed) = node;
    SkeletonNode result;
    while (!pending.empty()) {
      const int p = pending.back();
      pending.pop_back();
      members.push_back(p);
      const SkeletonPoint& point = points_[static_cast<std::size_t>(p)];
      result.position += point.position();
      result.half_width = std::max(result.half_width, static_cast<double>(point.half_width));
      for (int k = 0; k < around(p).count; ++k) {
        const int next = around(p).of[static_cast<std::size_t>(k)];
        if (around(next).count >= 3 && node_of(next) < 0) {
          node_of(next) = node;
          pending.push_back(next);
        }
      }
    }
    result.position /= static_cast<double>(members.size());
    graph_.nodes.push_back(std::move(result));
    cluster_pixels_.push_back(std::move(members));
  }

  int add_tip(int p) {
    const SkeletonPoint& point = points_[static_cast<std::size_t>(p)];
    node_of(p) = static_cast<int>(graph_.nodes.size());
    graph_.nodes.push_back({point.position(), point.half_width, {}});
    return node_of(p);
  }

  /// Follows a line from pixel `from` of a node over `p` until it ends, meets a node or itself.
  void walk(int start, int from, int p) {
    SkeletonEdge edge;
    edge.nodes[0] = start;
    int last = from;
    while (true) {
      visited_[static_cast<std::size_t>(p)] = 1;
      edge.points.push_back(points_[static_cast<std::size_t>(p)]);
      const NeighbourList& list = around(p);
      int next = -1;
      for (int k = 0; k < list.count; ++k) {
        const int q = list.of[static_cast<std::size_t>(k)];
        if (q == last) continue;
        if (node_of(q) >= 0) {
          // The node it came from counts only when the line has left it.
          if (node_of(q) == start && last == from) continue;
          edge.nodes[1] = node_of(q);
          finish(std::move(edge), 0);
          return;
        }
        if (!visited(q) && next < 0) next = q;
      }
      if (next < 0) {
        if (start >= 0 || edge.points.size() < 3) {
          edge.points.pop_back();
          edge.nodes[1] = add_tip(p);
          if (start < 0) edge.nodes[0] = edge.nodes[1];
        }
        finish(std::move(edge), points_[static_cast<std::size_t>(p)].half_width);
        return;
      }
      last = p;
      p = next;
    }
  }

  void finish(SkeletonEdge edge, double half_width) {
    const int number = static_cast<int>(graph_.edges.size());
    double length = 0;
    for (std::size_t i = 1; i < edge.points.size(); ++i) length += step_length(edge.points[i - 1], edge.points[i]);
    if (edge.nodes[0] >= 0 && edge.nodes[1] >= 0) {
      const Vector2& a = graph_.nodes[static_cast<std::size_t>(edge.nodes[0])].position;
      const Vector2& b = graph_.nodes[static_cast<std::size_t>(edge.nodes[1])].position;
      if (edge.points.empty()) {
        length = (a - b).norm();
      } else {
        length += (edge.points.front().position() - a).norm() + (edge.points.back().position() - b).norm();
      }
    }
    edge.length = length;
    edge.half_width = edge.points.empty() ? half_width : median_half_width(edge.points);
    for (const int node : edge.nodes) {
      if (node >= 0) graph_.nodes[static_cast<std::size_t>(node)].edges.push_back(number);
    }
    graph_.edges.push_back(std::move(edge));
  }

  PixelIndex index_;
  std::vector<SkeletonPoint> points_;
  std::vector<NeighbourList> around_;
  std::vector<int> node_of_;
  std::vector<char> visited_;
  std::vector<std::vector<int>> cluster_pixels_;
  SkeletonGraph graph_;
};

/// At a node with two ends of lines left, makes one line of them; it keeps the number of the first.
void join_at(SkeletonGraph& graph, int number) {
  SkeletonNode& node = graph.nodes[static_cast<std::size_t>(number)];
  if (node.edges.size() != 2) return;
  const int first = node.edges[0];
  const int second = node.edges[1];
  SkeletonEdge& a = graph.edges[static_cast<std::size_t>(first)];
  const SkeletonPoint middle{static_cast<int>(std::lround(node.position.x())),
                             static_cast<int>(std::lround(node.position.y())),
                             static_cast<float>(std::min(node.half_width, 1.1 * a.half_width))};
  node.edges.clear();
  if (first == second) {  // a closed line that only the spur had given a node
    a.points.push_back(middle);
    a.nodes = {-1, -1};
    return;
  }
  SkeletonEdge& b = graph.edges[static_cast<std::size_t>(second)];
  if (a.nodes[1] != number) {
    std::reverse(a.points.begin(), a.points.end());
    std::swap(a.nodes[0], a.nodes[1]);
  }
  if (b.nodes[0] != number) {
    std::reverse(b.points.begin(), b.points.end());
    std::swap(b.nodes[0], b.nodes[1]);
  }
  a.points.push_back(middle);
  a.points.insert(a.points.end(), b.points.begin(), b.points.end());
  a.length += b.length;
  a.half_width = a.points.size() > 1 ? median_half_width(a.points) : a.half_width;
  a.nodes[1] = b.nodes[1];
  b.removed = true;
  b.points.clear();
  for (int& edge : graph.nodes[static_cast<std::size_t>(a.nodes[1])].edges) {
    if (edge == second) edge = first;
  }
}

/// The node at which an edge sprouts, or -1 where it is no spur.
int root_of_spur(const SkeletonGraph& graph, const SkeletonEdge& edge) {
  if (edge.removed || edge.nodes[0] < 0) return -1;
  for (int end = 0; end < 2; ++end) {
    const SkeletonNode& tip = graph.nodes[static_cast<std::size_t>(edge.nodes[static_cast<std::size_t>(end)])];
    const int node = other_end(edge, end);
    if (tip.edges.size() == 1 && graph.nodes[static_cast<std::size_t>(node)].edges.size() >= 3) return node;
  }
  return -1;
}

void remove_spur(SkeletonGraph& graph, int number, int root) {
  SkeletonEdge& edge = graph.edges[static_cast<std::size_t>(number)];
  const int tip = other_end(edge, edge.nodes[0] == root ? 0 : 1);
  graph.spurs.push_back({graph.nodes[at(root)].position, graph.nodes[at(tip)].position});
  edge.removed = true;
  edge.points.clear();
  for (const int end : edge.nodes) std::erase(graph.nodes[static_cast<std::size_t>(end)].edges, number);
  join_at(graph, root);
}

}  // namespace

SkeletonGraph build_graph(const BitImage& skeleton, const BitImage& mask, double limit) {
  return Builder(skeleton, mask, limit).build();
}

void prune_spurs(SkeletonGraph& graph, double ratio) {
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    if (root_of_spur(graph, graph.edges[e]) >= 0) queue.emplace(graph.edges[e].length, static_cast<int>(e));
  }
  while (!queue.empty()) {
    const auto [length, number] = queue.top();
    queue.pop();
    const SkeletonEdge& edge = graph.edges[static_cast<std::size_t>(number)];
    const int node = root_of_spur(graph, edge);
    if (node < 0) continue;
    if (edge.length > length) {  // grew since: another spur went, and two lines became one
      queue.emplace(edge.length, number);
      continue;
    }
    if (length < ratio * graph.nodes[static_cast<std::size_t>(node)].half_width) remove_spur(graph, number, node);
  }
}

void prune_short_ends(SkeletonGraph& graph, double length) {
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    if (graph.edges[e].length > length) continue;
    const int node = root_of_spur(graph, graph.edges[e]);
    if (node >= 0) remove_spur(graph, static_cast<int>(e), node);
  }
  for (SkeletonEdge& edge : graph.edges) {
    const bool alone = edge.nodes[0] >= 0 && graph.nodes[static_cast<std::size_t>(edge.nodes[0])].edges.size() == 1 &&
                       graph.nodes[static_cast<std::size_t>(edge.nodes[1])].edges.size() == 1;
    if (alone && edge.length <= length) edge.removed = true;
  }
}

}  // namespace withe
