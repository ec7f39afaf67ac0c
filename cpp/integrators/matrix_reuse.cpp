#include "integrators/matrix_reuse.hpp"

#include <algorithm>

namespace withe {
namespace {

// Contraction rate up to which a Jacobian of an earlier time step serves the next one.
constexpr double kMaxContractionAcross = 0.15;
// Steps after which one is tried again whose contraction rate was greater.
constexpr int kStepsUntilTrial = 16;
// Decay of the known contraction rate per step. A rate so high that every solve computes new matrices is no longer
// measured, and would otherwise never change.
constexpr double kRateDecay = 0.96;
// Chord iterations that cost as much as a new matrix: see FACTORISATION of benchmarks/ablation.py.
constexpr int kIterationsPerMatrix = 3;
// Chord iterations to the solution from which on a new matrix is worth its cost.
constexpr double kMaxIterationsLeft = 2.5;

std::size_t at(MatrixAge age) { return static_cast<std::size_t>(age); }

}  // namespace

MatrixReuse::MatrixReuse(MatrixRecord& record, Equations& equations, double interval, double tolerance,
                         const Without& heuristics)
    : record_(record),
      equations_(equations),
      interval_(std::abs(interval)),
      allowed_(interval != 0.0),
      tolerance_(tolerance),
      heuristics_(heuristics) {
  if (!allowed_)
    drop();
  else if (record.belongs_to(equations, interval) && record.generation == equations.assembler().generation()) {
    const bool badly = record.contraction[at(MatrixAge::across)] > kMaxContractionAcross &&
                       heuristics.uses(Heuristic::rest_from_reuse);
    fresh_ = !heuristics.uses(Heuristic::reuse_across_steps) ||
             (record.slow && heuristics.uses(Heuristic::refresh_after_slow)) ||
             (badly && ++record.waited < kStepsUntilTrial);
    if (!fresh_) record.waited = 0;
  }
  record.slow = false;
  if (heuristics.uses(Heuristic::forget_contraction)) record.contraction[at(MatrixAge::within)] *= kRateDecay;
}

bool MatrixReuse::near_end() const { return at_end() && heuristics_.uses(Heuristic::late_matrix); }

void MatrixReuse::note_matrix(bool whole) {
  fresh_ = made_here_ = true;
  record_.owner = allowed_ && whole ? &equations_ : nullptr;
  record_.interval = interval_;
  record_.generation = equations_.assembler().generation();
  record_.factorized = true;
}

void MatrixReuse::note_spare_matrix() {
  note_matrix();
  record_.factorized = false;
}

void MatrixReuse::note_end(int iterations) {
  record_.slow = age_ == MatrixAge::across && iterations >= kIterationsPerMatrix;
}

void MatrixReuse::note_step(double length) {
  last_step_ = step_;
  last_age_ = age_;
  step_ = distance_ = length;
  age_ = fresh_ ? MatrixAge::fresh : made_here_ ? MatrixAge::within : MatrixAge::across;
  if (!allowed_) return;
  double here = 4.0 * record_.contraction[at(age_)];
  if (std::isfinite(last_step_) && std::isfinite(step_)) {
    const double rate = step_ / last_step_;
    double& greatest = measured_[at(last_age_)];
    record_.contraction[at(last_age_)] = greatest = std::max(greatest, rate);
    if (last_age_ == age_) here = rate;
  }
  here = std::min(here, 0.5);
  distance_ = step_ * here / (1.0 - here);
  const double next = record_.contraction[at(age_ == MatrixAge::across ? MatrixAge::across : MatrixAge::within)];
  fresh_ = !std::isfinite(step_) || next > 0.5 || (!heuristics_.uses(Heuristic::reuse_within_step) && made_here_) ||
           (heuristics_.uses(Heuristic::matrix_worth) && distance_ > tolerance_ &&
            std::log(distance_ / tolerance_) > kMaxIterationsLeft * std::log(1.0 / next));
}

}  // namespace withe
