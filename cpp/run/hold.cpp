#include "run/hold.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "geometry/frames.hpp"
#include "geometry/rotation.hpp"
#include "model/edge_vectors.hpp"

namespace withe {
namespace {

void hold_frame(const Model& model, const State& state, int frame, const SupportPose& pose, HeldTarget& target) {
  const int dof = model.frame_dof[at(frame)];
  if (model.planar()) {
    const double now = state.q(dof);
    const Matrix3 rest = pose.rotation * rotation_exp(now * model.plane->normal).transpose();
    target.q(dof) = now + rotation_log(rest).dot(model.plane->normal);
    return;
  }
  const Matrix3 rest = pose.rotation * state.frame[at(frame)].transpose();
  target.turn = std::max(target.turn, rotation_log(rest).norm());
  if (target.turn > 2.5) target.reachable = false;
  target.q.segment<3>(dof) = cayley_inverse(rest);
}

/// Target of a support that is no hand.
void hold_support(const Model& model, const Moving& now, int which, const SupportPose& pose, HeldTarget& target) {
  const State& state = now.state;
  const Support& support = model.supports[at(which)];
  const bool spinning = may_spin(support.description.kind);
  put_node(model, support.node, pose.position, target.q);
  if (support.frame >= 0 && !(spinning && !model.planar())) hold_frame(model, state, support.frame, pose, target);
  if (support.other_node < 0) return;
  // The held edge moves rigidly with the node.
  const auto& drawn = model.description.positions;
  const Vector3 arm =
      now.motions[at(which)].stretch * (drawn.row(support.other_node) - drawn.row(support.node)).transpose();
  put_node(model, support.other_node, pose.position + pose.rotation * arm, target.q);
  if (model.planar() || spinning) return;
  // Its angle is what the rotated drawn director measures against direct transport of the reference.
  const auto e = at(support.edge);
  const Vec3d t = to_vec3(pose.rotation * to_eigen(model.initial_tangent[e]));
  const Vec3d d = to_vec3(pose.rotation * to_eigen(model.initial_director[e]));
  const int dof = model.edge_dof[e];
  if (dot(state.tangent[e], t) < -0.5) target.reachable = false;
  const double angle = signed_angle(parallel_transport(state.director[e], state.tangent[e], t), d, t);
  target.q(dof) += std::remainder(angle - state.q(dof), 2.0 * std::numbers::pi);
}

/// Sets angles of the edges that a hand holds at a rotation, once all nodes have their places in `q`. False where an
/// edge would turn by too much.
bool hold_edges(const Model& model, const State& state, int hand, const Matrix3& rotation, VectorX& q) {
  if (model.planar()) return true;
  const Support& s = model.supports[at(hand)];
  for (std::size_t i = 0; i < s.touched.size(); ++i) {
    const int edge = s.touched[i].edge;
    const auto e = at(edge);
    const Matrix3 frame = rotation * state.hands[at(hand)].edges[i];
    Vec3d t = to_vec3(frame.col(2)), d = to_vec3(frame.col(0));
    const auto own = [&](int node) { return std::find(s.nodes.begin(), s.nodes.end(), node) != s.nodes.end(); };
    if (!own(model.edge_tail[e]) || !own(model.edge_head[e])) {
      // Its node towards a neighbour that is held too is where that is.
      const Vec3d across = edge_vector(model, q, edge);
      const Vec3d now = (1.0 / std::sqrt(dot(across, across))) * across;
      if (dot(t, now) < -0.5) return false;
      d = parallel_transport(d, t, now);
      t = now;
    }
    if (dot(state.tangent[e], t) < -0.5) return false;
    const double angle = signed_angle(parallel_transport(state.director[e], state.tangent[e], t), d, t);
    const int dof = model.edge_dof[e];
    q(dof) = state.q(dof) + std::remainder(angle - state.q(dof), 2.0 * std::numbers::pi);
  }
  return true;
}

/// Edges after all nodes: one between two hands has a node of either.
void hold_hands(const Model& model, const State& state, const std::vector<SupportPose>& supports, HeldTarget& target) {
  for (std::size_t h = 0; h < model.supports.size(); ++h) {
    const Support& s = model.supports[h];
    for (std::size_t i = 0; s.active && i < s.span.size(); ++i)
      if (std::find(s.nodes.begin(), s.nodes.end(), s.span[i]) != s.nodes.end())
        put_node(model, s.span[i], supports[h].position + supports[h].rotation * state.hands[h].points[i], target.q);
  }
  for (std::size_t h = 0; h < model.supports.size(); ++h) {
    const Support& s = model.supports[h];
    if (s.active && s.is_hand() && !s.yields() &&
        !hold_edges(model, state, static_cast<int>(h), supports[h].rotation, target.q))
      target.reachable = false;
  }
}

}  // namespace

void hold(const Model& model, const Moving& now, const std::vector<SupportPose>& supports, HeldTarget& target) {
  target.q = now.state.q;
  target.turn = target.spin = 0.0;
  target.reachable = true;
  for (std::size_t s = 0; s < model.supports.size(); ++s)
    if (model.supports[s].active && !model.supports[s].is_hand())
      hold_support(model, now, static_cast<int>(s), supports[s], target);
  hold_hands(model, now.state, supports, target);
  for (const Support& support : model.supports) {
    if (!support.active || support.yields() || model.planar()) continue;
    for (int edge : support.edges) {
      const int dof = model.edge_dof[at(edge)];
      target.spin = std::max(target.spin, std::abs(target.q(dof) - now.state.q(dof)));
    }
  }
}

}  // namespace withe
