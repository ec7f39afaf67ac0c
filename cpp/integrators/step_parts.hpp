#pragma once
/// Parts that implicit and explicit steps share: rotations of edges, and the energy that goes in and out.

#include "integrators/dynamics.hpp"

namespace withe {

/// Violation, over the length of the scene, of a constraint of a closed loop that others should imply, as far as the
/// loop leaves a dead centre in which it is drawn. Points of joints are drawn to 1e-9.
inline constexpr double kMaxLoopViolation = 1e-6;

/// True if closed loops of joints are open at z.
inline bool breaks_loops(const Equations& equations, const VectorX& z) {
  return equations.loops() && equations.loops()->greatest_violation(equations.problem(), z) >
                                  kMaxLoopViolation * equations.model().length_scale;
}

/// Adds the work of loads over the step, and the dissipation except that of contact, from the forces of the step.
void add_work(const Equations& equations, const Parameters& parameters, const VectorX& change, StepWorkspace& work,
              StepResult& result);

/// Held unknowns have prescribed motion, and act on the edges next to them by their acceleration (v1 - v0) / dt. The
/// work of supports is that of their forces over their motion, and of inertia: (v0 + v1) / 2 times M (v1 - v0) there.
/// Together with the other equations, the latter equals the change of the kinetic energy exactly. The function replaces
/// `work.assumed`, the inertia in the residual, by M (v1 - v0) / dt in the reactions. For the held part itself it
/// uses M (v1 - v0) / `held_time`, where `held_time` lies between those two velocities of supports.
void add_support_work(const Equations& equations, const VectorX& v0, const VectorX& v1, double dt, double held_time,
                      StepWorkspace& work, StepResult& result);

/// Advances an explicit step from a state to q: computes the configuration at q, and that of `next`. Returns the
/// largest rotation of an edge [rad].
double advance(const Model& model, const State& state, const VectorX& q, Configuration& configuration, State& next);

/// Finds the fluid's force at q for velocities v, and measures the computing time.
bool solve_flow(Equations& equations, const VectorX& q, const VectorX& v, Counters& counters);

}  // namespace withe
