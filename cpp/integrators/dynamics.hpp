#pragma once
/// One time step: backward Euler, implicit midpoint, energy-momentum, and Verlet.

#include <memory>
#include <optional>

#include "integrators/fourth_order.hpp"
#include "integrators/newton.hpp"
#include "integrators/predictor.hpp"
#include "integrators/rebounds.hpp"
#include "integrators/squeezed.hpp"
#include "steps/pressure_gains.hpp"

namespace withe {

/// One implicit step: its rule and its length.
struct StepPlan {
  StepRule rule = StepRule::midpoint;
  double dt = 0;                ///< [s]
  int slot = 0;                 ///< index of a part of a composition
  bool composed = false;        ///< true if it is a part of a fourth-order step
  bool compares_order = false;  ///< true if the error of the other order, second or fourth, is estimated too
};

/// Estimated local errors of a step [m].
struct StepErrors {
  double own = 0;
  /// Error of a step of the other order and of the same length, where it was estimated.
  std::optional<double> other;
};

/// Amplitude of the motion above the frequency at which the filter of errors cuts off [m]. A step's estimated error of
/// such motion is 2 a dt / duration, from amplitude a.
inline double unresolved_amplitude(const Options& options, double error, double dt) {
  return 0.5 * error * options.duration.value_or(1.0) / dt;
}

struct StepResult {
  bool accepted = false;
  bool too_deep = false;  ///< surfaces are too deep in each other: contact must be stiffer
  Squeezed squeezed;      ///< contact between parts that cannot yield
  NewtonResult newton;
  double largest_turn = 0;  ///< largest rotation of an edge [rad]
  StepErrors errors;
  double load_work = 0;      ///< work of loads and custom forces [J]
  double dissipated = 0;     ///< energy removed by drag, viscosity and contact [J]
  double support_work = 0;   ///< [J]
  double rebound_gain = 0;   ///< see ReboundWork
  double pressing_gain = 0;  ///< put in by surfaces that press, `Contact::pressing_gain` [J]
};

/// Scratch of a step; owned by the world, so that a step does not allocate.
struct StepWorkspace {
  NewtonWorkspace newton;
  double follow_gain = 0;  ///< kinetic energy that nodes of held bodies get from the velocities of supports [J]
  VectorX z, move, change, working, mean, velocity, held_velocity, held_acceleration, assumed, difference,
      whole_acceleration, third_derivative;
  VectorX formula_velocity;  ///< at the end of a step with bodies, before supports replace the velocities they hold
  Rebounds rebounds;
  std::unique_ptr<MassSystem> mass_system;  ///< null until it is needed
  PressureGains pressure;                   ///< energy gains of a backward Euler step under `adaptive`
  Configuration after;
  State from, next;  ///< explicit steps

  MassSystem& masses(const Model& model) {
    if (!mass_system) mass_system = std::make_unique<MassSystem>(model);
    return *mass_system;
  }
};

/// Advances `state`, or leaves it as it was when the step is not accepted.
StepResult implicit_step(Equations& equations, const Newton& newton, const Options& options,
                         const Parameters& parameters, const Prescribed& prescribed, const StepPlan& plan, State& state,
                         Predictor& predictor, StepWorkspace& work);

/// Velocities in the middle of a step, to second order: the mean velocities of the last two steps, extrapolated to
/// `time` [s]. Velocities at the ends of steps would not do, because modes that the midpoint rule does not resolve
/// oscillate in them. Returns `state.v` without past steps.
void extrapolate_velocity(const State& state, double time, VectorX& v);

/// Finds the acceleration at the state if it is unknown, with the present loads and custom forces.
void find_acceleration(Equations& equations, const Parameters& parameters, const Prescribed& prescribed, double dt,
                       State& state, StepWorkspace& work);

/// Finds the acceleration at the state if it is unknown, and the result of an explicit step: positions in `work.z`,
/// velocities (predicted ones, to second order) in `work.velocity`.
void begin_verlet(Equations& equations, const Parameters& parameters, const Prescribed& prescribed, double dt,
                  State& state, StepWorkspace& work);

/// Velocity Verlet; velocity-dependent forces are taken at the half step.
StepResult verlet_step(Equations& equations, const Parameters& parameters, const Prescribed& prescribed, double dt,
                       State& state, StepWorkspace& work);

/// Largest stable step of the explicit scheme at a state. A mode of frequency omega that resistance damps at the rate
/// gamma is stable while (omega dt)^2 / 4 + gamma dt <= 1, because resistance acts on Verlet's predicted velocity. The
/// result is the dt for which the greatest eigenvalue of M^-1 (K + 4 C / dt) is 4 / dt^2. The resistance C comes from
/// friction, drag and viscosity.
double stable_step(Equations& equations, const Parameters& parameters, const Prescribed& prescribed, const State& state,
                   StepWorkspace& work);

/// True if the mean velocity of held nodes, which has changed by `gain` since the last step, continues smoothly. Else
/// it jumps. From rest at a constant acceleration, the gain of the second step is 2/3 of its velocity.
inline bool carries_on(const Vector3& now, const Vector3& gain) { return gain.norm() <= 0.75 * now.norm(); }

}  // namespace withe
