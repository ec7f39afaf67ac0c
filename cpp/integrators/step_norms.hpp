#pragma once
/// Norms of a step of Newton's method: displacements and rotations of the parts of a scene.

#include <vector>

#include "model/model.hpp"

namespace withe {

class StepNorms {
 public:
  explicit StepNorms(const Model& model);

  /// Greatest displacement, angles times the shortest edge [m].
  double displacement(const VectorX& step) const;
  /// Greatest turn of an edge against its length [rad], or half the greatest rotation about a tangent or of a frame.
  double turn(const VectorX& step) const;
  /// Factor by which a step is shortened, so that nothing moves or turns too far at once.
  double cap(const VectorX& step) const;
  /// True if `cap` certainly does not shorten a step in which no node moves, and nothing turns, by more than `most`.
  bool leaves_alone(double most) const;

  /// Indicators per unknown: `coordinates` is 1 for a coordinate of a node, and `angles` is 1 for an angle; else 0. The
  /// `inverse_arms` turn a force or moment into a force: 1 for forces, the inverse of the shortest edge [1/m] for
  /// moments.
  const VectorX& coordinates() const { return coordinates_; }
  const VectorX& angles() const { return angles_; }
  const VectorX& inverse_arms() const { return inverse_arms_; }
  double shortest_edge() const { return shortest_edge_; }  ///< [m]

 private:
  double farthest_node(const VectorX& step) const;
  double greatest_angle(const VectorX& step) const;
  double greatest_edge_turn(const VectorX& step) const;
  bool leaves_edges_alone(double most) const;

  const Model& model_;
  VectorX coordinates_, angles_, inverse_arms_;
  std::vector<int> single_angles_, rotations_;  ///< first unknowns of angles, and of rotations in space
  double shortest_edge_ = 1.0;
};

}  // namespace withe
