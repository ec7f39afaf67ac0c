#pragma once
/// What rounding leaves of a residual.

#include "steps/step_problem.hpp"

namespace withe {

/// Finds the bounds of a problem, at the configuration of `data`.
void set_rounding_bounds(const StepProblem& problem, StepData& data);

}  // namespace withe
