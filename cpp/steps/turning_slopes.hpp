#pragma once
/// Derivatives of the inertia of an edge about itself (turning_inertia.hpp) by the edge and by the start of a step.

#include "common/types.hpp"
#include "steps/step_problem.hpp"

namespace withe {

/// An edge in a step over `duration`: the variables by which derivatives are taken.
struct TurningStep {
  StepRule rule;
  double duration;      ///< [s]
  double inertia;       ///< moment of inertia about the edge [kg m^2]
  Vec3d edge, start;    ///< its vector at z, and at the start [m]
  double change, rate;  ///< change of its angle from the start to z, and its rate at the start
};

void set_turning_slopes(const TurningStep& step, TurningSlopes& out);

}  // namespace withe
