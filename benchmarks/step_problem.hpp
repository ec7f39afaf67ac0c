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

  BenchmarkProblem(const SceneDescription& scene, bool planar)
      : model(build_model(scene, planar)),
        equations(model, equation_options(options)),
        parameters(initial_parameters(model)),
        state(initial_state(model)) {}

  LinearSolver& solver() { return equations.assembler().solver(); }
};

}  // namespace withe
