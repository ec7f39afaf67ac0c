#pragma once
/// Energy that backward Euler steps add where edges are under pressure.
///
/// The forces of a step are those at its end, so that it takes energy from all that is convex. An edge under pressure
/// is not: as it turns by an angle a it gives way by l0 (1 - cos a), over which its force -n at the end of the step
/// works more than the energy that the edge gives, by n l0 (1 - cos a).

#include "assembly/assembler.hpp"
#include "steps/step_problem.hpp"

namespace withe {

/// Growth of kinetic and elastic energy beyond the work of forces [J], per connected component, and scratch.
struct PressureGains {
  VectorX gains;
  VectorX taken;  ///< from the motion of what is free, |v1 - v0|^2 / 2
  VectorX change, momentum;
};

/// Finds the gains of a backward Euler step to the configuration of the data, with the velocities v1. Gains are zero
/// where the step takes energy. Overwrites the configuration at the end of `data`.
void find_pressure_gains(const StepProblem& problem, StepData& data, const Assembler& assembler, const VectorX& v1,
                         PressureGains& out);

}  // namespace withe
