#pragma once
/// What the benchmarks in C++ set up: a scene and the equations of one of its steps.

#include "integrators/newton.hpp"

namespace withe {

struct StepProblem {
  Model model;
  Options options;
  Equations equations;
  Parameters parameters;
  State state;

  StepProblem(const SceneDescription& scene, bool planar)
      : model(build_model(scene, planar)),
        equations(model, options),
        parameters(initial_parameters(model)),
        state(initial_state(model)) {}

  LinearSolver& solver() { return equations.assembler().solver(); }
};

}  // namespace withe
