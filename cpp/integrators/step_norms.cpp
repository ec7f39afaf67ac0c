#include "integrators/step_norms.hpp"

#include <algorithm>
#include <cmath>

namespace withe {
namespace {

// A step is cut where a node moves by more than this share of the scene, an angle or an edge turns by more [rad].
constexpr double kFarthest = 0.5, kGreatestAngle = 1.5, kGreatestEdgeTurn = 1.0;

}  // namespace

StepNorms::StepNorms(const Model& model) : model_(model), shortest_edge_(model.edge_length.minCoeff()) {
  is_angle_.assign(static_cast<std::size_t>(model.dof_count), true);
  for (int dof : model.node_dof)
    for (int i = 0; i < model.dimension; ++i) is_angle_[static_cast<std::size_t>(dof + i)] = false;
  for (int dof : model.node_dof) nodes_.push_back({dof, model.dimension});
  for (int dof : model.frame_dof) angles_.push_back({dof, model.frame_size()});
  for (int dof : model.edge_dof) angles_.push_back({dof, 1});
  for (const Hinge& hinge : model.hinges) angles_.push_back({hinge.dof, 1});
}

double StepNorms::greatest(const std::vector<Block>& blocks, const VectorX& step) {
  double square = 0.0;
  for (const Block& block : blocks) {
    double sum = 0.0;
    for (int i = 0; i < block.size; ++i) sum += step(block.first + i) * step(block.first + i);
    square = std::max(square, sum);
  }
  return std::sqrt(square);
}

/// Greatest change of an edge vector over its length.
double StepNorms::greatest_edge_turn(const VectorX& step) const {
  double edge_turn = 0.0;
  for (int e = 0; e < model_.edge_count; ++e) {
    const auto i = static_cast<std::size_t>(e);
    const int a = model_.tail_dof[i], b = model_.head_dof[i];
    double square = 0.0;
    for (int k = 0; k < model_.dimension; ++k) square += (step(b + k) - step(a + k)) * (step(b + k) - step(a + k));
    edge_turn = std::max(edge_turn, square / (model_.edge_length(e) * model_.edge_length(e)));
  }
  return std::sqrt(edge_turn);
}

double StepNorms::cap(const VectorX& step) const {
  const double move = greatest(nodes_, step), turn = greatest(angles_, step), edge_turn = greatest_edge_turn(step);
  double factor = 1.0;
  if (move > kFarthest * model_.length_scale) factor = kFarthest * model_.length_scale / move;
  if (turn * factor > kGreatestAngle) factor = kGreatestAngle / turn;
  if (edge_turn * factor > kGreatestEdgeTurn) factor = kGreatestEdgeTurn / edge_turn;
  return factor;
}

double StepNorms::turn(const VectorX& step) const {
  return std::max(greatest_edge_turn(step), 0.5 * greatest(angles_, step));
}

double StepNorms::displacement(const VectorX& step) const {
  return std::max(greatest(nodes_, step), shortest_edge_ * greatest(angles_, step));
}

bool StepNorms::leaves_alone(double most) const {
  // Both ends of an edge may move by it, in opposite directions.
  return most <= 0.5 * std::min({kGreatestEdgeTurn * shortest_edge_, 2.0 * kFarthest * model_.length_scale,
                                 2.0 * kGreatestAngle});
}

}  // namespace withe
