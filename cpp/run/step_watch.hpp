#pragma once
/// Checks that steps are short enough for the motion.
///
/// A mode of frequency w goes on by an angle 2 p in each midpoint step, tan p = w dt / 2. Its velocity, A cos(2 p k) at
/// the ends of steps, changes within them by 2 A sin p as it swings, and by its energy it has
///   |v1 - v0|^2 / (2 |v0|^2 + 2 |v1|^2) = sin^2 p = (w dt / 2)^2 / (1 + (w dt / 2)^2),
/// both summed over steps. Modes are orthogonal in mass.
///
/// So for a motion of many modes the ratio, with squares weighed by mass, is the mean of sin^2 p over the energy in
/// motion. It is 0 where steps are short, and 1 where velocities only change their sign from step to step. Stiff modes
/// without energy do not count. The ratio exceeds 1/5 only where some of the energy swings with w dt > 1.
///
/// Under backward Euler amplitudes fall by (1 + (w dt)^2)^(-1/2) a step, too fast for a mean over phases. There
/// a1 - a0 = -w^2 dt v1 in every mode and at every phase, so that -dt v1 . (a1 - a0) / |v1|^2 is the mean of (w dt)^2.
/// It only counts where velocities change much, |v1 - v0|^2 > |v1|^2 / 2, because stiff modes amplify rounding errors.

#include <cstdint>
#include <string>
#include <vector>

#include "run/running.hpp"
#include "run/warnings.hpp"
#include "steps/equations.hpp"

namespace withe {

/// A step that was solved, before it counts.
struct SolvedStep {
  const Model& model;
  const Options& options;
  const Parameters& parameters;
  const State& state;  ///< at its end
  const Equations& system;
  double dt;            ///< [s]
  std::int64_t number;  ///< steps before it
};

/// Takes a step into the watch, and warns of steps that are too long. Components that touch something are not judged:
/// contact has times of its own, which steps need not resolve.
void watch_step(const SolvedStep& step, StepWatch& watch, Warnings& warnings, EnergyScratch& scratch);

/// Notes on the vibrations that steps resolve, of the slowest rod. Each rod is taken alone, clamped at one end and free
/// of stress. Its frequencies are w = b^2 sqrt(B / m) / L^2 [Euler and Bernoulli]; b is 1.875 for the first mode and
/// about (n - 1/2) pi for the nth.
std::vector<std::string> step_notes(const Model& model, const Options& options, const Parameters& parameters);

}  // namespace withe
