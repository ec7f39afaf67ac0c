#pragma once
/// Setup of the benchmarks in C++: a scene and the equations of one of its steps.

#include "integrators/newton.hpp"

namespace withe {

struct BenchmarkProblem {
  Model model;
  Options options;
  Equations equations;
  Parameters parameters;
  State state;

  BenchmarkProblem(const SceneDescription& scene, bool planar, Integrator integrator = Integrator::energy_momentum)
      : model(build_model(scene, planar)),
        options(options_of(integrator)),
        equations(model, equation_options(options)),
        parameters(initial_parameters(model)),
        state(initial_state(model)) {}

  static Options options_of(Integrator integrator) {
    Options result;
    result.integrator = integrator;
    return result;
  }
  LinearSolver& solver() { return equations.assembler().solver(); }
};

}  // namespace withe
