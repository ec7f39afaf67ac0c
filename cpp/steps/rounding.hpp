#pragma once
/// Rounding error bounds of a residual.

#include <limits>

#include "steps/step_problem.hpp"

namespace withe {

/// Relative rounding error of a number after some operations.
inline constexpr double kRounding = 4.0 * std::numeric_limits<double>::epsilon();

/// Finds the bounds of a problem, at the configuration of `data`.
void set_rounding_bounds(const StepProblem& problem, StepData& data);

}  // namespace withe
