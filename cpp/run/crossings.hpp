#pragma once
/// Rods that pass through each other, in a scene that leaves contact between rods out.

#include <string>
#include <utility>
#include <vector>

#include "contact/broad_phase.hpp"
#include "model/model.hpp"

namespace withe {

/// Finds the first crossing of two rods. Not considered are rods that share a node, that overlap when the watch begins,
/// or whose contact is ignored. Costs one box per rod and step, and distances of edges where boxes overlap.
class CrossingWatch {
 public:
  explicit CrossingWatch(const Model& model);
  /// Notes positions as a time step begins [m].
  void begin(const Model& model, const VectorX& q);
  /// Edges, one of each rod, that have come nearer to each other in the step than half the sum of their radii; nodes
  /// move evenly. Returns -1, -1 where there are none.
  std::pair<int, int> find(const Model& model, const VectorX& q);

 private:
  void set_boxes(const Model& model);
  /// The first two edges of two rods that come nearer than `share` of the sum of their radii.
  std::pair<int, int> nearest_edges(const Model& model, BroadPhase::Pair rods, double share);
  bool come_near(const Model& model, int a, int b, double share) const;

  std::vector<Vec3d> first_, last_;           ///< of each node [m]
  std::vector<std::pair<int, int>> allowed_;  ///< rods that may cross, sorted
  std::vector<Box> boxes_;                    ///< of rods on their way
  std::vector<int> edges_[2];                 ///< of both rods, in the box of the other
  BroadPhase broad_phase_;
  bool began_ = false;
};

}  // namespace withe
