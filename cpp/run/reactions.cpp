#include "run/reactions.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "geometry/rotation.hpp"
#include "model/edge_vectors.hpp"

namespace withe {
namespace {

/// Reaction of a hand in the last evaluation, about the origin.
Wrench hand_reaction(const Model& model, const Found& found, int hand, const VectorX& held) {
  const Support& s = model.supports[at(hand)];
  if (s.yields()) return found.hand_wrenches[at(hand)];
  const VectorX& q = found.reaction_place;
  Wrench out;
  for (int node : s.nodes) {
    const Vector3 force = node_vector(model, held, node);
    out.force += force;
    out.moment += node_position(model, q, node).cross(force);
  }
  for (int edge : s.edges)
    if (!model.planar())
      out.moment += held(model.edge_dof[at(edge)]) * to_eigen(edge_vector(model, q, edge)).normalized();
  return out;
}

}  // namespace

void make_frame_moments(const Model& model, const VectorX& held, double turn, Found& found) {
  for (const Support& support : model.supports) {
    if (!support.active || support.frame < 0) continue;
    const int dof = model.frame_dof[at(support.frame)];
    const Matrix3 J = cayley_spin(turn * held.segment<3>(dof));
    const Vector3 moment = found.reaction_residual.segment<3>(dof);
    found.reaction_residual.segment<3>(dof) = J.transpose().inverse() * moment;
  }
}

Wrench reaction_of(const Model& model, const Found& found, int support, const VectorX& held) {
  const Support& s = model.supports[at(support)];
  if (s.is_hand()) return hand_reaction(model, found, support, held);
  Wrench out;
  out.force = node_vector(model, held, s.node);
  if (s.frame >= 0) {
    const int dof = model.frame_dof[at(s.frame)];
    out.moment = model.planar() ? Vector3(held(dof) * model.plane->normal) : Vector3(held.segment<3>(dof));
  }
  if (s.other_node >= 0) {
    const Vector3 other = node_vector(model, held, s.other_node);
    const Vector3 arm =
        node_position(model, found.reaction_place, s.other_node) - node_position(model, found.reaction_place, s.node);
    out.force += other;
    out.moment = arm.cross(other);
    if (!model.planar()) out.moment += held(model.edge_dof[at(s.edge)]) * arm.normalized();
  }
  return out;
}

}  // namespace withe
