#pragma once
/// Parts that implicit and explicit steps share: rotations of edges, and the energy that goes in and out.

#include "integrators/dynamics.hpp"

namespace withe {

/// Work of loads, and what all but contact takes from the motion, over the step, with the forces that acted in it.
void add_work(const Equations& equations, const Parameters& parameters, const VectorX& change, StepWorkspace& work,
              StepResult& result);

/// Held unknowns move as they are told, and so act on the edges next to them by their acceleration, (v1 - v0) / dt.
/// The supports' work is that of the forces on what they hold, over its way, and
/// (v0 + v1) / 2 times M (v1 - v0) there: the latter, with what the others' equations say of theirs, is exactly what
/// the kinetic energy grows by. Puts M (v1 - v0) / dt into the reactions in place of `work.assumed`, the inertia in the
/// residual; of what is held itself, M (v1 - v0) / `held_time`, which lies between those two velocities of supports.
void add_support_work(const Equations& equations, const VectorX& v0, const VectorX& v1, double dt, double held_time,
                      StepWorkspace& work, StepResult& result);

/// Advance of an explicit step from a state to q: the configuration there, and that of `next`. Returns by how much
/// edges turn at most [rad].
double advance(const Model& model, const State& state, const VectorX& q, Configuration& configuration, State& next);

/// Finds the fluid's force at q on velocities v, and the time that takes.
bool solve_flow(Equations& equations, const VectorX& q, const VectorX& v, Counters& counters);

}  // namespace withe
