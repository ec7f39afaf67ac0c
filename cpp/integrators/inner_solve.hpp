#pragma once
/// Solution of an implicit step's equations, from one initial guess after the other.

#include "integrators/dynamics.hpp"

namespace withe {

/// Finds the inner configuration `work.z` over an interval h [s]. The extrapolated motion is the first guess, rest the
/// second one: its first iteration is the linear step.
NewtonResult solve_inner(Equations& equations, const Newton& newton, const Options& options, const StepPlan& plan,
                         double h, const State& state, const Predictor& predictor, StepWorkspace& work);

}  // namespace withe
