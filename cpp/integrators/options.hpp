#pragma once
/// Choices of a simulation that a user may make; every default is meant to be left alone.

#include <optional>

#include "integrators/heuristics.hpp"
#include "steps/equations.hpp"

namespace withe {

enum class Integrator { statics, backward_euler, implicit_midpoint, energy_momentum, fourth_order, verlet };

/// Choice of the static solver at an equilibrium that is not stable: leave it for a stable one, or return it.
enum class Saddles { leave, keep };

struct Options {
  Integrator integrator = Integrator::energy_momentum;
  double time_step = 5e-3;          ///< [s]
  bool adaptive = true;             ///< halve on failure, grow back
  std::optional<double> tolerance;  ///< [m], error-controlled steps
  std::optional<double> duration;   ///< [s], over which `tolerance` holds; else 1 s
  std::optional<bool> planar;       ///< nothing: decide
  SolverKind solver = SolverKind::automatic;
  bool mixed = true;              ///< Newton with the axial force as its own unknown
  double step_tolerance = 1e-9;   ///< Newton step, relative to the length of the scene
  double force_tolerance = 1e-8;  ///< residual, relative to the forces in the scene
  int max_iterations = 40;        ///< per Newton solve
  std::optional<long> max_steps;  ///< inner steps in one time step under `tolerance`; empty: see `kMaxWork`
  int max_halvings = 12;          ///< smallest step is time_step / 2^max_halvings
  int threads = 1;                ///< threads that share the work of a step
  Without heuristics;             ///< heuristics that measurements switch off
};

/// True for rules that conserve energy or gain it as the midpoint rule does, with forces in the middle of each step.
inline bool acts_in_middle(Integrator integrator) {
  return integrator == Integrator::implicit_midpoint || integrator == Integrator::energy_momentum ||
         integrator == Integrator::fourth_order;
}

/// Time at which loads and actuation act in a step of dt from `start` [s]: its middle, or its end.
inline double force_time(const Options& options, double start, double dt) {
  return start + (acts_in_middle(options.integrator) ? 0.5 : 1.0) * dt;
}

/// The form of the equations that an integrator solves.
EquationOptions equation_options(const Options& options);

}  // namespace withe
