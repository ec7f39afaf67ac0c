#include "integrators/inner_solve.hpp"

#include <algorithm>
#include <cmath>

#include "elasticity/stretch.hpp"

namespace withe {
namespace {

// Iterations from a guess that may be wrong.
constexpr int kFew = 12;

/// Axial forces at the start of a step [N]: where the mixed method sets out from, for those of an extrapolated motion,
/// whose edges turn along straight lines and so stretch, mean nothing.
void start_axial_force(const Equations& equations, const VectorX& q, VectorX& out) {
  const Model& model = equations.model();
  const ElasticCoefficients& k = equations.elastic();
  out.resize(model.edge_count);
  for (int e = 0; e < model.edge_count; ++e) {
    const int a = model.tail_dof[at(e)], b = model.head_dof[at(e)];
    double square = 0.0;
    for (int i = 0; i < model.dimension; ++i) square += (q(b + i) - q(a + i)) * (q(b + i) - q(a + i));
    out(e) = axial_force(std::sqrt(square), model.edge_length(e), k.stretch_stiffness(e), k.stretch_natural(e));
  }
}

/// Puts into `work.z` the state after the motion `work.move`, as far as supports and surfaces let it go.
void guess(Equations& equations, const Newton& newton, const Options& options, double part, const State& state,
           StepWorkspace& work) {
  const Assembler& assembler = equations.assembler();
  assembler.project(work.move);
  work.move *= newton.norms().cap(work.move);
  if (equations.contact() && options.heuristics.uses(Heuristic::hold_sticking))
    equations.contact()->hold_sticking(state, work.move);
  assembler.add_held_change(state.q, work.held.q, part, work.move);
  work.z = state.q + work.move * equations.allowed(state.q, work.move);
  start_axial_force(equations, state.q, work.newton.axial_force);
}

}  // namespace

NewtonResult solve_inner(Equations& equations, const Newton& newton, const Options& options, const StepPlan& plan,
                         double h, const State& state, const Predictor& predictor, StepWorkspace& work) {
  const auto uses = [&options](Heuristic heuristic) { return options.heuristics.uses(heuristic); };
  const double part = h / plan.dt;
  const auto solve = [&](int most_iterations) {
    guess(equations, newton, options, part, state, work);
    return newton.solve(equations, work.z, {.max_iterations = most_iterations, .interval = h}, work.newton);
  };
  NewtonResult found;
  GuessRecord& record = work.newton.guess_record;
  if (uses(Heuristic::start_extrapolated) && !(uses(Heuristic::start_record) && record.skipped())) {
    predictor.predict({state.time + 0.5 * plan.dt, h, plan.dt, plan.slot}, state.v, work.mean);
    work.move = h * work.mean;
    found = solve(uses(Heuristic::few_iterations) ? std::min(kFew, options.max_iterations) : options.max_iterations);
    record.note(found.converged);
    if (found.converged) return found;
  }
  const int spent = found.iterations;
  work.move.setZero(state.q.size());
  found = solve(options.max_iterations);
  found.iterations += spent;
  return found;
}

}  // namespace withe
