#include "run/energy_watch.hpp"

#include <algorithm>
#include <cmath>

#include "common/text.hpp"

namespace withe {
namespace {

/// Share of the greatest kinetic energy by which the energy of midpoint steps may drift before a warning.
constexpr double kMaxDrift = 1e-2;
/// Share of a component's kinetic and elastic energy that a backward Euler step may add.
constexpr double kMaxPressureGain = 1e-4;

}  // namespace

bool gains_under_pressure(const Model& model, const Parameters& parameters, const State& state, const VectorX& gains,
                          EnergyScratch& scratch) {
  if ((gains.array() <= 0.0).all()) return false;
  find_component_energies(model, parameters, state, scratch);
  const ComponentEnergies& now = scratch.components;
  return (gains.array() > kMaxPressureGain * (now.kinetic + now.elastic).array()).any();
}

bool contact_pumps(const Model& model, const Parameters& parameters, const Contact& contact, const Moving& start,
                   const Moving& end, double dt, double time_step, ContactGuard& guard, EnergyScratch& scratch) {
  constexpr double kMaxExcess = 3e-3,
                   kRoomPerStep = 2e-5;   // of the greatest energy of what touches; that a time step makes
  constexpr double kRoomOfLosses = 0.01;  // of what is lost within a step
  auto& [scale, excess, put_in] = guard;
  double gain = put_in;
  const double lost = std::max(end.ledger.dissipated - start.ledger.dissipated, 0.0);
  const auto room = [&] { return kRoomPerStep * scale * dt / time_step + kRoomOfLosses * lost; };
  const auto too_much = [&] { return gain > room() + 0.5 * std::max(kMaxExcess * scale - excess, 0.0); };
  if (too_much()) {
    // Losses of other parts make up for the gain. Losses by drag, viscosity and friction do not.
    const Energy now = energy_of(model, parameters, &contact, end.state, end.ledger, scratch);
    const Energy then = energy_of(model, parameters, &contact, start.state, start.ledger, scratch);
    gain = put_in + balance_of(now) - balance_of(then);
    const auto touching = [&](const Moving& at) {
      return touching_energy(model, parameters, contact, at.state, scratch);
    };
    scale = std::max({scale, touching(end) + now.contact, touching(start) + then.contact});
    if (too_much()) return true;
  }
  excess = std::max(excess + gain - room(), 0.0);
  return false;
}

bool gains_energy(const Energy& first, const Energy& now, int unknowns) {
  const double gain = balance_of(now) - balance_of(first);
  const double scale =
      std::max({first.kinetic, std::abs(now.gravity - first.gravity), std::abs(now.loads - first.loads),
                std::abs(now.work - first.work), first.elastic(), 1e-300});
  return !std::isfinite(now.total) || gain > 0.5 * scale + rounding_of(now, unknowns);
}

std::string energy_drift(const Energy& first, const Energy& now, double greatest_kinetic, int unknowns, double time,
                         double time_step) {
  const double drift = balance_of(now) - balance_of(first);
  if (std::abs(drift) <= kMaxDrift * greatest_kinetic + rounding_of(now, unknowns)) return "";
  return "integrator='implicit_midpoint' has " + std::string(drift > 0.0 ? "added " : "lost ") +
         text(std::abs(drift), 2) + " J, " + text(100.0 * std::abs(drift) / greatest_kinetic, 2) +
         " % of the greatest kinetic energy (time " + text(time, 6) + " s, time_step " + text(time_step) +
         " s). Use integrator='energy_momentum', which conserves energy at any time_step, or a shorter one.";
}

}  // namespace withe
