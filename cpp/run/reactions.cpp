#include "run/reactions.hpp"

#include <algorithm>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "common/check.hpp"
#include "geometry/rotation.hpp"
#include "model/edge_vectors.hpp"
#include "run/frames.hpp"

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

Vector3 slide_displacement(const Model& model, const Found& found, const State& state, int joint, bool in_middle) {
  const int dof = model.joint_angles[at(joint)].turning;
  const auto slide =
      std::find_if(model.slides.begin(), model.slides.end(), [&](const Slide& s) { return s.dof == dof; });
  const int frame = model.frame_dof[at(slide->frame)];
  Matrix3 turn = frame_rotation(model, state, slide->frame);
  if (model.planar())
    turn = rotation_exp((found.reaction_place(frame) - state.q(frame)) * model.plane->normal) * turn;
  else if (in_middle)
    turn = cayley(Vector3(-found.reaction_place.segment<3>(frame))) * turn;
  return found.reaction_place(dof) * (turn * slide->axis);
}

Wrench wrench_of_side(const Model& model, const std::vector<JointPart>& parts, std::span<const Wrench> wrenches,
                      const std::vector<RodPass>& side) {
  const auto is_in = [&](const JointPart& part) {
    const auto has = [&](int rod, int node) {
      return std::any_of(side.begin(), side.end(),
                         [&](const RodPass& pass) { return pass.rod == rod && (rod < 0 || pass.node == node); });
    };
    if (part.body >= 0) return has(-1 - part.body, 0);
    const auto count = std::count_if(part.passes.begin(), part.passes.end(),
                                     [&](const RodPass& pass) { return has(pass.rod, pass.node); });
    require(count == 0 || count == static_cast<std::ptrdiff_t>(part.passes.size()),
            "rods are on both sides of the joint: read the tensions of their edges instead");
    return count > 0;
  };
  // The wrench on a part is that of the joint alone if no support is there, and of a body if its base is there.
  const int node = node_of_parts(model, parts);
  const auto is_held = [&](const JointPart& part) {
    return std::any_of(model.supports.begin(), model.supports.end(), [&](const Support& support) {
      const RodPass& pass = support.description.pass;
      if (!support.active || support.is_hand() || support.node != node) return false;
      return part.body >= 0 ? pass.on_body() && pass.body() == part.body : !pass.on_body();
    });
  };
  const auto is_known = [&](const JointPart& part) {
    return !is_held(part) && (part.body < 0 || model.description.bodies[at(part.body)].node == node);
  };
  Wrench on[2];
  bool known[2] = {true, true}, has_rods[2] = {false, false};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const int own = is_in(parts[i]) ? 1 : 0;
    known[own] = known[own] && is_known(parts[i]);
    has_rods[own] = has_rods[own] || parts[i].body < 0;
    on[own].force += wrenches[i].force;
    on[own].moment += wrenches[i].moment;
  }
  require(!has_rods[0] || !has_rods[1],
          "rods are on both sides of the joint: read the tensions of their edges instead");
  require(known[0] || known[1], "supports are on both sides of the joint: read their reactions instead");
  if (known[1]) return on[1];
  return {-on[0].force, -on[0].moment};
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
