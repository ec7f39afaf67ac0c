#include <algorithm>

#include "common/check.hpp"
#include "common/text.hpp"
#include "common/timer.hpp"
#include "integrators/arc_length.hpp"
#include "integrators/stiffness_signs.hpp"
#include "run/drive.hpp"
#include "run/rest.hpp"
#include "run/transfer.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

constexpr const char* kSideways =
    "the equilibrium is not stable against motions out of its plane: in space the "
    "scene would buckle or tip over sideways. Use build(planar=False) to allow "
    "this, or build(planar=True) if a guide keeps the scene in its plane";

constexpr const char* kNotInSpace =
    "the stability of the equilibrium was tested in its plane only: in space, a "
    "clamp cannot hold a rod that turns about one of several hinges. Clamp the rod "
    "that the hinges turn against, or use build(planar=True) if a guide keeps the "
    "scene in its plane";

}  // namespace

/// Forgets that anything moved.
void World::Implementation::rest() {
  state.v.setZero();
  state.acceleration.setZero();
  state.acceleration_current = false;
  state.motion.known = 0;
  predictor.clear();
  systems.forget_matrix();
  systems.work.newton.finest = INFINITY;
}

/// Equilibrium after `dt` (0: at the present time, with supports and actuation as they are).
EquilibriumResult World::Implementation::equilibrium(double dt, Saddles saddles) {
  account_for_settings();
  const Moving before = *this;
  const Lagged lagged_before = systems.lagged();
  const MatrixX3 loads = parameters.loads;
  const double time = state.time + dt;
  const bool actuation_changed_before = actuation_changed;
  if (are_active(ramps)) {
    note_actuation();
    ledger.actuation_work += apply_ramps(model, ramps, time, state.q, configuration(), parameters, energy_scratch);
  }
  const Actuation wanted = actuation_changed ? actuation_of(parameters) : Actuation{};
  prescribe(model, *this, *this, time, prescribed);
  Equations& system = systems.statics();
  const MatrixX3 forces_before = custom_force, moments_before = custom_moments;
  const auto undo = [&] {
    custom_force = forces_before;
    custom_moments = moments_before;
    static_cast<Moving&>(*this) = before;
    if (actuation_changed) set_actuation_between(model, wanted, wanted, 1.0, parameters);
    apply_ramps(model, ramps, state.time, parameters);
    actuation_changed = actuation_changed_before;
    parameters.loads = loads;
    systems.recall(lagged_before);  // and no more of `system`, which this may drop
  };
  std::vector<SupportMotion> from = motions;
  std::vector<SupportMotion> target = motions;
  put(prescribed.supports, target);
  const Boundary boundary = boundary_between(model, *this, system, from, target, prescribed);
  const auto find = [&](const Actuation* before_change) {
    return find_equilibrium(system, systems.newton(), options, parameters, before_change, boundary, saddles, state,
                            systems.work.newton);
  };
  rest();
  StaticResult r;
  try {
    even_contact(parameters, system, Prescribed::nothing(), false, state);
    custom().put_response_at_rest(time, prescribed);
    VectorX reached = state.q;
    if (boundary.hold(0.0, 1.0, reached)) check_squeezed(system, prescribed, reached, dt);
    if (drifts(model, parameters, state, system, prescribed, systems.work.newton.data)) {
      systems.newton().balance(systems.work.newton.data, r.newton);
      r.newton.worst_row = systems.newton().worst_row(systems.work.newton.data.residual);
    } else {
      r = find(actuation_changed ? &actuation_before : nullptr);
    }
    for (SupportMotion& m : target) m.roll.setZero();
    from = target;
    if (r.converged && system.contact())
      settle_contact(system, parameters, prescribed, [&] { return find(nullptr); }, state, r);
  } catch (...) {
    undo();
    throw;
  }
  motions = target;
  if (const HandForces* hands = system.hands(); hands && r.converged)
    hands->accept(prescribed.supports, configuration(), state);
  if (!r.converged) {
    undo();
    const char* softly = "Try smaller changes of loads and supports, one after the other, or time steps with viscosity";
    fail(r.newton, dt, no_equilibrium(model, r), dt > 0.0 ? "" : softly);
  }
  EquilibriumResult found = settle(system, r, time);
  if (!release_left_rings()) {
    if (found.stable && buckles_out_of_plane()) {
      found.stable = false;
      if (saddles == Saddles::leave) warnings.report(Warning::plane, kSideways);
    }
    return found;
  }
  // Without a ring that it has left a rod goes on.
  EquilibriumResult next = equilibrium(0.0, saddles);
  next.iterations += found.iterations;
  next.branch_changed = true;
  return next;
}

bool World::Implementation::buckles_out_of_plane() {
  if (!model.planar() || options.planar.value_or(false) || !systems.statics().has_potential_here()) return false;
  if (spatial_twin) {
    static_cast<Running&>(*spatial_twin) = *this;
    spatial_twin->state = transferred(model, state, spatial_twin->model);
    update_derived(spatial_twin->model, spatial_twin->parameters);
  } else {
    spatial_twin = std::make_unique<Implementation>(*this, Unbuilt{});
    spatial_twin->options.integrator = Integrator::statics;
    spatial_twin->spatial = true;
    try {
      spatial_twin->rebuild(Rebuild::running);
    } catch (const std::invalid_argument&) {  // it exists in its plane only
      spatial_twin.reset();
      warnings.report(Warning::plane, kNotInSpace);
      return false;
    }
  }
  Implementation& space = *spatial_twin;
  space.systems.scheme().begin(space.state, space.parameters, StepRule::statics, 0.0);
  StepData& data = space.systems.work.newton.data;
  space.systems.scheme().evaluate(space.state.q, true, nullptr, data);
  StiffnessSigns signs(space.systems.scheme(), space.systems.newton().norms(), space.systems.work.newton.counters);
  return !signs.stable(space.state, data);
}

void World::Implementation::static_step(double end, double dt) {
  systems.work.newton.poll();
  if (callbacks.before_step) callbacks.before_step(end, end);
  if (!equilibrium(dt).branch_changed) return;
  warnings.report(Warning::branch, "the static step to time " + text(end, 6) +
                                       " s left its branch of equilibria: the scene jumps within the step, or was at "
                                       "a saddle, and the equilibrium after a jump depends on the motion. Time steps "
                                       "resolve the motion; equilibrium(path=\"arc_length\") follows a branch through "
                                       "limit points");
}

/// The scene is in the equilibrium that was found, at a time.
EquilibriumResult World::Implementation::settle(Equations& system, StaticResult& r, double time) {
  state.time = time;
  retire_ramps();
  statistics.steps += 1;
  steps_taken += 1;
  const Prescribed still = custom().at_rest();
  system.begin(state, parameters, StepRule::statics, 0.0, still);
  system.evaluate(state.q, false, nullptr, systems.work.newton.data);
  system.find_joint_wrenches(systems.work.newton.data);
  note_reactions();
  systems.newton().balance(systems.work.newton.data, r.newton);
  check_resolution();
  if (r.branch_changed) statistics.branch_changes += 1;
  const bool frictional = system.contact() && system.contact()->frictional();
  const bool symmetric = !system.loads().unsymmetric && !description.has_custom_force;
  return {r.stable, symmetric || frictional, r.branch_changed, r.newton.iterations, r.newton.residual};
}

namespace {

void check_path(const PathOptions& wanted, const SceneDescription& scene) {
  for (int load : wanted.loads)
    require(load >= 0 && load < static_cast<int>(scene.loads.size()), "no such load: ", load);
  require(std::isfinite(wanted.start) && std::isfinite(wanted.end) && wanted.start != wanted.end,
          "a path needs two different load factors");
  require(wanted.most_points > 0 && wanted.turn > 0.0, "a path needs points and turns that are positive");
}

/// Some of the loads, times a factor.
void scale_loads(const SceneDescription& scene, const std::vector<int>& which, double factor, const MatrixX3& full,
                 MatrixX3& loads) {
  for (int load : which) {
    const auto k = static_cast<std::size_t>(load);
    const Eigen::Index first = first_load_row(scene, k), rows = scene.loads[k].values.rows();
    loads.middleRows(first, rows) = factor * full.middleRows(first, rows);
  }
}

PathPoint path_point(const World& world, const Model& model, const ArcPoint& point) {
  const auto supports = static_cast<Eigen::Index>(model.supports.size());
  MatrixX3 forces = MatrixX3::Zero(supports, 3), moments = forces;
  for (Eigen::Index s = 0; s < supports; ++s) {
    if (!model.supports[static_cast<std::size_t>(s)].active) continue;
    const Reaction held = world.reaction(static_cast<int>(s));
    forces.row(s) = held.force;
    moments.row(s) = held.moment;
  }
  return {point.factor, point.stable, point.limit, world.positions(), forces, moments};
}

}  // namespace

EquilibriumPath World::equilibrium_path(const PathOptions& wanted) {
  Implementation& self = accounted();
  const Timer timer(self.statistics.total_time);
  check_path(wanted, self.description);
  const MatrixX3 full = self.parameters.loads;
  const bool by_loads = !wanted.loads.empty();
  const ActingPath scaled = [&](double factor, Parameters& acting) {
    scale_loads(self.description, wanted.loads, factor, full, acting.loads);
  };
  const Moving before = self;
  const Lagged lagged_before = self.systems.lagged();
  const MatrixX3 forces_before = self.custom_force, moments_before = self.custom_moments;
  EquilibriumPath out;
  ArcResult r;
  try {
    if (by_loads) {
      scaled(wanted.start, self.parameters);
      self.reaction_current = false;
      out.iterations += equilibrium().iterations;
    }
    const std::vector<SupportMotion> from = self.motions;
    std::vector<SupportMotion> target = from;
    for (SupportMotion& motion : target) motion.put(motion.pose_at(self.state.time));
    Equations& system = self.systems.statics();
    Prescribed& prescribed = self.prescribed;
    prescribed = {};
    self.custom().put_response_at_rest(self.state.time, prescribed);
    even_contact(self.parameters, system, Prescribed::nothing(), false, self.state);
    const Boundary boundary = boundary_between(self.model, self, system, from, target, prescribed);
    self.rest();
    const ActingPath acting =
        by_loads ? scaled : growing(system, self.parameters, prescribed, self.state, self.systems.work.newton, nullptr);
    Homotopy path(system, self.systems.newton(), self.parameters, boundary, acting, self.state,
                  self.systems.work.newton);
    if (!by_loads) path.start_out_of_balance();
    std::vector<SupportPose> poses;
    const ArcVisitor visit = [&](const ArcPoint& point) {
      find_poses_between(from, target, point.factor, poses);
      put(poses, self.motions);
      self.note_reactions();
      out.points.push_back(path_point(*this, self.model, point));
      if (point.stable && self.buckles_out_of_plane()) out.points.back().stable = false;
    };
    r = follow_arc(system, self.systems.newton(), self.options, path,
                   {wanted.start, wanted.end, wanted.most_points, wanted.turn}, self.state, self.systems.work.newton,
                   visit);
    find_poses_between(from, target, r.factor, poses);
    put(poses, self.motions);
    for (SupportMotion& m : self.motions) stop(m, self.state.time);
  } catch (...) {
    self.custom_force = forces_before;
    self.custom_moments = moments_before;
    static_cast<Moving&>(self) = before;
    self.parameters.loads = full;
    self.reaction_current = false;
    self.systems.recall(lagged_before);
    throw;
  }
  self.parameters.loads = full;
  scaled(r.factor, self.parameters);
  self.reaction_current = false;
  out.finished = r.finished;
  out.iterations += r.newton.iterations;
  self.release_left_rings();
  if (out.points.size() < 2 && !r.finished) self.fail(r.newton, 0.0, "no path of equilibria begins at this state");
  return out;
}

void World::Implementation::refresh_reactions() {
  if (reaction_current) return;
  Equations& system = systems.statics();
  const Prescribed still = custom().at_rest();
  system.begin(state, parameters, StepRule::statics, 0.0, still);
  system.evaluate(state.q, false, nullptr, systems.work.newton.data);
  system.find_joint_wrenches(systems.work.newton.data);
  note_reactions();
}

}  // namespace withe
