#pragma once
/// Stability of an equilibrium, and the direction of its fall, from the signs of the eigenvalues of its stiffness.

#include <memory>

#include "integrators/newton_system.hpp"
#include "integrators/step_norms.hpp"

namespace withe {

/// All of it needs the matrix of the equations' last evaluation.
class StiffnessSigns {
 public:
  StiffnessSigns(Equations& equations, const StepNorms& norms, Counters& counters)
      : equations_(equations), norms_(norms), counters_(counters) {}

  /// That matrix if it is symmetric, otherwise its symmetric part.
  LinearSolver& symmetric_part();
  /// Factorises a symmetric matrix plus `damping` of the weight; whether all its eigenvalues are positive.
  bool definite(LinearSolver& stiffness, double damping, const VectorX& weight);
  /// True if no motion lowers the potential. For unsymmetric equations without a potential: true if the matrix is
  /// regular. `data` has the evaluation, and is scratch.
  bool stable(const State& state, StepData& data);
  /// True if a motion is neutral, as of a free body, or of a rod that may spin about its axis; of unsymmetric
  /// equations, whether one may be.
  bool neutral(const State& state, StepData& data);
  /// Neutral motion of length 1 if there is a potential, or empty. `slack` multiplies the rounding error, because input
  /// may be rounded: a drawing that is straight except for its last digits prefers one side.
  VectorX neutral_motion(const State& state, StepData& data, double slack = 1.0);
  /// Inertia per unknown, for a part that moves others also theirs.
  VectorX weights() const;
  /// Direction of the most negative curvature against mass, by inverse iteration on a matrix that is shifted
  /// until it is definite.
  VectorX lowest_mode(int seed);

 private:
  struct Lowest {
    double curvature, unknown;  ///< curvature along a mode, and its uncertainty from rounding and imbalance
  };
  Lowest lowest(const VectorX& mode, const State& state, StepData& data);

  Equations& equations_;
  const StepNorms& norms_;
  Counters& counters_;
  std::unique_ptr<LinearSolver> symmetric_;  ///< solver for the assembler's `generation_`
  int generation_ = -1;
  VectorX shift_;
};

}  // namespace withe
