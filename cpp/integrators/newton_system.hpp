#pragma once
/// The equations as Newton's method sees them: F(z) = target, its matrix, and steps.

#include <functional>
#include <limits>

#include "integrators/guess_record.hpp"
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
  GuessRecords guesses;
  double finest = INFINITY;  ///< step tolerance of the error control [m]; that of the options is an upper bound
  Counters counters;
  std::function<void()> poll = [] {};  ///< called once per iteration; its exception ends the solve
};

/// Relative rounding error of a number, and the relative bound of the rounding error of a sum of many numbers. Larger
/// numbers are certainly not zero.
inline constexpr double kEpsilon = std::numeric_limits<double>::epsilon(), kMaxRounding = 64.0 * kEpsilon;
/// Share of the diagonal of a stiffness, per row. Adding the share kEpsilon keeps neutral motions (of a free body, of a
/// rod that may spin about its axis) from going anywhere by rounding. Subtracting the share kMaxRounding leaves motions
/// positive that are surely not neutral. Needs the matrix of the last evaluation.
VectorX neutral_shift(const Equations& equations, double share);

/// Factorises the matrix; with `hold_neutral` it adds the shift that keeps rounding from moving neutral modes. A
/// singular matrix gets a shift far below every stiffness.
bool factorize(Equations& equations, NewtonWorkspace& work, bool hold_neutral = false);

struct NewtonSystem {
  Equations& equations;
  const VectorX* target;  ///< nothing: zero
  NewtonWorkspace& work;
  bool hold_neutral = false;

  /// Computes the residual, and optionally the matrix.
  void evaluate(const VectorX& z, bool matrix, const double* axial_force = nullptr) const;
  bool factorize() const { return withe::factorize(equations, work, hold_neutral); }
  /// step = -A^-1 residual, with the factorised matrix.
  void solve_for(VectorX& step) const;
};

}  // namespace withe
