#pragma once
/// Chord iterations: the factorised matrix of an earlier iterate, or of an earlier time step, serves for as long as
/// that is cheaper than a new one.

#include <array>
#include <cmath>

#include "integrators/heuristics.hpp"
#include "steps/equations.hpp"

namespace withe {

/// Age of the matrix of an iteration: made there, at an earlier iterate, or in an earlier time step.
enum class MatrixAge { fresh, within, across };

/// Contraction rates of chord iterations with earlier factorisations.
struct MatrixHistory {
  double interval = 0;  ///< interval of the last matrix [s]
  /// Contraction rate per MatrixAge: error after an iteration over error before. It is the greatest rate of a solve.
  /// The rate decreases towards the solution, so the last iterations do not predict the first ones of the next step.
  std::array<double, 3> contraction{1e-2, 1e-2, 1e-2};
  int waited = 0;     ///< time steps since one was last tried across
  bool slow = false;  ///< the last time step took many iterations with one
};

/// Matrix that the factorisation in a solver belongs to, and its history.
struct MatrixRecord : MatrixHistory {
  const Equations* owner = nullptr;  ///< null: must not be reused
  int generation = 0;                ///< generation of the solver
  bool factorized = true;            ///< false: the matrix in the solver is newer than its factorisation

  bool belongs_to(const Equations& equations, double h) const { return owner == &equations && interval == std::abs(h); }
};

/// One solve's decisions about its matrices, and its estimate of the distance from the solution.
class MatrixReuse {
 public:
  /// `interval`: of a time step [s], after whose end the matrix may serve again; 0: each matrix serves one iteration.
  /// `tolerance`: of the solution [m].
  MatrixReuse(MatrixRecord& record, Equations& equations, double interval, double tolerance, const Without& heuristics);

  /// True if the coming iteration makes a matrix.
  bool fresh() const { return fresh_; }
  /// True if the previous matrix must be factorised: it was computed for an iteration that was not needed.
  bool pending() const { return !fresh_ && !record_.factorized; }
  /// True if the residual alone is looked at first: it may show the end, and a matrix would have been made in vain.
  bool near_end() const;
  /// True if the error is within the tolerance, by the known contraction rate of the matrix.
  bool at_end() const { return distance_ <= tolerance_; }
  /// Length of the last step and of the previous one [m]; infinite if it was shortened, or there was none.
  double step() const { return step_; }
  double last_step() const { return last_step_; }
  double tolerance() const { return tolerance_; }

  /// A matrix was factorised; `whole`: all of the Jacobian, so that it may serve again.
  void note_matrix(bool whole = true);
  /// Notes that a matrix was computed and the solve ended. The next solve uses this matrix, not an older factorisation.
  /// The memory between steps is then a function of the matrix alone.
  void note_spare_matrix();
  void note_factorized() { record_.factorized = true; }
  /// After a step: learns how well matrices serve, and decides about the next one.
  void note_step(double length);
  void note_end(int iterations);
  /// The factorisation is not to be used again.
  void drop() { record_.owner = nullptr; }

 private:
  MatrixRecord& record_;
  Equations& equations_;
  double interval_;
  bool allowed_;
  double tolerance_;
  const Without& heuristics_;
  bool fresh_ = true, made_here_ = false;
  std::array<double, 3> measured_{};  ///< greatest contraction rates of this solve
  MatrixAge age_ = MatrixAge::fresh, last_age_ = MatrixAge::fresh;
  double step_ = INFINITY, last_step_ = INFINITY;
  double distance_ = INFINITY;  ///< estimated distance from the solution [m]
};

}  // namespace withe
