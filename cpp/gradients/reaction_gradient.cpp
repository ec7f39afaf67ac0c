// Reactions are rows of the residual of held unknowns, from which `World::reaction` computes forces and moments.

#include <Eigen/Geometry>

#include "geometry/rotation.hpp"
#include "gradients/step_gradient.hpp"
#include "model/edge_vectors.hpp"

namespace withe {

void StepGradient::add_reactions(const ReactionAdjoint& reactions, StepAdjoint& adjoint) {
  const SupportAdjoint& by = reactions.by;
  const Model& model = equations_.model();
  by_rows_.setZero(model.dof_count);
  const auto row = [&](const MatrixX3& table, std::size_t s) {
    const auto i = static_cast<Eigen::Index>(s);
    return i < table.rows() ? Vector3(reactions.share * table.row(i)) : Vector3(Vector3::Zero());
  };
  for (std::size_t s = 0; s < model.supports.size(); ++s) {
    if (!model.supports[s].active) continue;
    if (model.supports[s].is_hand())
      add_hand_reaction(static_cast<int>(s), row(by.forces, s), row(by.moments, s), reactions.about[s].position,
                        adjoint);
    else
      add_reaction(model.supports[s], row(by.forces, s), row(by.moments, s));
  }
  by_rows_ = equations_.assembler().held_part(by_rows_);
  if (model.planar()) {
    for (const Support& support : model.supports)
      if (support.active && support.frame >= 0)
        add_held_inertia(model.frame_dof[at(support.frame)], adjoint.coefficients);
    return;
  }
  for (const Support& support : model.supports) {
    if (!support.active) continue;
    if (support.frame >= 0) add_frame_reaction(model.frame_dof[at(support.frame)], adjoint.coefficients);
    for (int edge : support.edges) add_held_inertia(model.edge_dof[at(edge)], adjoint.coefficients);
  }
  if (moves()) return;
  // The rows of an equilibrium refer to reference directors that turn with their edges. Fixed reference directors would
  // add -torque spin to nodes, with d spin = -t x de / (2 l^2).
  for (int e = 0; e < model.edge_count; ++e) {
    const EdgeFrame<double>& f = data_.configuration.edge[at(e)];
    const double torque = data_.full_residual[model.edge_dof[at(e)]];
    const Vec3d apart = edge_vector(model, by_rows_, e);
    add_to_edge(model, e, (0.5 * torque * f.inverse_length * f.inverse_length) * cross(apart, f.tangent), by_z_);
  }
}

void StepGradient::add_reaction(const Support& s, const Vector3& by_force, const Vector3& by_moment) {
  const Model& model = equations_.model();
  add_to_node(model, s.node, by_force, by_rows_);
  if (s.frame >= 0) {
    const int dof = model.frame_dof[at(s.frame)];
    if (model.planar())
      by_rows_[dof] += by_moment.dot(model.plane->normal);
    else
      by_rows_.segment<3>(dof) += by_moment;
  }
  if (s.other_node < 0) return;
  const VectorX held = equations_.assembler().held_part(data_.full_residual);
  const Vector3 arm = node_vector(model, z_, s.other_node) - node_vector(model, z_, s.node);
  const Vector3 other = node_vector(model, held, s.other_node);
  add_to_node(model, s.other_node, by_force + by_moment.cross(arm), by_rows_);
  Vector3 by_arm = other.cross(by_moment);
  if (!model.planar()) by_arm += add_angle_reaction(s.edge, arm, by_moment, held);
  add_to_node(model, s.other_node, by_arm, by_z_);
  add_to_node(model, s.node, -by_arm, by_z_);
}

/// Adjoint of the torque on an edge along `arm`. Returns the derivative by that.
Vector3 StepGradient::add_angle_reaction(int edge, const Vector3& arm, const Vector3& by_moment, const VectorX& held) {
  const int angle = equations_.model().edge_dof[at(edge)];
  const Vector3 t = arm.normalized();
  by_rows_[angle] += by_moment.dot(t);
  return held[angle] / arm.norm() * (by_moment - by_moment.dot(t) * t);
}

/// Moments are about where the hand is read out, whose derivative is that by where it is at the end of the step.
void StepGradient::add_hand_reaction(int support, const Vector3& by_force, const Vector3& by_moment,
                                     const Vector3& about, StepAdjoint& adjoint) {
  const Model& model = equations_.model();
  const Support& hand = model.supports[at(support)];
  if (hand.yields()) {
    if (by_force.isZero() && by_moment.isZero()) return;
    const std::vector<SupportPose>& poses = step_->prescribed.supports;
    const Vector3 end = poses.empty() ? step_->start.hands[at(support)].position : poses[at(support)].position;
    equations_.hands()->add_wrench_adjoint(equations_.problem(), data_, support,
                                           by_force + by_moment.cross(end - about), by_moment, adjoint, by_z_);
    return;
  }
  const VectorX held = equations_.assembler().held_part(data_.full_residual);
  for (int node : hand.nodes) {
    const Vector3 arm = node_position(model, z_, node) - about,
                  by_arm = node_vector(model, held, node).cross(by_moment);
    add_to_node(model, node, by_force + by_moment.cross(arm), by_rows_);
    add_to_node(model, node, by_arm, by_z_);
    adjoint.hands_end.positions.row(support) -= by_arm.transpose();
  }
  for (std::size_t i = 0; i < hand.edges.size() && !model.planar(); ++i) {
    const int edge = hand.edges[i];
    const Vector3 by_arm = add_angle_reaction(edge, to_eigen(edge_vector(model, z_, edge)), by_moment, held);
    add_to_edge(model, edge, to_vec3(by_arm), by_z_);
  }
}

/// A moment is J(w)^-T times the rows of its frame, w being where the frame is turned to; rows of energy-momentum steps
/// are moments.
void StepGradient::add_frame_reaction(int dof, CoefficientAdjoint& coefficients) {
  if (step_->rule == StepRule::energy_momentum) return;
  const Vector3 w = z_.segment<3>(dof);
  const Matrix3 J = cayley_spin(w);
  const Vector3 u = J.inverse() * by_rows_.segment<3>(dof);
  const Vector3 moment = J.transpose().inverse() * data_.full_residual.segment<3>(dof);
  by_rows_.segment<3>(dof) = u;
  by_z_.segment<3>(dof) -= cayley_moment_slope(w, moment).transpose() * u;
  if (step_->rule == StepRule::midpoint)
    coefficients.mass.segment<3>(dof) +=
        (u - J * u).cwiseProduct(equations_.problem().held_acceleration.segment<3>(dof));
}

/// Reactions use M (v1 - v0) / dt as inertia of held parts, in place of the inertia of finite rotations in the rows of
/// the midpoint rules. Both are prescribed, except for the mass.
void StepGradient::add_held_inertia(int angle, CoefficientAdjoint& coefficients) const {
  const double inertia = equations_.mass().rows[angle];
  if (!equations_.problem().in_middle() || inertia == 0.0) return;
  coefficients.mass[angle] +=
      by_rows_[angle] * (equations_.problem().held_acceleration[angle] - data_.inertia[angle] / inertia);
}

}  // namespace withe
