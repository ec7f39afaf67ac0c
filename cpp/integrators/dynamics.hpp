#pragma once
/// One time step: backward Euler, implicit midpoint, energy-momentum, and Verlet.

#include "integrators/newton.hpp"

namespace withe {

/// Where supports put the held unknowns at the end of a step.
struct HeldTarget {
  VectorX q;  ///< end of step; meaningful where `held` is set
  bool moving = false;
  bool reachable = true;  ///< false: a frame would have to turn by half a turn at once
};

struct StepResult {
  bool accepted = false;
  NewtonResult newton;
  VectorX change;           ///< q1 - q0
  double largest_turn = 0;  ///< of an edge [rad]
  double error = 0;         ///< estimated local error [m]
  double load_work = 0;     ///< of loads and custom forces [J]
  double dissipated = 0;    ///< by drag and viscosity [J]
  double support_work = 0;  ///< [J]
};

/// Advances `state` by dt, or leaves it as it was when the step is not accepted.
StepResult implicit_step(Equations& equations, const Newton& newton, const Options& options,
                         const Parameters& parameters, double dt, const HeldTarget& held, State& state,
                         NewtonWorkspace& work);

/// Velocity Verlet; velocity-dependent forces are taken at the half step.
StepResult verlet_step(Equations& equations, const Parameters& parameters, double dt, const HeldTarget& held,
                       State& state, NewtonWorkspace& work);

/// Largest stable step of the explicit scheme, 2 / omega_max of the linearised equations, by power iteration.
double stable_step(Equations& equations, const Parameters& parameters, const State& state, NewtonWorkspace& work);

}  // namespace withe
