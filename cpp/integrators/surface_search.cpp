#include "integrators/surface_search.hpp"

namespace withe {
namespace {

// Halvings before a step is accepted without a test: a thousandth of the step is left.
constexpr int kMaxHalvings = 10;
// Share of an uphill step that must be kept; else the step is solved again with a matrix that lacks the geometric
// stiffness of contact. Three halvings cost about as much as a new matrix.
constexpr double kMinUphillShare = 0.125;

}  // namespace

double SurfaceSearch::shortened(const VectorX& z, VectorX& step) const {
  const double kept = norms_.cap(step);
  if (kept != 1.0) step *= kept;
  const double allowed = system_.equations.allowed(z, step);
  if (allowed != 1.0) step *= allowed;
  return kept * allowed;
}

bool SurfaceSearch::run(const VectorX& z, double& shorten) {
  NewtonWorkspace& work = system_.work;
  const bool uphill = heuristics_.uses(Heuristic::drop_geometric) && work.step.dot(work.data.residual) > 0.0;
  double kept = search(z, uphill ? kMinUphillShare : 0.0, shorten);
  if (uphill && !evaluated_) {
    work.contact.geometric = false;
    system_.evaluate(z, true);
    work.contact.geometric = true;
    if (!system_.factorize()) return false;
    system_.solve_for(work.step);
    if (!work.step.allFinite()) return false;
    shorten = shortened(z, work.step);
    kept = search(z, 0.0, shorten);
    remade_ = true;
  }
  work.step *= kept;
  shorten *= kept;
  return true;
}

/// Share of the step that passes a test, if above `least`; otherwise the last share, not evaluated.
double SurfaceSearch::search(const VectorX& z, double least, double shorten) {
  NewtonWorkspace& work = system_.work;
  const StepData& e = work.data;
  const double full = norms_.displacement(work.step) / shorten, before = work.step.dot(e.residual);
  forget();
  double kept = 1.0;
  for (int tries = 0; tries < kMaxHalvings && kept > least; ++tries) {
    work.trial = z + kept * work.step;
    system_.evaluate(work.trial, false);
    evaluated_ = e.residual.allFinite();
    if (evaluated_) {
      const double after = work.step.dot(e.residual);
      if (heuristics_.uses(Heuristic::search_descent) && before <= after && after <= 0.0) return kept;
      system_.solve_for(work.next_step);
      solved_ = norms_.displacement(work.next_step) <= (1.0 - 0.25 * kept * shorten) * full;
      if (solved_) return kept;
    }
    kept *= 0.5;
  }
  evaluated_ = false;
  return kept;
}

}  // namespace withe
