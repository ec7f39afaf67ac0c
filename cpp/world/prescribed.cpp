#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/check.hpp"
#include "geometry/rotation.hpp"
#include "model/edge_vectors.hpp"
#include "world/implementation.hpp"

namespace withe {
double ramp_fraction(double time, double start, double end) {
  if (time >= end) return 1.0;
  return std::clamp((time - start) / (end - start), 0.0, 1.0);
}

void World::Implementation::apply_ramps(double time) {
  for (std::size_t r = 0; r < ramps.size(); ++r) {
    const bool bent = ramps[r].curvature.apply(time, parameters.natural_curvature[r]),
               twisted = ramps[r].twist.apply(time, parameters.natural_twist[r]),
               stretched = ramps[r].stretch.apply(time, natural_stretch(static_cast<int>(r)));
    if (bent || twisted || stretched) update_natural(model, parameters, static_cast<int>(r));
  }
}

Eigen::VectorBlock<VectorX> World::Implementation::natural_stretch(int rod) {
  const int first = model.rod_first_edge[at(rod)];
  return parameters.edge_natural_stretch.segment(first, model.rod_first_edge[at(rod) + 1] - first);
}

/// Notes the actuation that the state came with, before it changes.
void World::Implementation::note_actuation() {
  if (!actuation_changed) actuation_before = actuation_of(parameters);
  actuation_changed = true;
}

/// The state has moved with the present shapes; those that have come to their end are at rest from now on.
void World::Implementation::retire_ramps() {
  actuation_changed = false;
  for (NaturalRamp& ramp : ramps) {
    ramp.curvature.retire(state.time);
    ramp.twist.retire(state.time);
    ramp.stretch.retire(state.time);
  }
}

bool World::Implementation::actuated() const {
  for (const NaturalRamp& ramp : ramps)
    if (ramp.curvature.active || ramp.twist.active || ramp.stretch.active) return true;
  return false;
}

SupportPose SupportMotion::pose_at(double time) const {
  const double s = shift.fraction(time), turned = turn.fraction(time);
  return {(1.0 - s) * from_position + s * to_position,
          rotation_exp(turned * rotation_log(to_rotation * from_rotation.transpose())) * from_rotation,
          fed_before + feed_rate * (time - feeds_since)};
}

void SupportMotion::put(const SupportPose& pose) {
  position = pose.position;
  rotation = pose.rotation;
  fed = pose.fed;
}

/// A support or an obstacle that is to be elsewhere at once gets there evenly in the course of the time step: shorter
/// steps meet less of a jump, or cutting them would be in vain.
void World::Implementation::spread_jumps(double duration) {
  const Span step{state.time, state.time + duration};
  for (SupportMotion& m : motions) {
    if (m.jumps()) {
      m.from_position = m.position;
      m.shift = step;
    }
    if (m.turn.start == m.turn.end && m.rotation != m.to_rotation) {
      m.from_rotation = m.rotation;
      m.turn = step;
    }
  }
  // One that has come there already, in an equilibrium say, is not where it set out from.
  const auto jumps = [&](const Span& way, const Vector3& now, const Vector3& from, const Vector3& to) {
    return way.start == way.end && way.end == state.time && (now - from).norm() < 0.5 * (to - from).norm();
  };
  for (std::size_t o = 0; o < obstacle_motions.size(); ++o) {
    ObstacleMotion& m = obstacle_motions[o];
    const ObstacleWay now = obstacle_way(static_cast<int>(o));
    if (jumps(m.shift, now.shift, m.from.shift, m.to.shift)) m.shift = step;
    if (jumps(m.turn, now.turn, m.from.turn, m.to.turn)) m.turn = step;
  }
}

/// Whether supports in space may turn rods about themselves in the coming step.
bool World::Implementation::turns_rods() const {
  if (model.planar()) return false;
  for (std::size_t s = 0; s < model.supports.size(); ++s) {
    const Support& support = model.supports[s];
    const SupportMotion& motion = motions[s];
    if (support.active && (support.frame >= 0 || !support.edges.empty()) &&
        (callbacks.prescribes || state.time < motion.turn.end))
      return true;
  }
  return false;
}

void World::Implementation::prescribe(double time, Prescribed& out) const {
  out.supports.clear();
  for (const SupportMotion& motion : motions) out.supports.push_back(motion.pose_at(time));
  hold(out.supports, out.held);
  out.obstacles.clear();
  if (!obstacle_motions.empty())
    out.obstacles = obstacle_places([&](int o) { return obstacle_motions[at(o)].at(time); });
  out.custom = {};
  out.respond = nullptr;
}

Prescribed World::Implementation::at_rest() const {
  Prescribed out;
  put_custom_force(out);
  return out;
}

void put_node(const Model& model, int node, const Vector3& position, VectorX& q) {
  const int dof = model.node_dof[at(node)];
  if (model.planar())
    q.segment<2>(dof) << (position - model.plane->origin).dot(model.plane->first),
        (position - model.plane->origin).dot(model.plane->second);
  else
    q.segment<3>(dof) = position;
}

void World::Implementation::hold(const std::vector<SupportPose>& supports, HeldTarget& target) const {
  target.q = state.q;
  target.turn = target.spin = 0.0;
  target.reachable = true;
  for (std::size_t s = 0; s < model.supports.size(); ++s) {
    const Support& support = model.supports[s];
    if (!support.active) continue;
    const SupportPose& pose = supports[s];
    if (support.is_hand()) continue;
    const auto put = [&](int node, const Vector3& position) { put_node(model, node, position, target.q); };
    put(support.node, pose.position);
    const bool spinning = may_spin(support.description.kind);
    if (support.frame >= 0 && !(spinning && !model.planar())) {
      const int dof = model.frame_dof[at(support.frame)];
      if (model.planar()) {
        const double now = state.q(dof);
        const Matrix3 rest = pose.rotation * rotation_exp(now * model.plane->normal).transpose();
        target.q(dof) = now + rotation_log(rest).dot(model.plane->normal);
      } else {
        const Matrix3 rest = pose.rotation * state.frame[at(support.frame)].transpose();
        target.turn = std::max(target.turn, rotation_log(rest).norm());
        if (target.turn > 2.5) target.reachable = false;
        target.q.segment<3>(dof) = cayley_inverse(rest);
      }
    }
    if (support.other_node >= 0) {
      // The held edge moves rigidly with the node.
      const auto& drawn = description.positions;
      const Vector3 arm = motions[s].stretch * (drawn.row(support.other_node) - drawn.row(support.node)).transpose();
      put(support.other_node, pose.position + pose.rotation * arm);
      if (!model.planar() && !spinning) {
        // Its angle is what the rotated drawn director measures against direct transport of the reference.
        const auto e = at(support.edge);
        const Vec3d t = to_vec3(pose.rotation * to_eigen(model.initial_tangent[e]));
        const Vec3d d = to_vec3(pose.rotation * to_eigen(model.initial_director[e]));
        const int dof = model.edge_dof[e];
        if (dot(state.tangent[e], t) < -0.5) target.reachable = false;
        const double angle = signed_angle(parallel_transport(state.director[e], state.tangent[e], t), d, t);
        target.q(dof) += std::remainder(angle - state.q(dof), 2.0 * std::numbers::pi);
      }
    }
  }
  hold_hands(supports, target);
  for (const Support& support : model.supports) {
    if (!support.active || support.yields() || model.planar()) continue;
    for (int edge : support.edges) {
      const int dof = model.edge_dof[at(edge)];
      target.spin = std::max(target.spin, std::abs(target.q(dof) - state.q(dof)));
    }
  }
}

CustomForces World::Implementation::custom_forces(double time, const VectorX& q, const VectorX& v,
                                                  bool derivatives) const {
  MatrixX3 positions(model.node_count, 3), velocities(model.node_count, 3);
  for (int i = 0; i < model.node_count; ++i) {
    positions.row(i) = node_position(model, q, i);
    velocities.row(i) = node_vector(model, v, i);
  }
  CustomForces now = callbacks.force(time, positions, velocities, derivatives);
  const auto check = [&](const MatrixX3& table, const std::string& what) {
    require(table.rows() == model.node_count, what + " must have one row a node, " + std::to_string(model.node_count) +
                                                  ", got " + std::to_string(table.rows()));
    require(table.allFinite(), what + " must be finite");
  };
  check(now.forces, "custom force");
  if (description.custom_moments) check(now.moments, "custom moment");
  if (model.planar()) {
    const Vector3& n = model.plane->normal;
    const double off = description.custom_moments ? (now.moments - now.moments * n * n.transpose()).norm() : 0.0;
    require((now.forces * n).norm() <= 1e-8 * now.forces.norm() && off <= 1e-8 * now.moments.norm(),
            "a custom force leaves the plane of the scene: build the scene with "
            "planar=False");
  }
  const Eigen::Index columns = 3 * model.node_count, rows = (description.custom_moments ? 2 : 1) * columns;
  for (const SparseMatrix* m : {&now.by_position, &now.by_velocity})
    require(m->size() == 0 || (m->rows() == rows && m->cols() == columns), "derivatives of a custom force must have " +
                                                                               std::to_string(rows) + " rows and " +
                                                                               std::to_string(columns) + " columns");
  return now;
}

void World::Implementation::note(const CustomForces& now) {
  custom_force = now.forces;
  if (description.custom_moments) custom_moments = now.moments;
}

void World::Implementation::find_custom_force(double time, const VectorX& q, const VectorX& v) {
  note(custom_forces(time, q, v, false));
}

/// Custom forces of a step of dt are those where the scheme's own forces act.
void World::Implementation::prescribe_custom(double dt, Prescribed& out) {
  if (!description.has_custom_force) return;
  if (callbacks.force && description.custom_implicit && options.integrator != Integrator::verlet) {
    out.respond = [this, time = force_time(state.time, dt)](const VectorX& q, const VectorX& v, bool derivatives) {
      CustomForces now = custom_forces(time, q, v, derivatives);
      note(now);
      return now;
    };
    return;
  }
  if (callbacks.force) find_custom_force_of_step(dt, out);
  put_custom_force(out);
}

CustomResponse World::Implementation::custom_response_at_rest(double time) const {
  if (!callbacks.force) return nullptr;
  return [this, time](const VectorX& q, const VectorX& v, bool derivatives) {
    CustomForces now = custom_forces(time, q, VectorX::Zero(v.size()), derivatives);
    now.by_velocity.resize(0, 0);
    return now;
  };
}

void World::Implementation::prescribe_custom_at_rest(double time, Prescribed& out) {
  put_custom_force(out);
  CustomResponse at_rest = custom_response_at_rest(time);
  if (!at_rest) return;
  out.respond = [this, at_rest = std::move(at_rest)](const VectorX& q, const VectorX& v, bool derivatives) {
    CustomForces now = at_rest(q, v, derivatives);
    note(now);
    return now;
  };
}

/// Forces at the start of a step would feed a spring's oscillation, by 1 + (w dt)^2 / 2 a step. At q0 + (dt / 2) v0,
/// which under the midpoint rule is q1 - (dt / 2) v1 as well, they leave the step symmetric in time, of second order,
/// and stable for a spring of frequency w < 2 / dt, however stiff the rod that it pulls at: its matrix has the
/// determinant 1 and the trace 2 - (w dt)^2. Backward Euler's at the predicted end damp, for w < sqrt(4/3) / dt.
/// Verlet's end is known.
void World::Implementation::find_custom_force_of_step(double dt, Prescribed& out) {
  VectorX &q = systems.work.z, &v = systems.work.velocity;
  if (options.integrator == Integrator::verlet) {
    if (!state.acceleration_current) find_custom_force(state.time, state.q, state.v);
    put_custom_force(out);
    begin_verlet(systems.scheme(), parameters, out, dt, state, systems.work);
    find_custom_force(state.time + dt, q, v);
    return;
  }
  const Assembler& assembler = systems.scheme().assembler();
  const double time = force_time(state.time, dt);
  const auto hold = [&] {
    assembler.project(v);
    assembler.add_held_change(state.q, out.held.q, 1.0 / dt, v);
  };
  v = state.v;
  hold();
  q = state.q + (time - state.time) * v;
  if (conserving()) {
    extrapolate_velocity(state, time, v);
    hold();
  }
  find_custom_force(time, q, v);
}

void World::Implementation::put_custom_force(Prescribed& out) const {
  if (description.has_custom_force) out.custom = applied_forces(model, custom_force, custom_moments);
}

}  // namespace withe
