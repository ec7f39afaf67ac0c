#include <algorithm>

#include "geometry/rotation.hpp"
#include "world/implementation.hpp"

namespace withe {

Equations& World::Implementation::statics() {
  const bool same = options.integrator != Integrator::energy_momentum &&
                    (description.fluid.model != FluidModel::resistive || options.integrator == Integrator::statics);
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

namespace {

/// A place between two of a support, or beyond.
void put_between(const SupportMotion& from, const SupportMotion& to, double fraction, SupportMotion& out) {
  out.position = from.position + fraction * (to.position - from.position);
  out.rotation = rotation_exp(fraction * rotation_log(to.rotation * from.rotation.transpose())) * from.rotation;
}

}  // namespace

/// Equilibrium after `dt` (0: at the present time, with supports and actuation as they are).
EquilibriumResult World::Implementation::equilibrium(double dt) {
  const State before = state;
  const std::vector<SupportMotion> motions_before = motions;
  const double time = state.time + dt, work_before = actuation_work;
  if (actuated()) {
    actuation_work -= actuation_energy();
    apply_ramps(time);
    actuation_work += actuation_energy();
  }
  aim_supports(time);
  Equations& system = statics();
  update_custom_force(system);
  const auto undo = [&] {
    release_obstacles(system);
    state = before;
    motions = motions_before;
    actuation_work = work_before;
    apply_ramps(state.time);
    system.loads().values = load_values;
  };
  std::vector<SupportMotion> from = motions_before;
  const std::vector<SupportMotion> target = motions;
  const Boundary boundary = [&](double fraction, VectorX& q) {
    for (std::size_t s = 0; s < motions.size(); ++s) put_between(from[s], target[s], fraction, motions[s]);
    hold_now(work.held);
    system.assembler().add_held_change(q, work.held.q, 1.0, q);
    motions = target;
    return work.held.reachable;
  };
  state.v.setZero();
  state.acceleration.setZero();
  state.acceleration_current = false;
  state.motion.known = 0;
  predictor.clear();
  forget_matrix();
  work.newton.finest = INFINITY;
  StaticResult r;
  try {
    aim_obstacles(system, time);
    r = find_equilibrium(system, *newton, options, parameters, boundary, state, work.newton);
    // Contact that turns out too soft is made stiffer, from where it has settled.
    from = target;
    for (int tries = 0; r.converged && system.contact() && system.contact()->depth() > kDeepest && tries < 8; ++tries) {
      system.contact()->stiffen(state);
      const bool changed = r.branch_changed;
      r = find_equilibrium(system, *newton, options, parameters, boundary, state, work.newton);
      r.branch_changed = r.branch_changed || changed;
    }
  } catch (...) {
    undo();
    throw;
  }
  release_obstacles(system);
  if (!r.converged) {
    undo();
    const bool held =
        std::any_of(model.supports.begin(), model.supports.end(), [](const Support& s) { return s.active; });
    fail(
        r.newton, dt,
        held ? "no static equilibrium was found"
             : "no static equilibrium was found, and no support holds the scene: clamp or pin a node",
        dt > 0.0 ? "" : "Try to get there in parts: small changes of loads and supports, or time steps with viscosity");
  }
  state.time = time;
  retire_ramps();
  statistics.steps += 1;
  system.begin(state, parameters, 0.0, false);
  system.evaluate(state.q, false, nullptr, work.newton.evaluation);
  reaction_residual = work.newton.evaluation.full_residual;
  reaction_current = true;
  newton->balance(work.newton.evaluation, r.newton);
  check_resolution();
  if (r.branch_changed) statistics.branch_changes += 1;
  const bool frictional = system.contact() && system.contact()->frictional();
  return {r.stable, !system.loads().unsymmetric || frictional, r.branch_changed, r.newton.iterations,
          r.newton.residual};
}

void World::Implementation::refresh_reactions() {
  if (reaction_current) return;
  Equations& system = statics();
  update_custom_force(system);
  system.begin(state, parameters, 0.0, false);
  system.evaluate(state.q, false, nullptr, work.newton.evaluation);
  reaction_residual = work.newton.evaluation.full_residual;
  reaction_current = true;
}

}  // namespace withe
