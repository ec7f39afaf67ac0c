// Held unknowns are prescribed: q1 there, and so z; velocities at the end of a step, which follow from the mean
// ones of this step and the last (integrators/dynamics.cpp); and so accelerations.

#include "gradients/held_gradient.hpp"

#include <algorithm>
#include <cmath>

#include "geometry/rotation.hpp"
#include "gradients/step_gradient.hpp"
#include "model/edge_vectors.hpp"

namespace withe {

void StepGradient::add_held(const StepAdjoint& adjoint, const VectorX& end_velocity, VectorX& start, VectorX& velocity,
                            HeldAdjoint& held) const {
  const Model& model = equations_.model();
  if (model.constraints.empty()) return;
  VectorX by = by_z_ + columns_;
  if (moves()) {
    const double h = equations_.problem().interval;
    by -= adjoint.acceleration / (h * h);
  }
  const double share = 1.0 / end_rate();  // share in z = share q1 + (1 - share) q0
  for (std::size_t i = 0; i < model.constraints.size(); ++i) {
    const Constraint& c = model.constraints[i];
    const Vector3 part = c.held(by);
    held.pose.segment(c.first, c.size) += share * part.head(c.size);
    // Cayley vectors of frames in space begin at zero.
    const bool frame =
        !model.planar() && std::find(model.frame_dof.begin(), model.frame_dof.end(), c.first) != model.frame_dof.end();
    if (!frame) start.segment(c.first, c.size) += (1.0 - share) * part.head(c.size);
    if (!moves()) continue;
    const double dt = step_->duration,
                 gain = step_->held_gain ? (*step_->held_gain)(static_cast<Eigen::Index>(i)) : 0.0;
    const Vector3 by_acceleration = c.held(adjoint.acceleration) / dt,
                  by_velocity = c.held(end_velocity) + by_acceleration;
    velocity.segment(c.first, c.size) -= by_acceleration.head(c.size);
    const Vector3 by_mean = (c.held(held.mean) + (1.0 + gain) * by_velocity) / dt;
    held.mean.segment(c.first, c.size) = -gain * by_velocity.head(c.size);
    held.pose.segment(c.first, c.size) += by_mean.head(c.size);
    if (!frame) start.segment(c.first, c.size) -= by_mean.head(c.size);
  }
  if (moves() && !model.planar()) turn_held(start, held.pose);
}

/// Maps derivatives by q1 to derivatives by the rotations of frames and directors at the end and at the start. A Cayley
/// vector w has the differential J dw = phi - R(w) phi0, and an angle d theta = d psi - spin . de - back . de0.
void StepGradient::turn_held(VectorX& start, VectorX& pose) const {
  const Model& model = equations_.model();
  for (const Support& support : model.supports) {
    if (!support.active) continue;
    if (support.frame >= 0) {
      const int dof = model.frame_dof[at(support.frame)];
      const Vector3 w = step_->end.segment<3>(dof);
      const Vector3 by_spin = cayley_spin(w).transpose().inverse() * pose.segment<3>(dof);
      pose.segment<3>(dof) = by_spin;
      start.segment<3>(dof) -= cayley(w).transpose() * by_spin;
    }
    if (support.other_node >= 0) turn_held_edge(support.edge, start, pose);
    if (!support.is_hand() || support.yields()) continue;
    for (int edge : support.edges) turn_held_edge(edge, start, pose);
  }
}

void StepGradient::turn_held_edge(int e, VectorX& start, VectorX& pose) const {
  const Model& model = equations_.model();
  const double by_angle = pose[model.edge_dof[at(e)]];
  const EdgeFrame<double>& f = end_->edge[at(e)];
  const Vec3d e0 = edge_vector(model, step_->start.q, e);
  const double longer = 1.0 / (f.inverse_length * std::sqrt(dot(e0, e0)));
  add_to_edge(model, e, -by_angle * f.spin, pose);
  add_to_edge(model, e, (-by_angle * longer) * f.spin, start);
}

namespace {

/// By how a frame that a support holds is turned.
Vector3 frame_turn(const Model& model, const VectorX& held, const Support& support) {
  const int dof = model.frame_dof[at(support.frame)];
  return model.planar() ? Vector3(held(dof) * model.plane->normal) : Vector3(held.segment<3>(dof));
}

/// By how an edge that a support holds is turned about itself.
Vector3 edge_turn(const Model& model, const VectorX& held, const Support& support, const Vector3& arm) {
  return model.planar() ? Vector3(Vector3::Zero()) : Vector3(held(model.edge_dof[at(support.edge)]) * arm.normalized());
}

/// From the node that a support holds to the other one.
Vector3 arm_of(const Model& model, const VectorX& q, const Support& support) {
  return node_vector(model, q, support.other_node) - node_vector(model, q, support.node);
}

/// Derivatives by the pose of a rigid hand. An edge beside another hand shares a node with that hand. This hand then
/// determines its director, transported from the tangent at the grasp to the present tangent t.
void add_hand(const Model& model, const VectorX& q, VectorX& held, const Support& hand, const HandsHeld& hands,
              std::size_t support, Vector3& rotation) {
  for (std::size_t i = 0; i < hand.touched.size() && !model.planar(); ++i) {
    const int e = hand.touched[i].edge;
    const Vector3 along = to_eigen(edge_vector(model, q, e)), now = along.normalized(),
                  t = (hands.poses[support].rotation * hands.grasped[support].edges[i]).col(2);
    const double by_angle = held(model.edge_dof[at(e)]);
    const Vector3 spin = -t.cross(now) / (1.0 + t.dot(now));
    add_to_edge(model, e, to_vec3(Vector3(by_angle / along.norm() * spin)), held);
    rotation += by_angle * (t + t.cross(spin));
  }
}

}  // namespace

MatrixX3 by_places(const Model& model, const MatrixX3& obstacles) {
  if (!model.planar()) return obstacles;
  return obstacles.col(0) * model.plane->first.transpose() + obstacles.col(1) * model.plane->second.transpose();
}

PoseAdjoint by_poses(const Model& model, const VectorX& q, const VectorX& held_unknowns, const HandAdjoint& by_hands,
                     const HandsHeld& hands) {
  const auto count = static_cast<Eigen::Index>(model.supports.size());
  PoseAdjoint out{MatrixX3::Zero(count, 3), MatrixX3::Zero(count, 3), {}};
  if (by_hands.positions.rows() == count) out = {by_hands.positions, by_hands.rotations, {}};
  VectorX held = held_unknowns;
  std::vector<Vector3> turned(model.supports.size(), Vector3::Zero());
  for (std::size_t s = 0; s < model.supports.size(); ++s)
    if (model.supports[s].active && model.supports[s].is_hand() && !model.supports[s].yields())
      add_hand(model, q, held, model.supports[s], hands, s, turned[s]);
  for (std::size_t s = 0; s < model.supports.size(); ++s) {
    const Support& support = model.supports[s];
    if (!support.active || support.yields()) continue;
    Vector3 position = Vector3::Zero(), rotation = turned[s];
    if (support.is_hand()) {
      for (int node : support.nodes) {
        const Vector3 by = node_vector(model, held, node);
        position += by;
        rotation += (node_position(model, q, node) - hands.poses[s].position).cross(by);
      }
    } else {
      position = node_vector(model, held, support.node);
      if (support.frame >= 0) rotation = frame_turn(model, held, support);
      if (support.other_node >= 0) {
        const Vector3 other = node_vector(model, held, support.other_node), arm = arm_of(model, q, support);
        position += other;
        rotation += arm.cross(other) + edge_turn(model, held, support, arm);
      }
    }
    out.positions.row(static_cast<Eigen::Index>(s)) += position.transpose();
    out.rotations.row(static_cast<Eigen::Index>(s)) += rotation.transpose();
  }
  return out;
}

DrawnAdjoint by_drawing(const Model& model, const VectorX& q, const VectorX& by) {
  DrawnAdjoint out{MatrixX3::Zero(model.node_count, 3), MatrixX3::Zero(model.edge_count, 3)};
  for (int i = 0; i < model.node_count; ++i) out.nodes.row(i) = node_vector(model, by, i).transpose();
  for (int e = 0; e < model.edge_count && !model.planar(); ++e)
    out.edge_turn.row(e) = by(model.edge_dof[at(e)]) * to_eigen(edge_vector(model, q, e)).normalized().transpose();
  return out;
}

}  // namespace withe
