#include "steps/pressure_gains.hpp"

#include <cmath>

#include "model/edge_vectors.hpp"
#include "steps/rounding.hpp"
#include "steps/term.hpp"

namespace withe {
namespace {

/// Adds the pressure on edges times the length by which they yield. Returns true if any edge yields.
bool add_turns(const StepProblem& problem, const StepData& data, VectorX& gains) {
  const Model& model = problem.model;
  const VectorX& start = problem.start->q;
  bool any = false;
  for (int e = 0; e < model.edge_count; ++e) {
    if (!(data.force[e] < 0.0)) continue;
    const Vec3d before = edge_vector(model, start, e);
    const double length = std::sqrt(dot(before, before)),
                 way = length - dot(before, data.configuration.edge[at(e)].tangent);
    gains[model.component_of_edge(e)] -= data.force[e] * way;
    any = any || way > 0.0;
  }
  return any;
}

/// Adds the growth of elastic energies beyond the work of elastic forces at the end of the step.
void add_elastic_gains(const StepProblem& problem, StepData& data, const Assembler& assembler, const VectorX& change,
                       VectorX& gains) {
  const Model& model = problem.model;
  const ElasticCoefficients& k = problem.elastic;
  Configuration& start = data.end_configuration;
  compute_configuration(model, *problem.start, problem.start->q, start);
  const Configuration& end = data.configuration;
  Local local;
  const auto sum = [](const BendTwistEnergy& turned) { return turned.bend + turned.twist; };
  for (int e = 0; e < model.edge_count; ++e) {
    stretch_local(model, k, end, e, false, nullptr, local);
    gains[model.component_of_edge(e)] += stretch_energy_of(model, k, end, e) - stretch_energy_of(model, k, start, e) -
                                         work_of(assembler.stretch, e, local, change);
  }
  for (int b = 0; b < static_cast<int>(model.bend.size()); ++b) {
    bend_local(model, bend_coefficients(k, b), end, b, false, local);
    gains[model.component_of_edge(model.bend[at(b)].edge[0])] +=
        sum(bend_energy_of(k, end, b)) - sum(bend_energy_of(k, start, b)) - work_of(assembler.bend, b, local, change);
  }
  for (int h = 0; h < static_cast<int>(model.half.size()); ++h) {
    half_local(model, data.z, half_coefficients(k, h), end, h, false, local);
    gains[model.component_of_edge(model.half[at(h)].edge)] +=
        sum(half_energy_of(k, end, h)) - sum(half_energy_of(k, start, h)) - work_of(assembler.half, h, local, change);
  }
}

}  // namespace

void find_pressure_gains(const StepProblem& problem, StepData& data, const Assembler& assembler, const VectorX& v1,
                         PressureGains& out) {
  const Model& model = problem.model;
  auto& [gains, taken, change, momentum] = out;
  gains.setZero(model.component_count);
  if (!add_turns(problem, data, gains)) return;
  taken.setZero(model.component_count);
  change = v1 - problem.start->v;
  assembler.project(change);
  multiply(model, problem.mass, change, momentum);
  for (int i = 0; i < model.dof_count; ++i) taken[model.dof_component[at(i)]] += 0.5 * change[i] * momentum[i];
  if ((gains.array() <= taken.array()).all()) {
    gains.setZero();
    return;
  }
  gains = -taken;
  change = data.z - problem.start->q;
  add_elastic_gains(problem, data, assembler, change, gains);
  // Rounding errors of energies are forces times rounding errors of positions.
  for (int i = 0; i < model.dof_count; ++i)
    gains[model.dof_component[at(i)]] -= kRounding * data.rounding.reach * data.magnitude[i];
}

}  // namespace withe
