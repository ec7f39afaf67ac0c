#pragma once
/// How far a step of Newton's method moves and turns what a scene is made of.

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
  /// Whether `cap` surely leaves a step alone in which no node moves, and nothing turns, by more than `most`.
  bool leaves_alone(double most) const;

  bool is_angle(Eigen::Index unknown) const { return is_angle_[static_cast<std::size_t>(unknown)]; }
  double shortest_edge() const { return shortest_edge_; }  ///< [m]

 private:
  /// Unknowns that are one vector: a node's position, a frame's rotation, an angle.
  struct Block {
    int first, size;
  };
  static double greatest(const std::vector<Block>& blocks, const VectorX& step);
  double greatest_edge_turn(const VectorX& step) const;

  const Model& model_;
  std::vector<bool> is_angle_;
  std::vector<Block> nodes_, angles_;
  double shortest_edge_ = 1.0;
};

}  // namespace withe
