#pragma once
/// The equations as Newton's method sees them: F(z) = target, its matrix, and steps.

#include <functional>

#include "integrators/guess_history.hpp"
#include "integrators/matrix_reuse.hpp"
#include "steps/equations.hpp"

namespace withe {

struct Counters {
  long iterations = 0, evaluations = 0, factorizations = 0;
  double assembly_time = 0, solve_time = 0, fluid_time = 0;  ///< [s]
};

/// Scratch of the solver; owned by the world, so that a step does not allocate.
struct NewtonWorkspace {
  StepData data;
  VectorX step, axial_force, trial, next_step;
  ContactLinearisation contact;
  MatrixRecord matrix;
  GuessHistory guesses;
  double finest = INFINITY;  ///< [m], a step tolerance that error control wants; that of the options is an upper bound
  Counters counters;
  std::function<void()> poll = [] {};  ///< asked once an iteration; what it throws ends the solve
};

/// Factorises the matrix as it is; a free mode (a rod that may spin about its axis) is held by a shift far below every
/// stiffness.
bool factorize(Equations& equations, NewtonWorkspace& work);

struct NewtonSystem {
  Equations& equations;
  const VectorX* target;  ///< nothing: zero
  NewtonWorkspace& work;

  /// Residual, and matrix where it is asked for.
  void evaluate(const VectorX& z, bool matrix, const double* axial_force = nullptr) const;
  bool factorize() const { return withe::factorize(equations, work); }
  /// step = -A^-1 residual, with the matrix as it is factorised.
  void solve_for(VectorX& step) const;
};

}  // namespace withe
