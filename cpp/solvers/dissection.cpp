#include "solvers/dissection.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>

#include "solvers/minimum_degree.hpp"
#include "solvers/separators.hpp"

namespace withe {
namespace {

constexpr int kLeaf = 160;           // unknowns of a part that is not divided further
constexpr double kWorstShare = 0.9;  // of a part: beyond it, a division is not worth its separator

/// Unknowns that are coupled to the same unknowns are one vertex.
std::vector<std::vector<int>> find_vertices(const SparsityPattern& pattern) {
  const auto begin = [&](int k) { return pattern.row_indices.begin() + pattern.column_starts[k]; };
  std::vector<std::size_t> hashes(pattern.size);
  for (int k = 0; k < pattern.size; ++k)
    hashes[k] = std::accumulate(begin(k), begin(k + 1), std::size_t{0},
                                [](std::size_t hash, int row) { return 31 * hash + static_cast<std::size_t>(row); });
  std::vector<int> vertex(pattern.size, -1);
  std::vector<std::vector<int>> members;
  for (int k = 0; k < pattern.size; ++k) {
    if (vertex[k] >= 0) continue;
    members.emplace_back();
    for (auto row = begin(k); row < begin(k + 1); ++row) {
      if (*row < k || vertex[*row] >= 0 || hashes[*row] != hashes[k]) continue;
      if (!std::equal(begin(k), begin(k + 1), begin(*row), begin(*row + 1))) continue;
      vertex[*row] = static_cast<int>(members.size()) - 1;
      members.back().push_back(*row);
    }
  }
  return members;
}

class Dissection {
 public:
  explicit Dissection(const SparsityPattern& pattern)
      : pattern_(pattern), members_(find_vertices(pattern)), place_(pattern.size, -1) {
    std::vector<int> vertex(pattern.size);
    for (int v = 0; v < static_cast<int>(members_.size()); ++v)
      for (int k : members_[v]) vertex[k] = v;
    for (int v = 0; v < static_cast<int>(members_.size()); ++v) {
      const int k = members_[v][0];
      for (int p = pattern.column_starts[k]; p < pattern.column_starts[k + 1]; ++p) {
        const int row = pattern.row_indices[p], u = vertex[row];
        if (u != v && members_[u][0] == row) graph_.neighbours.push_back(u);
      }
      graph_.starts.push_back(static_cast<int>(graph_.neighbours.size()));
      graph_.weights.push_back(static_cast<int>(members_[v].size()));
    }
    graph_.edge_weights.assign(graph_.neighbours.size(), 1);
  }

  std::vector<int> order() {
    std::vector<int> all(members_.size());
    std::iota(all.begin(), all.end(), 0);
    local_.assign(members_.size(), -1);
    divide_components(all);
    return std::move(order_);
  }

 private:
  /// Parts that are not connected are ordered one after another, the small ones together.
  void divide_components(const std::vector<int>& vertices) {
    std::vector<int> together, open;
    std::vector<std::vector<int>> large;
    for (int v : vertices) local_[v] = 0;
    for (int root : vertices) {
      if (local_[root] < 0) continue;
      std::vector<int> component;
      int weight = 0;
      local_[root] = -1;
      open.push_back(root);
      while (!open.empty()) {
        const int v = open.back();
        open.pop_back();
        component.push_back(v);
        weight += graph_.weights[v];
        for (int e = graph_.starts[v]; e < graph_.starts[v + 1]; ++e) {
          const int u = graph_.neighbours[e];
          if (local_[u] < 0) continue;
          local_[u] = -1;
          open.push_back(u);
        }
      }
      if (weight > kLeaf) {
        std::sort(component.begin(), component.end());
        large.push_back(std::move(component));
      } else {
        together.insert(together.end(), component.begin(), component.end());
      }
    }
    if (!together.empty()) order_by_degree(together);
    for (const std::vector<int>& component : large) divide(component);
  }

  void divide(const std::vector<int>& vertices) {
    const std::vector<Part> parts = find_separator(subgraph(vertices));
    std::vector<int> of[3];
    int weights[3] = {0, 0, 0};
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const auto part = static_cast<std::size_t>(parts[i]);
      of[part].push_back(vertices[i]);
      weights[part] += graph_.weights[vertices[i]];
    }
    if (std::max(weights[0], weights[1]) > kWorstShare * (weights[0] + weights[1] + weights[2])) {
      order_by_degree(vertices);
      return;
    }
    divide_components(of[0]);
    divide_components(of[1]);
    for (int v : of[2]) order_.insert(order_.end(), members_[v].begin(), members_[v].end());
  }

  WeightedGraph subgraph(const std::vector<int>& vertices) {
    WeightedGraph result;
    for (std::size_t i = 0; i < vertices.size(); ++i) local_[vertices[i]] = static_cast<int>(i);
    for (int v : vertices) {
      for (int e = graph_.starts[v]; e < graph_.starts[v + 1]; ++e)
        if (local_[graph_.neighbours[e]] >= 0) result.neighbours.push_back(local_[graph_.neighbours[e]]);
      result.starts.push_back(static_cast<int>(result.neighbours.size()));
      result.weights.push_back(graph_.weights[v]);
    }
    result.edge_weights.assign(result.neighbours.size(), 1);
    for (int v : vertices) local_[v] = -1;
    return result;
  }

  void order_by_degree(const std::vector<int>& vertices) {
    std::vector<int> unknowns;
    for (int v : vertices) unknowns.insert(unknowns.end(), members_[v].begin(), members_[v].end());
    std::sort(unknowns.begin(), unknowns.end());
    for (std::size_t i = 0; i < unknowns.size(); ++i) place_[unknowns[i]] = static_cast<int>(i);
    SparsityPattern part{static_cast<int>(unknowns.size()), {0}, {}};
    for (int k : unknowns) {
      for (int p = pattern_.column_starts[k]; p < pattern_.column_starts[k + 1]; ++p)
        if (place_[pattern_.row_indices[p]] >= 0) part.row_indices.push_back(place_[pattern_.row_indices[p]]);
      part.column_starts.push_back(static_cast<int>(part.row_indices.size()));
    }
    for (int k : minimum_degree_order(part)) order_.push_back(unknowns[k]);
    for (int k : unknowns) place_[k] = -1;
  }

  const SparsityPattern& pattern_;
  std::vector<std::vector<int>> members_;  // unknowns of each vertex
  WeightedGraph graph_;
  std::vector<int> local_, place_;  // of vertices and of unknowns in a part, or -1
  std::vector<int> order_;
};

}  // namespace

std::vector<int> dissection_order(const SparsityPattern& pattern) { return Dissection(pattern).order(); }

}  // namespace withe
