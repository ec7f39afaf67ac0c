#include "integrators/arc_length.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "steps/elastic_forces.hpp"

namespace withe {
namespace {

// Least number of points from the first factor to the last one.
constexpr double kMinPoints = 20.0;
// Iterations of a point after which the next arc may be twice as long.
constexpr int kMaxEasyIterations = 5;
// Shortest arc, relative to the longest that turns allow. The path ends if shorter arcs would be needed.
constexpr double kMinArc = 1e-5;
// Arcs tried to find where a value changes its sign between two points.
constexpr int kMaxTries = 30;
// Error of a factor that is found in this way, relative to the range of factors.
constexpr double kMaxFactorError = 1e-9;

class ArcLength {
 public:
  ArcLength(Equations& equations, const Newton& newton, const Options& options, Homotopy& path, const ArcOptions& arc,
            State& state, NewtonWorkspace& work, const ArcVisitor& visit)
      : equations_(equations),
        newton_(newton),
        options_(options),
        path_(path),
        arc_(arc),
        state_(state),
        work_(work),
        visit_(visit),
        span_(arc.end - arc.start) {
    const Model& model = equations.model();
    weight_.setZero(model.dof_count);
    const double total = model.edge_length.sum(), square = model.length_scale * model.length_scale;
    for (int e = 0; e < model.edge_count; ++e) {
      const double share = model.edge_length(e) / total;
      for (const int dof : {model.tail_dof[static_cast<std::size_t>(e)], model.head_dof[static_cast<std::size_t>(e)]})
        weight_.segment(dof, model.dimension).array() += 0.5 * share / square;
      if (!model.planar()) weight_(model.edge_dof[static_cast<std::size_t>(e)]) = share;
    }
    factor_weight_ = 1.0 / (span_ * span_);
  }

  ArcResult run() {
    factor_ = arc_.start;
    bool rising = span_ > 0.0;
    find_direction(nullptr, rising);
    if (!here_.found) return result_;
    point_.limit = false;
    report();
    double longest = INFINITY;
    for (int count = 1; count < arc_.most_points;) {
      const double most = std::min(arc_.turn / turn_, std::abs(span_) / (kMinPoints * std::abs(rate_)));
      double arc = std::min(most, longest);
      start_ = {state_, factor_, rate_, tangent_};
      int taken = 0;
      while (!(taken = go(arc))) {
        arc *= 0.5;
        if (arc < kMinArc * most) return result_;
      }
      longest = taken <= kMaxEasyIterations ? 2.0 * arc : arc;
      const bool ends = (start_.factor - arc_.end) * (factor_ - arc_.end) <= 0.0 && start_.factor != arc_.end;
      // Just behind a limit point the rate is a rounding error: the next increment is as far as an arc away.
      const bool turns = start_.rate * rate_ < 0.0 && !(point_.limit);
      if (turns && !narrow(arc, [this] { return rate_; })) return result_;
      if (ends && !turns) {
        if (!narrow(arc, [this] { return factor_ - arc_.end; })) return result_;
        finish();
      }
      point_.limit = turns;
      report();
      ++count;
      if (ends && !turns) break;
    }
    result_.finished = true;
    return result_;
  }

 private:
  struct Start {
    State state;
    double factor = 0, rate = 0;
    VectorX tangent;
  };

  double product(const VectorX& a, const VectorX& b) const { return (a.array() * weight_.array() * b.array()).sum(); }

  /// Unit tangent of the path at the present point, with the orientation of the previous tangent.
  void find_direction(const VectorX* before, bool rising, double rate_before = 0.0) {
    path_.go_to(factor_);
    path_.find_tangent(here_);
    if (!here_.found) return;
    const double norm = std::sqrt(product(here_.rate, here_.rate) + factor_weight_);
    const bool along = before ? product(*before, here_.rate) + factor_weight_ * rate_before >= 0.0 : rising;
    rate_ = (along ? 1.0 : -1.0) / norm;
    tangent_ = rate_ * here_.rate;
    turn_ = newton_.norms().turn(tangent_);
    point_.stable = here_.factorization.status == FactorStatus::ok && here_.factorization.negative_pivots == 0;
  }

  /// From `start_`, whose state is the present one, to the point an arc away. Iterations that took, or 0: not found.
  int go(double arc) {
    path_.go_to(factor_);
    equations_.evaluate(state_.q, false, nullptr, work_.data);
    step_ = arc * tangent_;
    predict_axial_force(equations_.problem(), work_.data, step_, work_.axial_force);
    const double start = factor_, length = newton_.norms().displacement(step_);
    VectorX z = state_.q + step_;
    double factor = factor_ + arc * rate_, last = INFINITY;
    NewtonResult& newton = result_.newton;
    Stagnation stagnation;
    const double tolerance = options_.step_tolerance * equations_.model().length_scale;
    for (int k = 0; k <= kMaxPathIterations; ++k) {
      work_.poll();
      path_.go_to(factor);
      if (!path_.hold(factor, z)) break;
      if (k > 0 && equations_.allowed(state_.q, z - state_.q) < 1.0) break;
      path_.find_pull(z, pull_, held_);
      path_.evaluate(z, true, options_.mixed ? work_.axial_force.data() : nullptr);
      if (!work_.data.residual.allFinite()) break;
      const Balance balance = newton_.balance(work_.data, newton);
      stagnation.note(newton.residual, last);
      if ((balance.floor && stagnation.reached()) || (balance.either && last <= tolerance)) {
        if (path_.stiffen_deep(z)) {
          stagnation = {};
          last = INFINITY;
          continue;
        }
        path_.accept(z);
        factor_ = factor;
        find_direction(&start_.tangent, true, start_.rate);
        if (here_.found) return std::max(k, 1);
        back();
        return 0;
      }
      ++newton.iterations;
      ++work_.counters.iterations;
      if (!factorize(equations_, work_)) break;
      step_ = -work_.data.residual;
      solve(step_);
      solve(pull_);
      pull_ += held_;
      // The held part of z follows from the factor, so the rest of the plane's equation is linear.
      const double left = arc - product(start_.tangent, z - state_.q) - factor_weight_ * start_.rate * (factor - start);
      const double change =
          (left - product(start_.tangent, step_)) / (product(start_.tangent, pull_) + factor_weight_ * start_.rate);
      step_ += change * pull_;
      if (!step_.allFinite() || newton_.norms().cap(step_) < 1.0) break;
      const double size = newton_.norms().displacement(step_);
      if (leaves_path(size, k == 0 ? length : kMaxContraction * last, length, tolerance)) break;
      last = size;
      predict_axial_force(equations_.problem(), work_.data, step_, work_.axial_force);
      z += step_;
      factor += change;
    }
    back();
    return 0;
  }

  void back() {
    path_.go_back(start_.state, start_.factor);
    factor_ = start_.factor;
    rate_ = start_.rate;
    tangent_ = start_.tangent;
  }

  void solve(VectorX& vector) const {
    equations_.assembler().solver().solve({vector.data(), static_cast<std::size_t>(vector.size())});
  }

  /// Goes to where a value that has changed its sign between `start_` and the present point, an arc away, is zero: by
  /// the secant, with the Illinois rule [Dowell and Jarratt 1971].
  template <class Value>
  bool narrow(double arc, const Value& value) {
    double high = arc, at_high = value();
    back();
    double low = 0.0, at_low = value();
    for (int k = 0; k < kMaxTries && at_low != 0.0; ++k) {
      const double middle = (low * at_high - high * at_low) / (at_high - at_low), way = high - low;
      back();
      if (!go(middle)) return false;
      const double found = value();
      // The factor moves by no more than its greatest rate allows.
      if (std::abs(rate_) * way <= kMaxFactorError * std::abs(span_) ||
          std::abs(factor_ - arc_.end) <= kMaxFactorError * std::abs(span_) || way <= 1e-6 * arc)
        return true;
      if ((found > 0.0) == (at_high > 0.0)) {
        if (found * last_value_ > 0.0) at_low *= 0.5;
        high = middle, at_high = found;
      } else {
        if (found * last_value_ > 0.0) at_high *= 0.5;
        low = middle, at_low = found;
      }
      last_value_ = found;
    }
    return true;
  }

  /// The last point lies at the last factor exactly.
  void finish() {
    path_.go_to(arc_.end);
    VectorX z = state_.q;
    if (!path_.hold(arc_.end, z)) return;
    do {
      const NewtonResult r =
          newton_.solve(equations_, z, {.target = &path_.target(), .max_iterations = kMaxPathIterations}, work_);
      result_.newton.iterations += r.iterations;
      if (!r.converged) return;
    } while (path_.stiffen_deep(z));
    path_.accept(z);
    factor_ = arc_.end;
    find_direction(&start_.tangent, true, start_.rate);
  }

  void report() {
    point_.factor = result_.factor = factor_;
    path_.go_to(factor_);
    path_.evaluate(state_.q, false, nullptr);
    visit_(point_);
  }

  Equations& equations_;
  const Newton& newton_;
  const Options& options_;
  Homotopy& path_;
  const ArcOptions& arc_;
  State& state_;
  NewtonWorkspace& work_;
  const ArcVisitor& visit_;
  double span_ = 1.0, factor_ = 0.0, rate_ = 0.0, turn_ = 0.0, factor_weight_ = 1.0, last_value_ = 0.0;
  VectorX weight_, tangent_, step_, pull_, held_;
  Start start_;
  Homotopy::Tangent here_;
  ArcPoint point_;
  ArcResult result_;
};

}  // namespace

ArcResult follow_arc(Equations& equations, const Newton& newton, const Options& options, Homotopy& path,
                     const ArcOptions& arc, State& state, NewtonWorkspace& work, const ArcVisitor& visit) {
  return ArcLength(equations, newton, options, path, arc, state, work, visit).run();
}

}  // namespace withe
