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
  bool floor = false;   ///< all within what rounding leaves
  bool either = false;  ///< each within that, or below the tolerance times the forces in the scene
};

/// The limiting accuracy of Newton's method [Tisseur 2001]: residuals halve no more, in two iterations, or in one whose
/// step is no half of the last one either (what is free to spin is driven on by rounding). That each row is within its
/// rounding error bound is no end of the iterations: thousands of rows that are off in the same sense bend a fine rod
/// by far more than rounding does, whose errors have no sense.
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

/// True if a correction of a prediction is too long for what it leads to to lie on the same path [m]. `bound`: the
/// prediction for the first correction, kMaxContraction times the one before for others.
bool leaves_path(double correction, double bound, double predicted, double tolerance);

/// A solution predicted from another one on the same path, with its axial forces in work.axial_force if it has them. A
/// guess that is near enough is drawn in fast: where the first correction is longer than the prediction, or the
/// corrections do not halve, the path is lost, or another one not far [Deuflhard 2011, section 5.1].
struct Prediction {
  double length = 0;   ///< greatest displacement from the known solution [m]; 0 and not strict: no bound
  bool strict = true;  ///< whether corrections have to shrink too; else none may be longer than `length`
  int kinks = 0;       ///< corrections that may fail so because forces have kinks
  bool forces = true;  ///< whether work.axial_force goes with it
  double enough = 0;   ///< a correction after which no other is needed, for a point on the way [m]
};

/// Options of one solve.
struct SolveOptions {
  const VectorX* target = nullptr;  ///< what F(z) is to be; nothing: zero
  int max_iterations = 40;
  int free_steps = 0;   ///< so many iterations whose steps are taken whole do not count
  bool mixed = true;    ///< with the axial forces as unknowns of their own, where the options allow it
  double interval = 0;  ///< of a time step [s], whose matrix may serve several iterations and the steps to come; the
                        ///< mixed method then sets out from work.axial_force. 0: a new matrix every iteration
  bool hold_neutral = false;              ///< keeps neutral motions from going anywhere by rounding; slows fine rods
  double regularisation = 1;              ///< by which friction's slip tolerance is greater, in a continuation
  const Prediction* predicted = nullptr;  ///< how z was found, if it was from another solution
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
