#include "integrators/options.hpp"

namespace withe {

EquationOptions equation_options(const Options& options) {
  const StepRule rule = [&] {
    switch (options.integrator) {
      case Integrator::statics:
        return StepRule::statics;
      case Integrator::backward_euler:
        return StepRule::backward_euler;
      case Integrator::implicit_midpoint:
        return StepRule::midpoint;
      case Integrator::verlet:
        return StepRule::verlet;
      default:
        return StepRule::energy_momentum;
    }
  }();
  return {.rule = rule, .static_duration = options.time_step, .solver = options.solver};
}

}  // namespace withe
