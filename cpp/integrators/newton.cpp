#include "integrators/newton.hpp"

#include <algorithm>
#include <cmath>

#include "integrators/fourth_order.hpp"
#include "integrators/surface_search.hpp"
#include "steps/elastic_forces.hpp"

namespace withe {
namespace {

// Number of consecutive steps within the tolerance without a halved residual that ends a solve at a jump of forces. In
// time integration a shorter interval leads past the jump; a solve at rest continues, for want of an alternative.
constexpr int kMaxStalls = 4;

// Corrections, over the prediction, and over the tolerance, up to which they need not shrink: so near to the path a
// kink, or rounding, may stop that, and no other path is.
constexpr double kMaxSettledShare = 0.05, kMaxSettledTolerances = 1e4;

/// True if corrections of a prediction are too long, or do not shrink, so that the result may lie on another path.
bool loses_path(const Prediction& predicted, const MatrixReuse& reuse, bool first, double length) {
  if (predicted.strict)
    return leaves_path(reuse.step(), first ? predicted.length : kMaxContraction * reuse.last_step(), predicted.length,
                       reuse.tolerance());
  return predicted.length > 0.0 && length > std::max(predicted.length, kMaxSettledTolerances * reuse.tolerance());
}

/// Checks packs: a number that is not finite stays so when multiplied by zero.
bool is_finite(const VectorX& x) { return (0.0 * x).sum() == 0.0; }

/// A user's force tolerance is that of a whole step.
Options options_of_parts(Options options) {
  if (options.integrator == Integrator::fourth_order) options.force_tolerance /= kFourthOrderWay;
  return options;
}

}  // namespace

Newton::Newton(const Model& model, const Options& options)
    : model_(model), options_(options_of_parts(options)), norms_(model) {}

bool leaves_path(double correction, double bound, double predicted, double tolerance) {
  return !(correction <= std::max({bound, kMaxSettledShare * predicted, kMaxSettledTolerances * tolerance}));
}

Balance Newton::balance(const StepData& e, NewtonResult& result) const {
  Balance balance;
  balance.finite = is_finite(e.residual);
  if (!balance.finite) return balance;
  const auto coordinates = norms_.coordinates().array(), angles = norms_.angles().array();
  const double force = (e.magnitude.array() * coordinates).maxCoeff();
  const double moment = std::max((e.magnitude.array() * angles).maxCoeff(), force * norms_.shortest_edge());
  const auto size = e.residual.array().abs();
  const auto over_floor = size - 10.0 * e.floor.array();
  const auto over_share = size - options_.force_tolerance * (force * coordinates + moment * angles);
  result.residual = (size * norms_.inverse_arms().array()).maxCoeff();
  balance.either = over_floor.min(over_share).maxCoeff() <= 0.0;
  balance.floor = balance.either && over_floor.maxCoeff() <= 0.0;
  return balance;
}

int Newton::worst_row(const VectorX& residual) const {
  int row = -1;
  (residual.array().abs() * norms_.inverse_arms().array()).maxCoeff(&row);
  return row;
}

/// One solve.
class Newton::Solve {
 public:
  Solve(const Newton& newton, Equations& equations, VectorX& z, const SolveOptions& how, NewtonWorkspace& work)
      : newton_(newton),
        how_(how),
        work_(work),
        z_(z),
        contact_(equations.contact()),
        system_{equations, how.target, work, how.hold_neutral},
        search_(newton.norms_, system_, newton.options_.heuristics),
        mixed_(how.mixed && newton.options_.mixed),
        reuse_(work.matrix, equations, how.interval,
               std::min(newton.options_.step_tolerance * newton.model_.length_scale, work.finest),
               newton.options_.heuristics),
        axial_known_(mixed_ && (how.interval != 0.0 || (how.predicted && how.predicted->forces))) {
    work.contact.regularisation = how.regularisation;
    work.contact.geometric = true;
    work.contact.forget_friction();
  }

  NewtonResult run() {
    system_.equations.place(z_);
    for (;; ++result_.iterations) {
      work_.poll();
      const Verdict verdict = look();
      if (verdict == Verdict::go_on && iterate()) continue;
      result_.converged = verdict == Verdict::converged;
      result_.worst_row = newton_.worst_row(work_.data.residual);
      if (result_.converged) {
        if (spare_matrix_) reuse_.note_spare_matrix();
        reuse_.note_end(result_.iterations);
      } else {
        reuse_.drop();
      }
      work_.contact.forget_friction();
      return result_;
    }
  }

 private:
  bool uses(Heuristic h) const { return newton_.options_.heuristics.uses(h); }

  enum class Verdict { go_on, converged, failed };

  void evaluate(bool matrix) {
    system_.evaluate(z_, matrix, mixed_ && axial_known_ ? work_.axial_force.data() : nullptr);
    spare_matrix_ = matrix;
  }

  /// Evaluates what the next iteration needs, unless the search has done so, and judges the result.
  Verdict look() {
    const bool near_end = reuse_.near_end();
    if (!search_.evaluated() || (reuse_.fresh() && !near_end)) evaluate(reuse_.fresh() && !near_end);
    result_.step = reuse_.step();
    balance_ = newton_.balance(work_.data, result_);
    if (!balance_.finite) return Verdict::failed;
    stagnation_.note(result_.residual, reuse_.step());
    if (converged()) return Verdict::converged;
    if (result_.iterations == how_.max_iterations + std::min(whole_steps_, how_.free_steps)) return Verdict::failed;
    if (uses(Heuristic::reject_stagnation) && how_.interval != 0.0 && stagnation_.stalls() >= kMaxStalls &&
        reuse_.at_end())
      return Verdict::failed;
    if (reuse_.fresh() && near_end) evaluate(true);
    return Verdict::go_on;
  }

  /// A guess is accepted only after a step. A residual below the rounding error bound, and below the tolerance from a
  /// rod's stresses, may still be all of its weight. Intermediate points of a path end by their steps alone, for any
  /// rounding errors. The same scene at another place in space then takes the same steps.
  bool converged() const {
    if (how_.predicted && how_.predicted->enough > 0.0) return reuse_.step() <= how_.predicted->enough;
    if (result_.iterations == 0) return (work_.data.residual.array() == 0.0).all();
    return (balance_.either && reuse_.at_end()) || (balance_.floor && stagnation_.reached());
  }

  /// Finds a step; false where the matrix has no factorisation, or the step is not finite.
  bool find_step() {
    if (reuse_.fresh() || reuse_.pending()) {
      if (!system_.factorize()) return false;
      reuse_.fresh() ? reuse_.note_matrix() : reuse_.note_factorized();
      spare_matrix_ = false;
    }
    if (search_.solved() && !reuse_.fresh())
      work_.step.swap(work_.next_step);
    else
      system_.solve_for(work_.step);
    search_.forget();
    return is_finite(work_.step);
  }

  /// Takes a step; returns false if there is none, or none that may lead to the solution.
  bool iterate() {
    ++work_.counters.iterations;
    if (!find_step()) return false;
    double shorten = search_.shortened(z_, work_.step);
    if (uses(Heuristic::predict_friction)) system_.equations.predict_friction(work_.step, shorten, work_.contact);
    if (mixed_) predict_axial_force(system_.equations.problem(), work_.data, work_.step, work_.axial_force);
    axial_known_ = mixed_;
    if (contact_ && uses(Heuristic::surface_search) && !leaves_surfaces_alone() && !step_between_surfaces(shorten))
      return false;
    if (search_.evaluated())
      z_.swap(work_.trial);
    else
      z_ += work_.step;
    system_.equations.place(z_);
    const double length = newton_.norms_.displacement(work_.step);
    if (shorten == 1.0) ++whole_steps_;
    // A shortened step does not locate the solution, unless the whole step is within the tolerance.
    const bool near = shorten > 0.0 && length <= shorten * reuse_.tolerance();
    reuse_.note_step(shorten == 1.0 || near ? length : INFINITY);
    if (!how_.predicted) return true;
    return !loses_path(*how_.predicted, reuse_, result_.iterations == 0, length) ||
           ++kinks_met_ <= how_.predicted->kinks;
  }

  /// True if nothing touches at the start and the end of the step, which is then a step without surfaces.
  bool leaves_surfaces_alone() {
    if (contact_->count() > 0) return false;
    work_.trial = z_ + work_.step;
    return !system_.equations.touches(work_.trial);
  }

  bool step_between_surfaces(double& shorten) {
    if (!search_.run(z_, shorten)) return false;
    if (search_.remade()) reuse_.note_matrix(false);
    axial_known_ = false;  // no prediction outlives a step that may lead elsewhere
    return true;
  }

  const Newton& newton_;
  const SolveOptions& how_;
  NewtonWorkspace& work_;
  VectorX& z_;
  Contact* contact_;
  NewtonSystem system_;
  SurfaceSearch search_;
  bool mixed_;
  MatrixReuse reuse_;
  bool axial_known_;
  bool spare_matrix_ = false;  ///< made since the last factorisation
  int whole_steps_ = 0, kinks_met_ = 0;
  NewtonResult result_;
  Balance balance_;
  Stagnation stagnation_;
};

NewtonResult Newton::solve(Equations& equations, VectorX& z, const SolveOptions& how, NewtonWorkspace& work) const {
  return Solve(*this, equations, z, how, work).run();
}

}  // namespace withe
