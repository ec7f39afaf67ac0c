#pragma once
/// Newton's method for one step, mixed in the axial forces.

#include <cmath>

#include "integrators/newton_system.hpp"
#include "integrators/options.hpp"
#include "integrators/step_norms.hpp"

namespace withe {

struct NewtonResult {
  bool converged = false;
  int iterations = 0;
  double residual = 0;  ///< greatest force out of balance [N]
  int worst_row = -1;
  double step = 0;  ///< greatest displacement of the last iteration [m]
};

/// Size of the residuals.
struct Balance {
  bool finite = false;  ///< all are numbers; else none of the below holds
  bool floor = false;   ///< true if all rows are within their rounding error bounds
  bool either = false;  ///< each within that, or below the tolerance times the forces in the scene
};

/// The limiting accuracy of Newton's method [Tisseur 2001]. It is reached when residuals do not halve in two
/// iterations, or in one iteration whose step is not half of the last step either (rounding keeps neutral motions
/// going). That each row is within its rounding error bound is not enough to stop. Thousands of rows with errors of one
/// sign bend a fine rod by far more than rounding errors, whose signs are random.
class Stagnation {
 public:
  /// After each evaluation: the greatest residual [N], and the step that led there [m], infinite at the start.
  void note(double residual, double step) {
    stalls_ = residual > 0.5 * halved_ ? stalls_ + 1 : 0;
    reached_ = stalls_ > 1 || (stalls_ == 1 && step > 0.5 * step_);
    if (stalls_ == 0) halved_ = residual;
    step_ = step;
  }
  bool reached() const { return reached_; }
  /// Iterations since residuals last halved.
  int stalls() const { return stalls_; }

 private:
  double halved_ = INFINITY, step_ = INFINITY;  ///< residual when it last halved, last step
  int stalls_ = 0;
  bool reached_ = false;
};

/// Iterations for a solution that is near a known one: a point of a path of equilibria, an interval on the way to one,
/// a step of a continuation. Where surfaces rub, Newton's method may wander, and rounding errors grow by some factor
/// each iteration: after 25 to 40 of them they decide where it ends.
inline constexpr int kMaxPathIterations = 20;

/// Contraction of corrections on a path: Newton's method converges where they halve [Deuflhard 2011, section 5.1].
inline constexpr double kMaxContraction = 0.5;

/// True if a correction [m] of a prediction is so long that its result may lie on another path. `bound` is the
/// prediction for the first correction, and kMaxContraction times the previous correction for others.
bool leaves_path(double correction, double bound, double predicted, double tolerance);

/// A solution predicted from another one on the same path, with its axial forces in work.axial_force if it has them.
/// Newton's method converges fast from a guess that is near enough. If the first correction is longer than the
/// prediction, or the corrections do not halve, the solve may be on another path [Deuflhard 2011, section 5.1].
struct Prediction {
  double length = 0;   ///< greatest displacement from the known solution [m]; 0 and not strict: no bound
  bool strict = true;  ///< true if corrections must shrink too; else none may be longer than `length`
  int kinks = 0;       ///< number of corrections that may fail this test, because forces have kinks
  bool forces = true;  ///< true if work.axial_force is predicted too
  double enough = 0;   ///< length of a correction that ends the solve of an intermediate point [m]
};

/// Options of one solve.
struct SolveOptions {
  const VectorX* target = nullptr;  ///< required value of F(z); null: zero
  int max_iterations = 40;
  int free_steps = 0;   ///< number of full steps that do not count as iterations
  bool mixed = true;    ///< true to use axial forces as unknowns, if the options allow it
  double interval = 0;  ///< interval of a time step [s], whose matrix may serve several iterations and later steps. The
                        ///< mixed method then starts from work.axial_force. 0: a new matrix every iteration
  bool hold_neutral = false;              ///< keeps neutral motions from going anywhere by rounding; slows fine rods
  double regularisation = 1;              ///< factor of friction's slip tolerance in a continuation
  const Prediction* predicted = nullptr;  ///< prediction of z from another solution, or null
};

class Newton {
 public:
  Newton(const Model& model, const Options& options);

  const StepNorms& norms() const { return norms_; }
  /// Finds z with F(z) = target, starting at z.
  NewtonResult solve(Equations& equations, VectorX& z, const SolveOptions& how, NewtonWorkspace& work) const;
  /// Size of the residuals against their bounds; also notes the greatest one in `result`.
  Balance balance(const StepData& evaluation, NewtonResult& result) const;
  /// Row of the greatest residual.
  int worst_row(const VectorX& residual) const;

 private:
  class Solve;

  const Model& model_;
  Options options_;
  StepNorms norms_;
};

}  // namespace withe
