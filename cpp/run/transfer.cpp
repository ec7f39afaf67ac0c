#include "run/transfer.hpp"

#include <algorithm>

#include "geometry/rotation.hpp"
#include "model/edge_vectors.hpp"
#include "run/frames.hpp"

namespace withe {
namespace {

/// Turn since the drawing of what a half stencil attaches.
Matrix3 attached_rotation(const Model& model, const State& state, const FrameStencil& half) {
  return frame_rotation(model, state, half.frame) * hinge_turn(model, state.q, half.hinge);
}

/// Its angular velocity [rad/s].
Vector3 attached_spin(const Model& model, const State& state, const FrameStencil& half) {
  const int dof = model.frame_dof[at(half.frame)];
  if (model.planar()) return state.v(dof) * model.plane->normal;
  Vector3 spin = state.v.segment<3>(dof);
  if (half.hinge < 0) return spin;
  const Hinge& hinge = model.hinges[at(half.hinge)];
  return spin + state.v(hinge.dof) * (frame_rotation(model, state, half.frame) * hinge.axis);
}

/// Twists of stencils that both models have.
void copy_twists(const Model& old, const State& from, const Model& model, State& to) {
  for (std::size_t b = 0; b < model.bend.size(); ++b)
    if (const Eigen::Index k = same_stencil(old, model.bend[b]); k >= 0)
      to.bend_tau(static_cast<Eigen::Index>(b)) = from.bend_tau(k);
  for (std::size_t h = 0; h < model.half.size(); ++h)
    if (const Eigen::Index k = same_stencil(old, model.half[h]); k >= 0)
      to.half_tau(static_cast<Eigen::Index>(h)) = from.half_tau(k);
}

}  // namespace

Eigen::Index same_stencil(const Model& model, const BendStencil& stencil) {
  const auto found = std::find_if(model.bend.begin(), model.bend.end(), [&](const BendStencil& s) {
    return s.edge[0] == stencil.edge[0] && s.edge[1] == stencil.edge[1] && s.node[1] == stencil.node[1];
  });
  return found == model.bend.end() ? -1 : found - model.bend.begin();
}

Eigen::Index same_stencil(const Model& model, const FrameStencil& stencil) {
  const auto found = std::find_if(model.half.begin(), model.half.end(), [&](const FrameStencil& s) {
    return s.edge == stencil.edge && s.frame_first == stencil.frame_first;
  });
  return found == model.half.end() ? -1 : found - model.half.begin();
}

Eigen::Index known_half(const Model& model, int frame, const Model& other) {
  for (const FrameStencil& half : model.half) {
    if (half.frame != frame || half.hinge >= 0) continue;
    if (const Eigen::Index known = same_stencil(other, half); known >= 0) return known;
  }
  return -1;
}

State transferred(const Model& old, const State& from, const Model& model) {
  State to = initial_state(model);
  to.time = from.time;
  for (std::size_t o = 0; o < from.obstacles.size(); ++o) {
    const ObstacleDescription& drawn = model.description.contact.obstacles[o];
    to.obstacles[o] = obstacle_place(model, drawn, way_from_drawn(old, drawn, from.obstacles[o]));
  }
  to.contacts = from.contacts;
  std::copy_n(from.hands.begin(), std::min(from.hands.size(), to.hands.size()), to.hands.begin());
  to.contact_stiffness = from.contact_stiffness;
  to.stop_rates = from.stop_rates;
  Configuration c;
  compute_configuration(old, from, from.q, c);
  const auto copy = [&](int old_dof, int new_dof, int n) {
    to.q.segment(new_dof, n) = from.q.segment(old_dof, n);
    to.v.segment(new_dof, n) = from.v.segment(old_dof, n);
    to.acceleration.segment(new_dof, n) = from.acceleration.segment(old_dof, n);
  };
  const bool lifted = old.planar() && !model.planar();
  for (int i = 0; i < model.node_count; ++i) {
    const int dof = model.node_dof[at(i)];
    if (lifted) {
      to.q.segment<3>(dof) = node_position(old, from.q, i);
      to.v.segment<3>(dof) = node_vector(old, from.v, i);
      to.acceleration.segment<3>(dof) = node_vector(old, from.acceleration, i);
    } else {
      copy(old.node_dof[at(i)], dof, model.dimension);
    }
  }
  for (int e = 0; e < model.edge_count; ++e) {
    if (lifted) {
      const Matrix3 d = edge_directors(old, c, e);
      to.tangent[at(e)] = to_vec3(d.col(2));
      to.director[at(e)] = to_vec3(d.col(0));
    } else if (!model.planar()) {
      to.tangent[at(e)] = from.tangent[at(e)];
      to.director[at(e)] = from.director[at(e)];
      copy(old.edge_dof[at(e)], model.edge_dof[at(e)], 1);
    }
  }
  for (std::size_t b = 0; b < model.body_frame.size(); ++b) {
    const int f = model.body_frame[b], old_f = old.body_frame[b], dof = model.frame_dof[at(f)];
    if (lifted) {
      to.frame[at(f)] = rotation_exp(from.q(old.frame_dof[at(old_f)]) * old.plane->normal);
      to.v.segment<3>(dof) = from.v(old.frame_dof[at(old_f)]) * old.plane->normal;
    } else {
      if (!model.planar()) to.frame[at(f)] = from.frame[at(old_f)];
      copy(old.frame_dof[at(old_f)], dof, model.frame_size());
    }
  }
  const auto is_body = [&](int f) {
    return std::find(model.body_frame.begin(), model.body_frame.end(), f) != model.body_frame.end();
  };
  for (int f = 0; f < model.frame_count; ++f) {
    if (is_body(f)) continue;
    const Eigen::Index known = known_half(model, f, old);
    if (known < 0) continue;
    const FrameStencil& half = old.half[static_cast<std::size_t>(known)];
    const int dof = model.frame_dof[at(f)];
    if (lifted || half.hinge >= 0) {
      to.frame[at(f)] = attached_rotation(old, from, half);
      to.v.segment<3>(dof) = attached_spin(old, from, half);
    } else {
      to.frame[at(f)] = from.frame[at(half.frame)];
      copy(old.frame_dof[at(half.frame)], dof, model.frame_size());
    }
  }
  for (std::size_t k = 0; k < model.slides.size(); ++k) copy(old.slides[k].dof, model.slides[k].dof, 1);
  for (std::size_t j = 0; !model.planar() && j < model.joint_angles.size(); ++j) {
    const JointAngle &before = old.joint_angles[j], &now = model.joint_angles[j];
    to.q[now.turning] = now.sign * before.angle(from.q);
    to.v[now.turning] = now.sign * before.angle(from.v);
    to.acceleration[now.turning] = now.sign * before.angle(from.acceleration);
  }
  if (!lifted && !model.planar()) copy_twists(old, from, model, to);
  return to;
}

}  // namespace withe
