#pragma once
/// The inner configuration of an implicit step, from one initial guess after the other.

#include "integrators/dynamics.hpp"

namespace withe {

/// Finds it, `work.z`, over an interval h: from the extrapolated motion first; where that is too far off, from a steady
/// one, or from rest, whose first iteration is the linear step.
NewtonResult solve_inner(Equations& equations, const Newton& newton, const Options& options, const StepPlan& plan,
                         double h, const State& state, const Predictor& predictor, StepWorkspace& work);

}  // namespace withe
