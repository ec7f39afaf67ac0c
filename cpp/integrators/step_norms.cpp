#include "integrators/step_norms.hpp"

#include <algorithm>
#include <cmath>

namespace withe {
namespace {

// Displacement of a node in one iteration, over the length of the scene; change of an angle, and turn of an edge [rad].
// Longer steps are shortened: beyond a right angle the linear solution has no meaning.
constexpr double kMaxMove = 0.5, kMaxAngle = 1.5, kMaxEdgeTurn = 1.0;

/// Greatest squared norm of vectors of this number of unknowns.
template <int Size>
double greatest_square(const std::vector<int>& firsts, const VectorX& step) {
  double square = 0.0;
  for (int first : firsts) square = std::max(square, step.segment<Size>(first).squaredNorm());
  return square;
}

}  // namespace

StepNorms::StepNorms(const Model& model) : model_(model), shortest_edge_(model.shortest_length) {
  coordinates_.setZero(model.dof_count);
  for (int dof : model.node_dof) coordinates_.segment(dof, model.dimension).setOnes();
  for (const Slide& slide : model.slides) coordinates_[slide.dof] = 1.0;
  for (const Loop& loop : model.loops) coordinates_.segment(loop.dof, model.dimension).setOnes();
  angles_ = 1.0 - coordinates_.array();
  inverse_arms_ = coordinates_ + (1.0 / shortest_edge_) * angles_;
  (model.planar() ? single_angles_ : rotations_) = model.frame_dof;
  single_angles_.insert(single_angles_.end(), model.edge_dof.begin(), model.edge_dof.end());
  for (const Hinge& hinge : model.hinges) single_angles_.push_back(hinge.dof);
}

double StepNorms::farthest_node(const VectorX& step) const {
  return std::sqrt(model_.planar() ? greatest_square<2>(model_.node_dof, step)
                                   : greatest_square<3>(model_.node_dof, step));
}

double StepNorms::greatest_angle(const VectorX& step) const {
  return std::sqrt(std::max(greatest_square<1>(single_angles_, step), greatest_square<3>(rotations_, step)));
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
  const double move = farthest_node(step), turn = greatest_angle(step);
  double factor = 1.0;
  if (move > kMaxMove * model_.length_scale) factor = kMaxMove * model_.length_scale / move;
  if (turn * factor > kMaxAngle) factor = kMaxAngle / turn;
  if (leaves_edges_alone(move)) return factor;
  const double edge_turn = greatest_edge_turn(step);
  if (edge_turn * factor > kMaxEdgeTurn) factor = kMaxEdgeTurn / edge_turn;
  return factor;
}

double StepNorms::turn(const VectorX& step) const {
  return std::max(greatest_edge_turn(step), 0.5 * greatest_angle(step));
}

double StepNorms::displacement(const VectorX& step) const {
  return std::max(farthest_node(step), shortest_edge_ * greatest_angle(step));
}

bool StepNorms::leaves_alone(double most) const {
  return leaves_edges_alone(most) && most <= std::min(kMaxMove * model_.length_scale, kMaxAngle);
}

/// Both ends of an edge may move by it, in opposite directions.
bool StepNorms::leaves_edges_alone(double most) const { return most <= 0.5 * kMaxEdgeTurn * shortest_edge_; }

}  // namespace withe
