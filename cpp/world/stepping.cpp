#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <tuple>

#include <Eigen/LU>

#include "geometry/rotation.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

double ramp_fraction(double time, double start, double end) {
  if (time >= end) return 1.0;
  return std::clamp((time - start) / (end - start), 0.0, 1.0);
}

}  // namespace

void World::Implementation::apply_ramps(double time) {
  bool changed = false;
  for (std::size_t r = 0; r < ramps.size(); ++r) {
    NaturalRamp& ramp = ramps[r];
    if (ramp.curvature_active) {
      const double s = ramp_fraction(time, ramp.curvature_start, ramp.curvature_end);
      parameters.natural_curvature[r] = (1.0 - s) * ramp.from_curvature + s * ramp.to_curvature;
      changed = true;
    }
    if (ramp.twist_active) {
      const double s = ramp_fraction(time, ramp.twist_start, ramp.twist_end);
      parameters.natural_twist[r] = (1.0 - s) * ramp.from_twist + s * ramp.to_twist;
      changed = true;
    }
  }
  if (changed) update_natural(model, parameters);
}

void World::Implementation::set_motion_at(SupportMotion& motion, double time) const {
  const double s = ramp_fraction(time, motion.start, motion.end);
  motion.position = (1.0 - s) * motion.from_position + s * motion.to_position;
  motion.rotation =
      rotation_exp(s * rotation_log(motion.to_rotation * motion.from_rotation.transpose())) * motion.from_rotation;
}

HeldTarget World::Implementation::held_target(double time) {
  for (SupportMotion& motion : motions) set_motion_at(motion, time);
  return held_now();
}

/// The held unknowns when supports are where `motions` say.
HeldTarget World::Implementation::held_now() const {
  HeldTarget target;
  target.q = state.q;
  for (std::size_t s = 0; s < model.supports.size(); ++s) {
    const Support& support = model.supports[s];
    if (!support.active) continue;
    const SupportMotion& motion = motions[s];
    const auto put = [&](int node, const Vector3& position) {
      const int dof = model.node_dof[at(node)];
      if (model.planar())
        target.q.segment<2>(dof) << (position - model.plane->origin).dot(model.plane->first),
            (position - model.plane->origin).dot(model.plane->second);
      else
        target.q.segment<3>(dof) = position;
    };
    put(support.node, motion.position);
    if (support.frame >= 0) {
      const int dof = model.frame_dof[at(support.frame)];
      if (model.planar()) {
        const double now = state.q(dof);
        const Matrix3 rest = motion.rotation * rotation_exp(now * model.plane->normal).transpose();
        target.q(dof) = now + rotation_log(rest).dot(model.plane->normal);
      } else {
        const Matrix3 rest = motion.rotation * state.frame[at(support.frame)].transpose();
        if (rotation_log(rest).norm() > 2.5) target.reachable = false;
        target.q.segment<3>(dof) = cayley_inverse(rest);
      }
    }
    if (support.other_node >= 0) {
      // The held edge moves rigidly with the node.
      const auto& drawn = description.positions;
      const Vector3 arm = (drawn.row(support.other_node) - drawn.row(support.node)).transpose();
      put(support.other_node, motion.position + motion.rotation * arm);
      if (!model.planar()) {
        // Its angle is what the rotated drawn director measures against direct transport of the reference.
        const auto e = at(support.edge);
        const Vec3d t = to_vec3(motion.rotation * to_eigen(model.initial_tangent[e]));
        const Vec3d d = to_vec3(motion.rotation * to_eigen(model.initial_director[e]));
        const int dof = model.edge_dof[e];
        if (dot(state.tangent[e], t) < -0.5) target.reachable = false;
        const double angle = signed_angle(parallel_transport(state.director[e], state.tangent[e], t), d, t);
        target.q(dof) += std::remainder(angle - state.q(dof), 2.0 * std::numbers::pi);
      }
    }
  }
  return target;
}

void World::Implementation::update_custom_force(Equations& target) const {
  if (!description.has_custom_force) return;
  for (int i = 0; i < model.node_count; ++i) {
    const int dof = model.node_dof[at(i)];
    const Vector3 f = custom_force.row(i);
    if (model.planar())
      target.custom_force.segment<2>(dof) << f.dot(model.plane->first), f.dot(model.plane->second);
    else
      target.custom_force.segment<3>(dof) = f;
  }
}

double World::Implementation::actuation_energy(const State& s, const Parameters& p) const {
  Configuration c;
  compute_configuration(model, s, s.q, c);
  ElasticCoefficients k;
  set_elastic(p, k);
  double energy = 0.0;
  for (int b = 0; b < static_cast<int>(model.bend.size()); ++b) {
    const BendTwistEnergy e = bend_energy_of(k, c, b);
    energy += e.bend + e.twist;
  }
  for (int h = 0; h < static_cast<int>(model.half.size()); ++h) {
    const BendTwistEnergy e = half_energy_of(k, c, h);
    energy += e.bend + e.twist;
  }
  return energy;
}

void World::Implementation::inner_step(double dt, bool& accepted, double& error) {
  const bool explicit_scheme = options.integrator == Integrator::verlet;
  const bool mid =
      options.integrator == Integrator::implicit_midpoint || options.integrator == Integrator::energy_momentum;
  const double start = state.time, end = start + dt, force_time = mid ? start + 0.5 * dt : end;
  bool actuated = false;
  for (const NaturalRamp& ramp : ramps) actuated = actuated || ramp.curvature_active || ramp.twist_active;
  double before = 0.0;
  if (actuated) {
    apply_ramps(start);
    before = -actuation_energy(state, parameters);
    apply_ramps(force_time);
    before += actuation_energy(state, parameters);
  }
  std::vector<SupportMotion> kept = motions;
  const HeldTarget held = held_target(end);
  const bool rescued = guard.rescue > 0;
  Equations& system = rescued ? rescue() : *equations;
  Options choice = options;
  if (rescued) choice.integrator = Integrator::energy_momentum;
  update_custom_force(system);
  const StepResult r = explicit_scheme ? verlet_step(system, parameters, dt, held, state, work)
                                       : implicit_step(system, *newton, choice, parameters, dt, held, state, work);
  accepted = r.accepted;
  error = r.error;
  last_newton = r.newton;
  if (!accepted) {
    motions = kept;
    if (actuated) apply_ramps(start);
    return;
  }
  reaction_residual = work.evaluation.full_residual;
  reaction_current = true;
  statistics.steps += 1;
  statistics.largest_turn = std::max(statistics.largest_turn, r.largest_turn);
  guard.turn = r.largest_turn;
  if (rescued) {
    --guard.rescue;
    statistics.energy_momentum_steps += 1;
  }
  load_work += r.load_work;
  dissipated += r.dissipated;
  support_work += r.support_work;
  // The residual of a frame's unknowns is J(w)^T moment, w its turn where the forces act.
  if (!model.planar())
    for (const Support& support : model.supports) {
      if (!support.active || support.frame < 0) continue;
      const int dof = model.frame_dof[at(support.frame)];
      const Matrix3 J = cayley_spin((mid ? 0.5 : 1.0) * held.q.segment<3>(dof));
      reaction_residual.segment<3>(dof) = J.transpose().inverse() * reaction_residual.segment<3>(dof);
    }
  if (actuated) {
    double after = -actuation_energy(state, parameters);
    apply_ramps(end);
    after += actuation_energy(state, parameters);
    actuation_work += before + after;
    for (NaturalRamp& ramp : ramps) {
      if (end >= ramp.curvature_end) ramp.curvature_active = false;
      if (end >= ramp.twist_end) ramp.twist_active = false;
    }
  }
}

void World::Implementation::advance(double duration) {
  const double base = state.time;
  if (options.integrator == Integrator::verlet && !alarm) alarm = energy();
  const long units = 1L << options.max_halvings;
  if (!options.adaptive && !options.tolerance) level = 0;
  long position = 0;
  while (position < units) {
    if (interrupted.exchange(false)) throw Interrupted();
    long size = units >> level;
    while (position % size != 0) size >>= 1;
    const double dt = duration * static_cast<double>(size) / static_cast<double>(units);
    if (callback) {
      const bool mid =
          options.integrator == Integrator::implicit_midpoint || options.integrator == Integrator::energy_momentum;
      callback(state.time + (mid ? 0.5 : 1.0) * dt, state.time + dt);
    }
    const bool guarded = options.adaptive && options.integrator == Integrator::implicit_midpoint;
    const State backup = options.tolerance || guarded ? state : State{};
    const std::vector<NaturalRamp> ramps_before = options.tolerance || guarded ? ramps : std::vector<NaturalRamp>{};
    // Where edges hardly turn, there is nothing to gain and nothing to look at.
    const bool watched = guarded && guard.turn > 0.01 && guard.rescue == 0;
    const Energy then = watched ? energy() : Energy{};
    guard.step_gain = 0.0;
    bool accepted = false;
    double error = 0.0;
    const auto books = std::tuple{support_work, actuation_work, dissipated, load_work};
    inner_step(dt, accepted, error);
    bool too_coarse = false, very_fine = true;
    if (accepted && options.tolerance) {
      const double allowed = *options.tolerance * dt / options.duration.value_or(1.0);
      too_coarse = error > allowed;
      very_fine = error < allowed / 10.0;
    }
    const bool may_halve = (options.adaptive || options.tolerance) && level < options.max_halvings &&
                           options.integrator != Integrator::verlet;
    const auto take_back = [&] {
      state = backup;
      std::tie(support_work, actuation_work, dissipated, load_work) = books;
      ramps = ramps_before;  // one that ended within the step has not ended yet
      apply_ramps(state.time);
      reaction_current = false;
      accepted = false;
      statistics.steps -= 1;
    };
    if (accepted && watched && gains_energy(then)) {
      // The same step again, and a while of them, without the flaw.
      take_back();
      statistics.rejected_steps += 1;
      guard.rescue = 256;
      continue;
    }
    if (accepted && too_coarse && may_halve) take_back();
    if (!accepted) {
      statistics.rejected_steps += 1;
      if (!may_halve)
        fail(last_newton, dt,
             options.integrator == Integrator::verlet ? "the explicit step broke down" : "the step did not converge");
      while ((units >> level) > size) ++level;
      ++level;
      easy_steps = 0;
      continue;
    }
    position += size;
    state.time = position == units ? base + duration
                                   : base + duration * static_cast<double>(position) / static_cast<double>(units);
    guard.excess += guard.step_gain;
    if (very_fine && ++easy_steps >= 4 && level > 0) {
      --level;
      easy_steps = 0;
    }
    if (!very_fine) easy_steps = 0;
  }
  if (options.integrator == Integrator::verlet) check_explicit();
}

/// Plain midpoint pumps energy into stretching when edges turn far within a step: whether the step just taken did.
bool World::Implementation::gains_energy(const Energy& then) {
  const Energy now = energy();
  guard.scale = std::max({guard.scale, now.kinetic, then.kinetic, 0.1 * (now.stretch + now.bend + now.twist)});
  guard.step_gain = (now.total - now.work + now.dissipated) - (then.total - then.work + then.dissipated);
  return guard.step_gain > 1e-6 * guard.scale && guard.excess + guard.step_gain > 5e-3 * guard.scale;
}

/// An explicit scheme that is about to blow up gains energy long before it shows as NaN.
void World::Implementation::check_explicit() {
  const Energy e = energy();
  const double gain = (e.total - e.work + e.dissipated) - (alarm->total - alarm->work + alarm->dissipated);
  const double scale = std::max({alarm->kinetic, std::abs(e.gravity - alarm->gravity), std::abs(e.loads - alarm->loads),
                                 std::abs(e.work - alarm->work), alarm->stretch + alarm->bend + alarm->twist, 1e-300});
  if (!std::isfinite(e.total) || gain > 0.5 * scale)
    fail(NewtonResult{}, options.time_step, "the explicit scheme gains energy: take a smaller time_step");
}

void World::Implementation::fail(const NewtonResult& r, double dt, const std::string& what) const {
  int rod = -1, node = -1;
  std::string place;
  if (r.worst_row >= 0) {
    const auto holds = [&](int first, int count) { return first <= r.worst_row && r.worst_row < first + count; };
    int where = -1;
    for (int i = 0; i < model.node_count; ++i)
      if (holds(model.node_dof[at(i)], model.dimension)) where = i;
    for (int f = 0; f < model.frame_count; ++f)
      if (holds(model.frame_dof[at(f)], model.frame_size())) where = model.frame_node[at(f)];
    for (const Hinge& hinge : model.hinges)
      if (holds(hinge.dof, 1)) where = model.frame_node[at(hinge.frame)];
    for (std::size_t e = 0; e < model.edge_dof.size(); ++e)
      if (holds(model.edge_dof[e], 1)) where = model.edge_tail[e];
    for (std::size_t k = 0; k < description.rods.size() && rod < 0; ++k) {
      const auto& nodes = description.rods[k].nodes;
      const auto found = std::find(nodes.begin(), nodes.end(), where);
      if (found == nodes.end()) continue;
      rod = static_cast<int>(k);
      node = static_cast<int>(found - nodes.begin());
    }
    if (rod >= 0) place = " at node " + std::to_string(node) + " of rod '" + description.rods[at(rod)].name + "'";
  }
  char numbers[128];
  std::snprintf(numbers, sizeof numbers, " (time %.6g s, step %.3g s, residual %.3g N", state.time, dt, r.residual);
  throw ConvergenceFailure(what + numbers + place + "); the world is left in its last accepted state", state.time, dt,
                           rod, node, r.residual);
}

Equations& World::Implementation::statics() {
  const bool same = options.integrator != Integrator::energy_momentum;
  if (same) return *equations;
  if (!static_equations) {
    Options symmetric = options;
    symmetric.integrator = Integrator::statics;
    static_equations = std::make_unique<Equations>(model, symmetric);
  }
  static_equations->loads().values = load_values;
  return *static_equations;
}

/// Energy-momentum steps, which take over where plain midpoint gains energy.
Equations& World::Implementation::rescue() {
  if (!rescue_equations) {
    Options conserving = options;
    conserving.integrator = Integrator::energy_momentum;
    rescue_equations = std::make_unique<Equations>(model, conserving);
  }
  rescue_equations->loads().values = load_values;
  return *rescue_equations;
}

/// Equilibrium after `dt` (0: at the present time, with supports and actuation as they are).
EquilibriumResult World::Implementation::equilibrium(double dt) {
  const State kept = state;
  const std::vector<SupportMotion> kept_motions = motions;
  const MatrixX3 natural_before = parameters.bend_natural;
  const double time = state.time + dt;
  bool actuated = false;
  for (const NaturalRamp& ramp : ramps) actuated = actuated || ramp.curvature_active || ramp.twist_active;
  const double energy_before = actuated ? actuation_energy(state, parameters) : 0.0;
  if (actuated) {
    apply_ramps(time);
    actuation_work += actuation_energy(state, parameters) - energy_before;
  }
  const HeldTarget held = held_target(time);
  Equations& system = statics();
  update_custom_force(system);
  const Boundary boundary = [&](double fraction, const State& start, VectorX& q) {
    // Frames count from where they are now, so only what is left of the way is asked for.
    (void)start;
    const std::vector<SupportMotion> target = motions;
    for (std::size_t s = 0; s < motions.size(); ++s) {
      const SupportMotion &a = kept_motions[s], &b = target[s];
      motions[s].position = a.position + fraction * (b.position - a.position);
      motions[s].rotation = rotation_exp(fraction * rotation_log(b.rotation * a.rotation.transpose())) * a.rotation;
    }
    const HeldTarget partial = held_now();
    q += system.assembler().held_part(partial.q - q);
    motions = target;
  };
  state.v.setZero();
  state.acceleration.setZero();
  state.acceleration_current = false;
  StaticResult r;
  if (held.reachable) r = find_equilibrium(system, *newton, options, parameters, boundary, state, work);
  if (!r.converged) {
    state = kept;
    motions = kept_motions;
    fail(r.newton, dt, "no static equilibrium was found");
  }
  if (actuated)
    for (NaturalRamp& ramp : ramps) {
      if (time >= ramp.curvature_end) ramp.curvature_active = false;
      if (time >= ramp.twist_end) ramp.twist_active = false;
    }
  state.time = time;
  statistics.steps += 1;
  system.begin(state, parameters, 0.0, false);
  system.evaluate(state.q, false, nullptr, work.evaluation);
  reaction_residual = work.evaluation.full_residual;
  reaction_current = true;
  newton->balance(work.evaluation, r.newton);
  return {r.stable, r.newton.iterations, r.newton.residual};
}

void World::Implementation::refresh_reactions() {
  if (reaction_current) return;
  Equations& system = statics();
  update_custom_force(system);
  system.begin(state, parameters, 0.0, false);
  system.evaluate(state.q, false, nullptr, work.evaluation);
  reaction_residual = work.evaluation.full_residual;
  reaction_current = true;
}

Energy World::Implementation::energy() const {
  Energy e;
  Configuration c;
  compute_configuration(model, state, state.q, c);
  ElasticCoefficients k;
  set_elastic(parameters, k);
  e.kinetic = 0.5 * state.v.dot(mass_vector(model, parameters).cwiseProduct(state.v));
  for (int i = 0; i < model.edge_count; ++i) e.stretch += stretch_energy_of(model, k, c, i);
  for (int b = 0; b < static_cast<int>(model.bend.size()); ++b) {
    const BendTwistEnergy part = bend_energy_of(k, c, b);
    e.bend += part.bend;
    e.twist += part.twist;
  }
  for (int h = 0; h < static_cast<int>(model.half.size()); ++h) {
    const BendTwistEnergy part = half_energy_of(k, c, h);
    e.bend += part.bend;
    e.twist += part.twist;
  }
  e.gravity = -gravity_force(model, parameters).dot(state.q);
  e.loads = -load_work;
  e.total = e.kinetic + e.stretch + e.bend + e.twist + e.gravity + e.loads + e.contact;
  e.work = support_work + actuation_work;
  e.dissipated = dissipated;
  return e;
}

}  // namespace withe
