#pragma once
/// Models in states away from rest, and rigid motions of them.

#include "geometry/rotation.hpp"
#include "model/state.hpp"
#include "scenes.hpp"

namespace withe::testing {

/// A model, the state that a step starts from, and a configuration within that step.
struct Case {
  std::string name;
  Model model;
  State state;
  VectorX q;
  double increment = 1e-2;  ///< largest one of the derivative check
};

/// Takes the branch of every twist from where the case is.
inline void follow_twists(Case& c) {
  Configuration configuration;
  compute_configuration(c.model, c.state, c.q, configuration);
  if (c.model.planar()) return;
  c.state.bend_tau = configuration.bend_strain.col(2);
  c.state.half_tau = configuration.half_strain.col(2);
}

/// Moves every unknown by `size` times a normal number; the twist branch of the state goes along.
inline void perturb(Case& c, RandomNumbers& random, double size) {
  c.q += size * random.vector(c.q.size());
  follow_twists(c);
}

/// Turns the positions by an angle, 30 degrees by default, the source frames staying where they are.
inline void turn_within_step(Case& c, double angle = kPi / 6.0) {
  for (int i = 0; i < c.model.node_count; ++i) {
    const int dof = c.model.node_dof[at(i)];
    if (c.model.planar())
      c.q.segment<2>(dof) = Eigen::Rotation2Dd(angle) * c.q.segment<2>(dof);
    else
      c.q.segment<3>(dof) = Eigen::AngleAxisd(angle, Vector3(0.6, -0.64, 0.48)) * c.q.segment<3>(dof);
  }
  for (int f = 0; f < c.model.frame_count; ++f) {
    const int dof = c.model.frame_dof[at(f)];
    if (c.model.planar())
      c.q(dof) += angle;
    else
      c.q.segment<3>(dof) += 2.0 * std::tan(0.5 * angle) * Vector3(0.6, -0.64, 0.48);
  }
}

/// The drawn state, two random ones, and one that turns by 30 degrees within the step.
inline std::vector<Case> states_of(const std::string& name, const SceneDescription& scene,
                                   std::optional<bool> planar = std::nullopt) {
  std::vector<Case> cases;
  const Model model = build_model(scene, planar);
  RandomNumbers random(11);
  const auto drawn = [&](const std::string& which) {
    Case c{name + ", " + which, model, initial_state(model), {}, 1e-2};
    for (Matrix3& frame : c.state.frame) frame = rotation_exp(0.1 * random.vector()) * frame;
    c.q = c.state.q;
    return c;
  };
  cases.push_back({name + ", at rest", model, initial_state(model), initial_state(model).q, 1e-2});
  for (int k = 0; k < 2; ++k) {
    cases.push_back(drawn("random " + std::to_string(k)));
    perturb(cases.back(), random, 0.08 + 0.04 * k);
  }
  cases.push_back(drawn("turned by 30 degrees within the step"));
  turn_within_step(cases.back());
  perturb(cases.back(), random, 0.05);
  return cases;
}

/// The drawn state, but joints and clamps have turned until they nearly point back along their first edge.
inline Case with_frames_turned(const std::string& name, const SceneDescription& scene, double degrees) {
  Case c = states_of(name, scene).front();
  c.name = name + ", frames turned by " + std::to_string(degrees) + " degrees";
  c.increment = 1e-3;
  const double angle = degrees * kPi / 180.0;
  Configuration drawn;
  compute_configuration(c.model, c.state, c.q, drawn);
  for (std::size_t h = c.model.half.size(); h-- > 0;) {
    const FrameStencil& s = c.model.half[h];
    if (c.model.planar()) {
      c.q(c.model.frame_dof[at(s.frame)]) = angle;
      continue;
    }
    const Vector3 tangent = to_eigen(drawn.edge[at(s.edge)].tangent), attached = to_eigen(drawn.attached[h].tangent);
    const Vector3 back = rotation_exp(angle * tangent.unitOrthogonal()) * tangent;
    c.state.frame[at(s.frame)] = smallest_rotation(attached, back);
  }
  follow_twists(c);
  return c;
}

/// A revolute joint in space: a bar in two rods, rigidly joined, and a stem that turns about an axis.
inline SceneBuilder hinged(const RodMaterial& material = {}) {
  SceneBuilder builder;
  const Vector3 o(0.1, 0.0, 0.2);
  builder.add_rod(line(Vector3(-1.8, 0.3, 0.0), o, 3), material);
  builder.add_rod(line(o, Vector3(1.5, 0.2, 0.6), 3), material);
  builder.add_rod(line(o, Vector3(0.0, -0.5, 2.0), 3), material);
  builder.add_rod(line(Vector3(0.3, 1.7, -0.4), o, 3), material);
  builder.scene.joints.push_back(
      {.clusters = {{{0, 2}, {1, 0}}, {{2, 0}}, {{3, 2}}},
       .bodies = {},
       .links = {{0, 1, Vector3(0.2, 0.9, -0.3).normalized()}, {0, 2, Vector3(1, 0.1, 0.4).normalized()}},
       .form = JointForm::frame});
  return builder;
}

/// Every kind of stencil, in space and in a plane, in every state.
inline std::vector<Case> all_cases(const RodMaterial& given = {}) {
  RodMaterial curved = given;
  curved.curvature = {0.4, -0.3};
  curved.natural_twist = 0.5;
  RodMaterial planar = given;
  planar.bend2 = planar.bend1;
  std::vector<Case> cases;
  const auto add = [&](const std::string& name, const SceneDescription& scene) {
    for (Case& c : states_of(name, scene)) cases.push_back(std::move(c));
    if (cases.back().model.frame_count == 0) return;
    for (double turn : {150.0, 165.0}) cases.push_back(with_frames_turned(name, scene, turn));
  };
  SceneBuilder open;
  open.add_rod(helix(6), curved);
  open.support(SupportKind::clamp, {0, 0});
  open.support(SupportKind::clamp, {0, 5});
  add("clamped helix", open.scene);
  SceneBuilder held;
  held.add_rod(helix(5), curved);
  held.support(SupportKind::clamp, {0, 2});
  add("helix clamped in its middle", held.scene);
  SceneBuilder closed;
  closed.add_rod(ring(6, 1.0, 0.3), curved, true);
  add("closed ring", closed.scene);
  add("T joint", tee(JointForm::frame, false, curved).scene);
  add("T joint of pairs", tee(JointForm::pairs, false, curved).scene);
  add("revolute joint", hinged(curved).scene);
  for (double turn : {150.0, 170.0}) {
    SceneBuilder sharp;
    sharp.add_rod(zigzag(5, turn * kPi / 180.0), given);
    // Noise would fold an edge on its neighbour: only the drawn state.
    cases.push_back(states_of("turned by " + std::to_string(turn) + " degrees", sharp.scene).front());
    cases.back().increment = 1e-3;
    SceneBuilder flat;
    flat.add_rod(zigzag(5, turn * kPi / 180.0, true), planar, false, Vector3::UnitY());
    cases.push_back(states_of("in a plane, by " + std::to_string(turn) + " degrees", flat.scene).front());
    cases.back().increment = 1e-3;
  }
  planar.curvature = {0.0, 0.6};  // about d1 = y, the normal
  SceneBuilder flat;
  flat.add_rod(arc(6), planar, false, Vector3::UnitY());
  flat.support(SupportKind::clamp, {0, 0});
  flat.support(SupportKind::clamp, {0, 5});
  add("clamped arc in a plane", flat.scene);
  add("T joint in a plane", tee(JointForm::frame, true, planar).scene);
  add("T joint of pairs in a plane", tee(JointForm::pairs, true, planar).scene);
  return cases;
}

/// Change of q that a rigid motion by velocity `u` and angular velocity `omega` makes, at q.
inline VectorX rigid_motion(const Case& c, const Vector3& u, const Vector3& omega) {
  const Model& model = c.model;
  VectorX d = VectorX::Zero(model.dof_count);
  const auto velocity = [&](int node) -> Vector3 {
    const int dof = model.node_dof[at(node)];
    if (!model.planar()) return u + omega.cross(Vector3(c.q.segment<3>(dof)));
    const Plane& p = *model.plane;
    return u + omega.cross(c.q(dof) * p.first + c.q(dof + 1) * p.second);
  };
  for (int i = 0; i < model.node_count; ++i) {
    const int dof = model.node_dof[at(i)];
    if (model.planar())
      d.segment<2>(dof) << velocity(i).dot(model.plane->first), velocity(i).dot(model.plane->second);
    else
      d.segment<3>(dof) = velocity(i);
  }
  for (int f = 0; f < model.frame_count; ++f) {
    const int dof = model.frame_dof[at(f)];
    if (model.planar())
      d(dof) = omega.dot(model.plane->normal);
    else
      d.segment<3>(dof) = cayley_spin(c.q.segment<3>(dof)).inverse() * omega;
  }
  if (model.planar()) return d;
  Configuration configuration;
  compute_configuration(model, c.state, c.q, configuration);
  for (int e = 0; e < model.edge_count; ++e) {
    const EdgeFrame<double>& f = configuration.edge[at(e)];
    const Vector3 change = velocity(model.edge_head[at(e)]) - velocity(model.edge_tail[at(e)]);
    d(model.edge_dof[at(e)]) = omega.dot(to_eigen(f.tangent)) - to_eigen(f.spin).dot(change);
  }
  return d;
}

/// The directions of rigid motion that the scene's dimension allows.
inline std::vector<std::pair<Vector3, Vector3>> rigid_motions(const Model& model) {
  std::vector<std::pair<Vector3, Vector3>> motions;
  for (int i = 0; i < 3; ++i) {
    const Vector3 axis = Vector3::Unit(i);
    if (!model.planar() || std::abs(axis.dot(model.plane->normal)) < 0.5) motions.emplace_back(axis, Vector3::Zero());
    if (!model.planar() || std::abs(axis.dot(model.plane->normal)) > 0.5) motions.emplace_back(Vector3::Zero(), axis);
  }
  return motions;
}

}  // namespace withe::testing
