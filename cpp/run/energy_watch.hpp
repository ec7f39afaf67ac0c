#pragma once
/// Verdicts on steps by the energy that they add.

#include <string>

#include "integrators/options.hpp"
#include "run/running.hpp"

namespace withe {

/// True if a backward Euler step that ends in `state` added too much to a component, compared with the energy that the
/// component has now. `gains`: energy that surfaces under pressure added, per component [J].
bool gains_under_pressure(const Model& model, const Parameters& parameters, const State& state, const VectorX& gains,
                          EnergyScratch& scratch);

/// Surfaces that slide far along each other's edges within a step are pushed by the forces at its end, which may do
/// more work than the forces on the way would have done. True if a step from `start` to `end` gained more by that than
/// half of what is left of a share of the greatest energy. Losses make room for gains. So do time, the part `dt` of a
/// time step, and a little of what friction and drag take. The verdict is noted in `guard` unless it is true.
bool contact_pumps(const Model& model, const Parameters& parameters, const Contact& contact, const Moving& start,
                   const Moving& end, double dt, double time_step, ContactGuard& guard, EnergyScratch& scratch);

/// True if explicit steps have added energy since `first`. An explicit scheme that is about to blow up gains energy
/// long before it shows as NaN.
bool gains_energy(const Energy& first, const Energy& now, int unknowns);

/// Warning that the energy has changed since `first` by more than a share of the greatest kinetic energy; empty where
/// it has not. Midpoint steps conserve energy to second order only, and that of stretching not at all where edges turn
/// far within a step [Simo, Tarnow and Doblare 1995].
std::string energy_drift(const Energy& first, const Energy& now, double greatest_kinetic, int unknowns, double time,
                         double time_step);

}  // namespace withe
