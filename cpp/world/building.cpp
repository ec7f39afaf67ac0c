#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/check.hpp"
#include "common/text.hpp"
#include "forces/tendon.hpp"
#include "geometry/rotation.hpp"
#include "model/edge_vectors.hpp"
#include "steps/joint_forces.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

/// The half stencil of another model of the same scene at the end of an edge that is attached to a frame, not through a
/// hinge; a node may have several frames. -1 where there is none.
Eigen::Index known_half(const Model& model, int frame, const Model& other) {
  for (const FrameStencil& half : model.half) {
    if (half.frame != frame || half.hinge >= 0) continue;
    if (const Eigen::Index known = same_stencil(other, half); known >= 0) return known;
  }
  return -1;
}

/// How what a half stencil attaches has turned since it was drawn.
Matrix3 attached_rotation(const Model& model, const State& state, const FrameStencil& half) {
  return frame_rotation(model, state, half.frame) * hinge_turn(model, state.q, half.hinge);
}

/// With which angular velocity it turns [rad/s].
Vector3 attached_spin(const Model& model, const State& state, const FrameStencil& half) {
  const int dof = model.frame_dof[at(half.frame)];
  if (model.planar()) return state.v(dof) * model.plane->normal;
  Vector3 spin = state.v.segment<3>(dof);
  if (half.hinge < 0) return spin;
  const Hinge& hinge = model.hinges[at(half.hinge)];
  return spin + state.v(hinge.dof) * (frame_rotation(model, state, half.frame) * hinge.axis);
}

/// An angle, but for whole turns, that is near another one.
double nearest_turn(double angle, double to) {
  constexpr double kFull = 2.0 * std::numbers::pi;
  return angle + kFull * std::round((to - angle) / kFull);
}

/// Explicit steps would have to be shorter for the narrow contact of light loads.
SceneDescription described_for(SceneDescription scene, const Options& options) {
  if (options.integrator == Integrator::verlet) scene.contact.light = 1.0;
  return scene;
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

Matrix3 frame_rotation(const Model& model, const State& state, int frame) {
  if (model.planar()) return rotation_exp(state.q(model.frame_dof[at(frame)]) * model.plane->normal);
  return cayley(state.q.segment<3>(model.frame_dof[at(frame)])) * state.frame[at(frame)];
}

Vector3 angular_velocity(const Model& model, const State& state, const Configuration& c, int edge) {
  const Vector3 t = edge_directors(model, c, edge).col(2);
  const Vector3 along =
      node_vector(model, state.v, model.edge_head[at(edge)]) - node_vector(model, state.v, model.edge_tail[at(edge)]);
  const double spin = model.planar() ? 0.0 : state.v(model.edge_dof[at(edge)]);
  return t.cross(along) / c.length(edge) + spin * t;
}

World::Implementation::Implementation(SceneDescription scene, Options choice)
    : description(described_for(std::move(scene), choice)), drawn_contact(description.contact), options(choice) {
  require(options.time_step > 0.0 && std::isfinite(options.time_step), "time_step must be positive and finite");
  rebuild(Rebuild::first);
  check_reversible(parameters);
  if (description.contact.overlap == Overlap::separate) separate();
  check_overlap();
  if (options.integrator == Integrator::verlet) {
    plan.stable_step = stable_step(systems.scheme(), parameters, at_rest(), state, systems.work);
    require(options.time_step <= plan.stable_step,
            "time_step must not exceed the stable step of the explicit scheme, " + text(plan.stable_step) + " s, got " +
                text(options.time_step) + " s");
  }
}

World::Implementation::Implementation(const Implementation& other) : Implementation(other, Unbuilt{}) {
  systems.build(model, options);
}

World::Implementation::Implementation(const Implementation& other, Unbuilt /*unused*/)
    : Running(other),
      description(other.description),
      drawn_contact(other.drawn_contact),
      options(other.options),
      model(other.model),
      plan(other.plan),
      plan_current(other.plan_current),
      plane_left_by(other.plane_left_by),
      statistics(other.statistics),
      separated(other.separated),
      spatial(other.spatial),
      warnings(other.warnings) {
  systems.work.newton.counters = other.systems.work.newton.counters;
  listen();
}

void World::Implementation::listen() {
  systems.work.newton.poll = [this] {
    if (interrupted.exchange(false)) throw Interrupted();
    if (callbacks.poll) callbacks.poll();
  };
}

/// The model for the supports that are active. Released ones keep their row until another takes it, but hold nothing.
Model World::Implementation::model_of_active(Rebuild why) {
  SceneDescription active = description;
  active.supports.clear();
  std::vector<std::size_t> index;
  for (std::size_t s = 0; s < description.supports.size(); ++s) {
    if (s < model.supports.size() && !model.supports[s].active) continue;
    active.supports.push_back(description.supports[s]);
    index.push_back(s);
  }
  Model fresh = build_model(active, spatial ? std::optional<bool>(false) : options.planar);
  if (why == Rebuild::running && !model.planar() && fresh.planar()) {
    spatial = true;  // what kept the drawing from being planar is gone, but the state need not be in the plane
    fresh = build_model(active, false);
  }
  std::vector<Support> all(description.supports.size());
  for (std::size_t s = 0; s < all.size(); ++s) all[s].description = description.supports[s];
  for (std::size_t k = 0; k < index.size(); ++k) all[index[k]] = fresh.supports[k];
  fresh.supports = all;
  return fresh;
}

/// Drops what has the sizes of the old model.
void World::Implementation::drop_scratch() {
  systems.drop_scratch();
  spatial_twin.reset();
  listen();
  energy_scratch = EnergyScratch{};
  predictor.clear();
}

/// The state as it is drawn.
void World::Implementation::begin_as_drawn() {
  parameters = initial_parameters(model);
  parameters.lumped = options.integrator == Integrator::verlet;
  state = initial_state(model);
  ramps.assign(description.rods.size(), NaturalRamp{});
  motions.assign(description.supports.size(), SupportMotion{});
  custom_force = MatrixX3::Zero(model.node_count, 3);
  custom_moments = MatrixX3::Zero(description.custom_moments ? model.node_count : 0, 3);
  for (std::size_t s = 0; s < motions.size(); ++s) {
    motions[s].position = motions[s].from_position = motions[s].to_position =
        node_position(model, state.q, model.supports[s].node);
    if (model.supports[s].is_hand()) grasp(static_cast<int>(s));
  }
  note_drawn_actuation();
}

/// Notes where rods are not drawn as they are free of stress, or tendons pull from the start.
void World::Implementation::note_drawn_actuation() {
  constexpr double kRounded = 1e-9;  // [rad] of a stencil
  const Actuation now = actuation_of(parameters);
  actuation_before = relaxed_actuation(model, parameters, configuration());
  double apart = 0.0;
  for (std::size_t r = 0; r < now.curvature.size(); ++r) {
    if (now.twist[r].size() == 0) continue;
    const VectorX& voronoi = model.rod_voronoi[r];
    const MatrixX2 bent = now.curvature[r] - actuation_before.curvature[r];
    const VectorX twisted = now.twist[r] - actuation_before.twist[r];
    apart = std::max({apart, (voronoi.asDiagonal() * bent).cwiseAbs().maxCoeff(),
                      voronoi.cwiseProduct(twisted).cwiseAbs().maxCoeff()});
  }
  actuation_changed = apart > kRounded || !now.tension.isZero(0.0);
}

/// The running state, of another model.
void World::Implementation::carry_over(const Model& old, Rebuild why) {
  const State from = state;
  std::vector<std::vector<int>> held_before;
  for (const Support& s : old.supports) held_before.push_back(s.nodes);
  std::vector<bool> is_new(at(model.frame_count), true);
  for (int f = 0; f < model.frame_count; ++f) is_new[at(f)] = known_half(model, f, old) < 0;
  state = transferred(old, from);
  // A motion that is prescribed in the course of a step may leave the plane: the step still returns to its start.
  if (why == Rebuild::running && kept.state.q.size() == old.dof_count) {
    kept.state = transferred(old, kept.state);
    kept.predictor.clear();
  } else {
    static_cast<Moving&>(kept) = Moving{};
  }
  ElasticCoefficients elastic;
  set_elastic(parameters, elastic);
  // Frames that come and go carry inertia, and a support may change where the mass of edges sits.
  MassMatrix mass;
  set_mass(old, parameters, mass);
  const double before = kinetic_energy(old, mass, from.v);
  update_derived(model, parameters);
  relax_frames(is_new);
  if (why == Rebuild::running) {
    regrip(held_before);
    keep_moments(old, elastic);
  }
  set_mass(model, parameters, mass);
  support_work += kinetic_energy(model, mass, state.v) - before;
}

/// Builds the model for the present supports and plane; a running state is carried over.
void World::Implementation::rebuild(Rebuild why) {
  account_for_settings();
  if (tape) tape->refuse("supports were added or removed during the run, or the scene left its plane");
  const double stored = why == Rebuild::running ? elastic_energy() : 0.0;
  Model fresh = model_of_active(why);
  drop_scratch();
  const Model old = std::exchange(model, std::move(fresh));
  systems.build(model, options);
  if (why == Rebuild::first)
    begin_as_drawn();
  else
    carry_over(old, why);
  description.uncorrected_ends = model.description.uncorrected_ends;
  // Half stencils go with the support that has held their frame.
  if (why == Rebuild::running) support_work += elastic_energy() - stored;
  if (Contact* contact = systems.scheme().contact()) contact->initialise(state, parameters);
  reaction_current = false;
  make_plan();
}

void World::Implementation::remake_equations() {
  model.description.loads = description.loads;
  spatial_twin.reset();
  systems.build(model, options);
  systems.forget_matrix();
  reaction_current = false;
  state.acceleration_current = false;
  make_plan();
}

namespace {

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

State World::Implementation::transferred(const Model& old, const State& from) const {
  State to = initial_state(model);
  to.time = from.time;
  for (std::size_t o = 0; o < from.obstacles.size(); ++o) {
    const ObstacleDescription& drawn = description.contact.obstacles[o];
    to.obstacles[o] = obstacle_place(model, drawn, way_from_drawn(old, drawn, from.obstacles[o]));
  }
  to.contacts = from.contacts;
  std::copy_n(from.hands.begin(), std::min(from.hands.size(), to.hands.size()), to.hands.begin());
  to.contact_stiffness = from.contact_stiffness;
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
  for (int f = 0; f < model.frame_count; ++f) {
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
  for (std::size_t j = 0; !model.planar() && j < model.joint_angles.size(); ++j) {
    const JointAngle &before = old.joint_angles[j], &now = model.joint_angles[j];
    to.q[now.turning] = now.sign * before.angle(from.q);
    to.v[now.turning] = now.sign * before.angle(from.v);
    to.acceleration[now.turning] = now.sign * before.angle(from.acceleration);
  }
  if (!lifted && !model.planar()) copy_twists(old, from, model, to);
  return to;
}

/// A new frame takes the orientation that stresses its halves least, with the edges where they are.
void World::Implementation::relax_frames(const std::vector<bool>& is_new) {
  for (int f = 0; f < model.frame_count; ++f)
    if (is_new[at(f)]) relax_together({f}, {Matrix3::Identity()});
}

/// Turns a frame that nothing holds, and the hinges on it, with the edges that are attached to them.
void World::Implementation::orient_frame(int f, const Matrix3& free) {
  const int dof = model.frame_dof[at(f)];
  Configuration c;
  compute_configuration(model, state, state.q, c);
  // How an attached edge has turned since it was drawn.
  const auto turn_of = [&](const FrameStencil& half) -> Matrix3 {
    const Vector3 t = to_eigen(model.initial_tangent[at(half.edge)]),
                  d1 = to_eigen(model.initial_director[at(half.edge)]);
    Matrix3 drawn;
    drawn << d1, t.cross(d1), t;
    return edge_directors(model, c, half.edge) * drawn.transpose();
  };
  // As the first edge that no hinge lets turn.
  const auto fixed = std::find_if(model.half.begin(), model.half.end(),
                                  [f](const FrameStencil& half) { return half.frame == f && half.hinge < 0; });
  if (free.isIdentity() && fixed != model.half.end()) {
    const Matrix3 rotation = turn_of(*fixed);
    if (model.planar())
      state.q(dof) = nearest_turn(rotation_log(rotation).dot(model.plane->normal), state.q(dof));
    else
      state.frame[at(f)] = rotation;
  }
  for (const FrameStencil& half : model.half)
    if (half.frame == f && half.hinge >= 0) {
      const Hinge& hinge = model.hinges[at(half.hinge)];
      const Matrix3 relative = frame_rotation(model, state, f).transpose() * turn_of(half);
      state.q(hinge.dof) = nearest_turn(rotation_log(relative).dot(hinge.axis), state.q(hinge.dof));
    }
}

/// Forces on unknowns of frames and of hinges, `dofs`, of half stencils, tendons, moments and joints, and their
/// derivatives.
void World::Implementation::add_frame_forces(const std::vector<int>& dofs, VectorX& g, Eigen::MatrixXd& H) const {
  const auto place_of = [&](int dof) {
    const auto found = std::find(dofs.begin(), dofs.end(), dof);
    return dof < 0 || found == dofs.end() ? -1 : static_cast<int>(found - dofs.begin());
  };
  ElasticCoefficients elastic;
  set_elastic(parameters, elastic);
  const Configuration& c = configuration();
  Local local;
  const int n = model.frame_size(), row = model.planar() ? 4 : 7;
  for (std::size_t h = 0; h < model.half.size(); ++h) {
    const FrameStencil& half = model.half[h];
    int place[4] = {-1, -1, -1, -1};
    for (int i = 0; i < n; ++i) place[i] = place_of(model.frame_dof[at(half.frame)] + i);
    if (half.hinge >= 0) place[n] = place_of(model.hinges[at(half.hinge)].dof);
    if (place[0] < 0) continue;
    half_local(model, state.q, half_coefficients(elastic, static_cast<int>(h)), c, static_cast<int>(h), true, local);
    for (int i = 0; i <= n; ++i) {
      if (place[i] < 0) continue;
      g(place[i]) += local.gradient[row + i];
      for (int j = 0; j <= n; ++j)
        if (place[j] >= 0) H(place[i], place[j]) += local.hessian[row + i][row + j];
    }
  }
  const auto add = [&](const int* own, int count, const auto& of, bool with_matrix) {
    int place[kTendonUnknowns];
    for (int i = 0; i < count; ++i) place[i] = place_of(own[i]);
    for (int i = 0; i < count; ++i) {
      if (place[i] < 0) continue;
      g(place[i]) += of.gradient[i];
      for (int k = 0; with_matrix && k < count; ++k)
        if (place[k] >= 0) H(place[i], place[k]) += of.hessian[i][k];
    }
  };
  for (const TendonSegment& segment : tendon_segments(model)) {
    if (segment.seat[0].half < 0 && segment.seat[1].half < 0) continue;
    TendonLocal pulled;
    tendon_local(model, segment, parameters.tendon_tension[segment.tendon], state.q, c, true, pulled);
    add(segment.unknowns.dofs, segment.unknowns.size, pulled, true);
  }
  for (const LoadPiece& piece : resolve_loads(model).pieces) {
    if (piece.shape != LoadShape::frame_moment || piece.load < 0) continue;
    int own[kMaxLocal];
    const int count = load_dofs(model, piece, own);
    load_local(model, state, state.q, c, piece, parameters.loads.row(piece.load), local);
    add(own, count, local, false);  // whose derivatives at rest are antisymmetric
  }
  for (int j = 0; j < static_cast<int>(model.joint_angles.size()); ++j) {
    const JointAngle& joint = model.joint_angles[at(j)];
    const JointTorque torque = withe::joint_torque(parameters, elastic, j);
    const double pull = joint.sign * torque_of(torque, joint.angle(state.q), 0.0);
    const int turning = place_of(joint.turning), against = place_of(joint.against);
    if (turning >= 0) g(turning) -= pull, H(turning, turning) += torque.stiffness;
    if (against >= 0) g(against) += pull, H(against, against) += torque.stiffness;
    if (turning < 0 || against < 0) continue;
    H(turning, against) -= torque.stiffness;
    H(against, turning) -= torque.stiffness;
  }
}

/// Frames and the hinges on them, with the edges where they are; each frame turns about what its `free` projects onto.
void World::Implementation::relax_together(const std::vector<int>& frames, const std::vector<Matrix3>& free) {
  const int n = model.frame_size();
  std::vector<int> dofs;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    orient_frame(frames[f], free[f]);
    for (int i = 0; i < n; ++i) dofs.push_back(model.frame_dof[at(frames[f])] + i);
  }
  for (const Hinge& hinge : model.hinges)
    if (std::find(frames.begin(), frames.end(), hinge.frame) != frames.end()) dofs.push_back(hinge.dof);
  const auto size = static_cast<Eigen::Index>(dofs.size());
  Eigen::MatrixXd project = Eigen::MatrixXd::Identity(size, size);
  for (std::size_t f = 0; f < frames.size(); ++f)
    project.block(static_cast<Eigen::Index>(f) * n, static_cast<Eigen::Index>(f) * n, n, n) =
        free[f].topLeftCorner(n, n);
  for (int k = 0; k < 20; ++k) {
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(size, size);
    VectorX g = VectorX::Zero(size);
    add_frame_forces(dofs, g, H);
    const double scale = std::max(H.diagonal().cwiseAbs().maxCoeff(), 1e-300);
    H = project * H * project + scale * (Eigen::MatrixXd::Identity(size, size) - project);
    const VectorX step = project * H.ldlt().solve(-project * g);
    if (!step.allFinite()) break;
    const VectorX taken = step * std::min(1.0, 0.5 / std::max(step.norm(), 1e-300));
    for (Eigen::Index i = 0; i < size; ++i) state.q(dofs[static_cast<std::size_t>(i)]) += taken(i);
    for (int f : frames) {
      if (model.planar()) continue;
      const int dof = model.frame_dof[at(f)];
      state.frame[at(f)] = orthonormalized(cayley(state.q.segment<3>(dof)) * state.frame[at(f)]);
      state.q.segment<3>(dof).setZero();
    }
    if (step.norm() < 1e-13) break;
  }
}

void World::Implementation::leave_plane(const std::string& why) {
  require(!options.planar.value_or(false), why + " leaves the plane of the scene: build the scene with planar=False");
  spatial = true;
  plane_left_by = why;
  rebuild(Rebuild::running);
}

void World::Implementation::add_contact_notes() {
  const ContactDescription& contact = description.contact;
  if (!contact.any()) {
    plan.notes.emplace_back("no contact: no broad phase");
    return;
  }
  if (!contact.obstacles.empty())
    plan.notes.push_back(std::to_string(contact.obstacles.size()) +
                         " obstacle(s): their terms stay between neighbouring nodes");
  plan.notes.push_back(contact.rods ? "rods touch each other: they are coupled only where they are near"
                                    : "rods do not touch each other: no broad phase");
  if (contact.rods) add_coarse_notes();
  if (separated > 0.0)
    plan.notes.push_back("rods that overlapped as drawn were moved apart, by up to " + std::to_string(separated) +
                         " m: they are stressed there");
  if (!systems.scheme().contact()->frictional()) plan.notes.emplace_back("no friction: contact stays symmetric");
  if (options.integrator == Integrator::verlet && systems.scheme().contact()->regularises())
    plan.notes.emplace_back(
        "static friction limits explicit steps to about slip_tolerance / (7.5 mu) "
        "times the mass of a node over its contact force, which is unknown before the "
        "run");
}

/// Warns of rods whose edges are longer than they are thick: to contact they are chains of straight pieces.
void World::Implementation::add_coarse_notes() {
  for (std::size_t r = 0; r < description.rods.size(); ++r) {
    const VectorX& radius = description.rods[r].contact_radius;
    if (radius.size() == 0 || !(radius.minCoeff() > 0.0)) continue;
    const int first = model.rod_first_edge[r];
    const double ratio = (model.edge_length.segment(first, radius.size()).array() / (2.0 * radius.array())).maxCoeff();
    if (ratio <= 1.0 + 1e-9) continue;
    plan.notes.push_back("warning: edges of rod '" + description.rods[r].name + "' are " + text(ratio) +
                         " times as long as the rod is thick, and touch as straight pieces: more nodes "
                         "make contact smooth");
  }
}

std::string World::Implementation::fluid_note() const {
  switch (description.fluid.model) {
    case FluidModel::resistive:
      return "fluid: resistive-force theory, implicit; rods do not interact through the "
             "fluid";
    case FluidModel::stokeslets:
      return "fluid: regularized Stokeslet segments couple all " + std::to_string(model.node_count) +
             " nodes, once a step by conjugate gradients; the matrix of the steps does not "
             "change";
    case FluidModel::none:
      break;
  }
  return "no fluid: its terms are left out";
}

void World::Implementation::make_plan() {
  plan_current = true;
  const double stable = plan.stable_step;
  plan = Plan{};
  plan.stable_step = stable;
  plan.planar = model.planar();
  plan.unknowns = model.dof_count;
  plan.solver =
      options.integrator == Integrator::verlet ? "none (explicit)" : systems.scheme().assembler().solver().name();
  auto& notes = plan.notes;
  if (model.planar()) {
    plan.plane_normal = model.plane->normal;
    notes.push_back(
        "planar: 2 unknowns a node, no twist; a scene that could buckle out of its "
        "plane stays in its plane (build(planar=False) to force 3D)");
  } else {
    notes.push_back("3D: " + (options.planar.has_value() && !*options.planar ? std::string("planar=False")
                              : spatial                                      ? std::string("the scene left its plane")
                                                                             : model.plane_reason));
  }
  if (!plane_left_by.empty()) notes.push_back("left the plane while running: " + plane_left_by);
  for (const std::string& reason : systems.scheme().asymmetries()) notes.push_back("unsymmetric Jacobian: " + reason);
  if (parameters.held_lumped)
    notes.emplace_back(
        "fourth order, and a support has moved: the mass of edges that supports hold sits at their nodes");
  if (!parameters.dragged) notes.push_back("no drag: its terms are left out");
  notes.push_back(fluid_note());
  if (!parameters.viscous) notes.push_back("no viscosity: its terms are left out");
  for (const std::string& note : systems.scheme().notes()) notes.push_back(note);
  if (description.loads.empty()) notes.push_back("no loads but gravity");
  add_contact_notes();
  add_step_notes();
  notes.push_back("kernels: " + std::string(name_of(instruction_set())) +
                  (instruction_set() == InstructionSet::baseline ? ", 2 numbers at once" : ", 4 numbers at once"));
}

}  // namespace withe
