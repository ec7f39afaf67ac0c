#pragma once
/// Energy that backward Euler steps add where edges are under compression.
///
/// The forces of a step are those at its end, so a step takes energy from every convex potential. The potential of an
/// edge under compression is not convex. As the edge turns by an angle a it yields by l0 (1 - cos a). Over this length
/// its force -n at the end of the step does n l0 (1 - cos a) more work than the edge loses energy.

#include "assembly/assembler.hpp"
#include "steps/step_problem.hpp"

namespace withe {

/// Growth of kinetic and elastic energy beyond the work of forces [J], per connected component, and scratch.
struct PressureGains {
  VectorX gains;
  VectorX taken;  ///< |v1 - v0|^2 / 2 of free unknowns, the energy that the step removes
  VectorX change, momentum;
};

/// Finds the gains of a backward Euler step to the configuration of the data, with the velocities v1. Gains are zero
/// where the step takes energy. Overwrites the configuration at the end of `data`.
void find_pressure_gains(const StepProblem& problem, StepData& data, const Assembler& assembler, const VectorX& v1,
                         PressureGains& out);

}  // namespace withe
