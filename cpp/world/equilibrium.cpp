#include <algorithm>

#include "common/check.hpp"
#include "common/text.hpp"
#include "common/timer.hpp"
#include "geometry/rotation.hpp"
#include "integrators/arc_length.hpp"
#include "integrators/stiffness_signs.hpp"
#include "run/drive.hpp"
#include "run/hold.hpp"
#include "run/transfer.hpp"
#include "world/implementation.hpp"

namespace withe {
namespace {

// Times that an equilibrium is sought anew as contact becomes stiffer.
constexpr int kMostStiffenings = 8;
// Over what forces wanted of stiffness, what they may want where stiffer contact relieves surfaces.
constexpr double kRelieved = 0.9;

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

namespace {

// A frame may turn by so much from the present state to the next on a path [rad]: rotations do not tell more than half
// a turn from less.
constexpr double kMostTurn = 2.5;

/// Rotation vector of the turn of a support from one place to another that is left beside its roll.
Vector3 swing_between(const SupportMotion& from, const SupportMotion& to) {
  return rotation_log(to.rotation * rotation_exp(-to.roll) * from.rotation.transpose());
}

/// Places between two of each support, or beyond. A rotation is exp(s swing) R exp(s roll).
void find_poses_between(const std::vector<SupportMotion>& from, const std::vector<SupportMotion>& to, double fraction,
                        std::vector<SupportPose>& out) {
  out.resize(to.size());
  for (std::size_t s = 0; s < to.size(); ++s) {
    out[s].position = from[s].position + fraction * (to[s].position - from[s].position);
    out[s].fed = from[s].fed + fraction * (to[s].fed - from[s].fed);
    out[s].rotation =
        rotation_exp(fraction * swing_between(from[s], to[s])) * from[s].rotation * rotation_exp(fraction * to[s].roll);
  }
}

/// True if a hand that yields moves.
bool hands_move(const Model& model, const std::vector<SupportMotion>& from, const std::vector<SupportMotion>& to) {
  for (std::size_t s = 0; s < to.size(); ++s)
    if (model.supports[s].active && model.supports[s].yields() &&
        (from[s].position != to[s].position || from[s].rotation != to[s].rotation || to[s].roll != Vector3::Zero() ||
         from[s].fed != to[s].fed))
      return true;
  return false;
}

void put(const std::vector<SupportPose>& poses, std::vector<SupportMotion>& motions) {
  for (std::size_t s = 0; s < motions.size(); ++s) motions[s].put(poses[s]);
}

}  // namespace

Boundary World::Implementation::boundary_between(Equations& system, const std::vector<SupportMotion>& from,
                                                 const std::vector<SupportMotion>& to, Prescribed& out) const {
  Boundary boundary{.prescribed = out};
  boundary.hold = [this, &system, &from, &to, poses = std::vector<SupportPose>{}, there = HeldTarget{}](
                      double present, double factor, VectorX& q) mutable {
    find_poses_between(from, to, factor, poses);
    hold(model, *this, poses, there);
    for (std::size_t s = 0; s < to.size(); ++s) {
      const double turn = to[s].roll.norm() + swing_between(from[s], to[s]).norm();
      if (to[s].roll != Vector3::Zero() && std::abs(factor - present) * turn > kMostTurn) there.reachable = false;
    }
    system.assembler().add_held_change(q, there.q, 1.0, q);
    return there.reachable;
  };
  if (hands_move(model, from, to))
    boundary.move = [&from, &to, &out](double factor) { find_poses_between(from, to, factor, out.supports); };
  return boundary;
}

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

/// True if nothing resists a translation along which forces do not sum to zero: no way off leads to equilibrium then.
/// Surfaces, and custom forces with a Jacobian, may resist elsewhere.
bool World::Implementation::drifts(Equations& system, const Prescribed& given) {
  if (system.contact() || description.custom_implicit) return false;
  for (const Support& s : model.supports)
    if (s.active) return false;
  system.begin(state, parameters, StepRule::statics, 0.0, given);
  StepData& e = systems.work.newton.data;
  system.evaluate(state.q, true, nullptr, e);
  if (!e.residual.allFinite()) return false;
  constexpr double kBalanced = 1e-6, kNeutral = 1e-12;  // over all forces there are; over the greatest stiffness
  VectorX along(model.dof_count), pull(model.dof_count);
  for (int axis = 0; axis < model.dimension; ++axis) {
    along.setZero();
    for (int dof : model.node_dof) along[dof + axis] = 1.0;
    const double force = along.dot(e.residual), scale = along.dot(e.magnitude);
    if (std::abs(force) <= kBalanced * scale) continue;
    const auto size = static_cast<std::size_t>(model.dof_count);
    system.assembler().solver().multiply({along.data(), size}, {pull.data(), size});
    if (pull.cwiseAbs().maxCoeff() <= kNeutral * system.assembler().greatest_diagonal()) return true;
  }
  return false;
}

/// Has what touches press as what is yet to touch will, and, once arrived at an equilibrium, as hard as it has to
/// without being deep; see `ContactStiffness`. Whether that is as it did.
bool World::Implementation::even_contact(Equations& system, const Prescribed& given, bool arrived) {
  if (!system.contact()) return true;
  system.begin(state, parameters, StepRule::statics, 0.0, given);
  system.contact()->update(state.q);
  system.contact()->accept_at_rest(state, arrived);
  return system.contact()->presses_alike();
}

/// Where contact turns out too soft in an equilibrium, and is made stiffer, balance is sought anew from where the scene
/// has settled; and where contact is far too stiff for its forces, or surfaces are deeper in each other than forces
/// want them, if it makes them less so: not where what presses them does not yield.
void World::Implementation::settle_contact(Equations& system, const Boundary& boundary, Saddles saddles,
                                           StaticResult& r) {
  Contact& contact = *system.contact();
  const auto again = [&] {
    const StaticResult before = r;
    r = find_equilibrium(system, systems.newton(), options, parameters, nullptr, boundary, saddles, state,
                         systems.work.newton);
    r.branch_changed = r.branch_changed || before.branch_changed;
    r.newton.iterations += before.newton.iterations;
  };
  int tries = 0;
  for (; r.converged && tries < kMostStiffenings; ++tries) {
    if (contact.contacts().depth() > kMaxDepth)
      contact.stiffen(state, true);
    else if (contact.presses_alike())
      break;
    again();
  }
  for (; r.converged && tries < kMostStiffenings; ++tries) {
    const State reached = state;
    const StaticResult found = r;
    const double wanted = contact.wanted_ratio();
    if (even_contact(system, boundary.prescribed, true)) return;
    again();
    if (r.converged && (wanted == 1.0 || contact.wanted_ratio() < kRelieved * wanted)) continue;
    state = reached;
    r = found;
    return;
  }
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
    ledger.actuation_work += apply_ramps(model, ramps, time, configuration(), parameters, energy_scratch);
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
  const Boundary boundary = boundary_between(system, from, target, prescribed);
  rest();
  StaticResult r;
  try {
    even_contact(system, Prescribed::nothing(), false);
    prescribe_custom_at_rest(time, prescribed);
    VectorX reached = state.q;
    if (boundary.hold(0.0, 1.0, reached)) check_squeezed(system, prescribed, reached, dt);
    if (drifts(system, prescribed)) {
      systems.newton().balance(systems.work.newton.data, r.newton);
      r.newton.worst_row = systems.newton().worst_row(systems.work.newton.data.residual);
    } else {
      r = find_equilibrium(system, systems.newton(), options, parameters,
                           actuation_changed ? &actuation_before : nullptr, boundary, saddles, state,
                           systems.work.newton);
    }
    for (SupportMotion& m : target) m.roll.setZero();
    from = target;
    if (r.converged && system.contact()) settle_contact(system, boundary, saddles, r);
  } catch (...) {
    undo();
    throw;
  }
  motions = target;
  if (const HandForces* hands = system.hands(); hands && r.converged)
    hands->accept(prescribed.supports, configuration(), state);
  if (!r.converged) {
    undo();
    fail_equilibrium(r, dt);
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

/// Says that none was found.
void World::Implementation::fail_equilibrium(const StaticResult& result, double dt) const {
  const bool held =
      std::any_of(model.supports.begin(), model.supports.end(), [](const Support& s) { return s.active; });
  const bool lies = !description.contact.obstacles.empty(), pulled = description.custom_implicit;
  fail(result.newton, dt,
       std::string("no static equilibrium was found") +
           (!held && lies     ? ", and only contact holds the scene, with friction that may be too low: clamp "
                                "or pin a node"
            : !held && pulled ? ", and only custom forces hold the scene: clamp or pin a node, unless the "
                                "custom forces are meant to hold the scene"
            : !held           ? ", and no support holds the scene: clamp or pin a node"
            : result.restless ? ": the scene does not come to rest; loads without a potential, such as moments "
                                "and follower forces, may drive the scene for ever"
                              : ""),
       dt > 0.0 ? ""
                : "Try smaller changes of loads and supports, one after the other, or time steps "
                  "with viscosity");
}

/// The scene is in the equilibrium that was found, at a time.
EquilibriumResult World::Implementation::settle(Equations& system, StaticResult& r, double time) {
  state.time = time;
  retire_ramps();
  statistics.steps += 1;
  steps_taken += 1;
  const Prescribed still = at_rest();
  system.begin(state, parameters, StepRule::statics, 0.0, still);
  system.evaluate(state.q, false, nullptr, systems.work.newton.data);
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

/// A support stays where it is.
void stop(SupportMotion& motion, double time) {
  motion.from_position = motion.to_position = motion.position;
  motion.from_rotation = motion.to_rotation = motion.rotation;
  motion.roll.setZero();
  motion.shift = motion.turn = {time, time};
  motion.fed_before = motion.fed;
  motion.feeds_since = time;
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
    self.prescribe_custom_at_rest(self.state.time, prescribed);
    self.even_contact(system, Prescribed::nothing(), false);
    const Boundary boundary = self.boundary_between(system, from, target, prescribed);
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
  const Prescribed still = at_rest();
  system.begin(state, parameters, StepRule::statics, 0.0, still);
  system.evaluate(state.q, false, nullptr, systems.work.newton.data);
  note_reactions();
}

}  // namespace withe
