#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "common/text.hpp"
#include "run/energy_watch.hpp"
#include "world/implementation.hpp"

namespace withe {
void World::Implementation::begin_setting() {
  if (!newly_set) before_settings.set(model, parameters);
  newly_set = true;
}

void World::Implementation::account_for_settings() {
  if (!newly_set) return;
  ledger.actuation_work += change_by_settings(model, before_settings, parameters, state, energy_scratch);
  std::swap(before_settings, energy_scratch.coefficients);  // those of now, for what is set next
  newly_set = false;
}

Energy World::Implementation::energy() const {
  Ledger present = ledger;
  if (newly_set)
    present.actuation_work += change_by_settings(model, before_settings, parameters, state, energy_scratch);
  return energy_of(model, parameters, systems.scheme().contact(), state, present, energy_scratch);
}

const Configuration& World::Implementation::configuration() const {
  compute_configuration(model, state, state.q, energy_scratch.configuration);
  return energy_scratch.configuration;
}

/// Refuses an explicit step that the drawing allowed, but not what has come since: forces that press surfaces, other
/// material.
void World::Implementation::begin_energy_watch() {
  const bool is_explicit = options.integrator == Integrator::verlet;
  if (!is_explicit && options.integrator != Integrator::implicit_midpoint) return;
  const std::string longest = is_explicit ? longest_explicit_step() : "";
  if (!longest.empty()) fail(NewtonResult{}, options.time_step, "the explicit scheme is not stable here" + longest);
  first_energy = energy();
  greatest_kinetic = first_energy->kinetic;
}

void World::Implementation::check_energy() {
  if (options.integrator == Integrator::verlet) check_explicit();
  if (options.integrator != Integrator::implicit_midpoint || !first_energy || warnings.has_reported(Warning::drift))
    return;
  const Energy now = energy();
  greatest_kinetic = std::max(greatest_kinetic, now.kinetic);
  warnings.report(Warning::drift,
                  energy_drift(*first_energy, now, greatest_kinetic, model.dof_count, state.time, options.time_step));
}

/// Advice where the time step is above the stable one at the present state; else empty.
std::string World::Implementation::longest_explicit_step() {
  const double stable = stable_step(systems.scheme(), parameters, custom().at_rest(), state, systems.work);
  if (!(options.time_step > stable)) return "";
  const bool slips = systems.scheme().contact() && systems.scheme().contact()->regularises();
  return ": take a time_step below " + text(stable) + " s" +
         (slips ? ", or a greater slip_tolerance, which allows longer ones under friction" : "");
}

void World::Implementation::check_explicit() {
  const Energy now = energy();
  if (!gains_energy(*first_energy, now, model.dof_count)) return;
  const std::string longest = std::isfinite(now.total) ? longest_explicit_step() : "";
  fail(NewtonResult{}, options.time_step, "the explicit scheme gains energy" + longest);
}

}  // namespace withe
