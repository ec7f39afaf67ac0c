#pragma once
/// Energy that backward Euler steps add where edges are under compression.
///
/// A step uses the forces at its end, and therefore takes energy from every convex potential. The potential of an edge
/// under compression is not convex. If the edge turns by an angle a, it yields by l0 (1 - cos a). Over this length its
/// force -n at the end of the step does more work than the edge loses in energy, by n l0 (1 - cos a).

#include "assembly/assembler.hpp"
#include "steps/step_problem.hpp"

namespace withe {

/// Growth of kinetic and elastic energy beyond the work of forces [J], per connected component, and scratch.
struct PressureGains {
  VectorX gains;
  VectorX taken;  ///< |v1 - v0|^2 / 2 of free unknowns, the energy that the step removes
  VectorX change, momentum;
};

/// Finds the gains of a backward Euler step to the configuration of the data, with the velocities v1. A gain is zero if
/// the step takes energy. Overwrites the configuration at the end of `data`.
void find_pressure_gains(const StepProblem& problem, StepData& data, const Assembler& assembler, const VectorX& v1,
                         PressureGains& out);

}  // namespace withe
