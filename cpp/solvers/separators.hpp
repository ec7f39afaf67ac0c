#pragma once
/// Graphs with weights, and vertices whose removal leaves two parts of about the same weight: found on a coarse graph
/// [Karypis and Kumar 1998], and refined on each finer one [Hendrickson and Rothberg 1998].

#include <vector>

namespace withe {

/// Undirected, without loops; both directions of an edge are stored.
struct WeightedGraph {
  std::vector<int> starts{0};  ///< count + 1
  std::vector<int> neighbours;
  std::vector<int> edge_weights;  ///< as `neighbours`
  std::vector<int> weights;       ///< of the vertices, positive

  int count() const { return static_cast<int>(weights.size()); }
  int degree(int v) const { return starts[v + 1] - starts[v]; }
  int total() const;
};

enum class Part : signed char { left, right, separator };

/// Divides a connected graph. No edge joins left and right. One of them is empty where no separator was found.
std::vector<Part> find_separator(const WeightedGraph& graph);

}  // namespace withe
