// The force of a viscous fluid.
//
// Stokeslets: the force of the fluid is F(v) = -R v, with R dense. Let v* be velocities guessed before the step, u the
// velocities of the step, and D a local drag. The step uses D (v* - u) - R v*. At u = v* this is F, and the remainder
// (D - R) (u - v*) has the order of v*.
//
// Stability matters for modes that neither mass nor stiffness resists.
//
// - Backward Euler: v* is the last u, so u = (1 - R / D) v*. This is stable for R up to 2 D, and beyond if mass over
//   the step, or stiffness times the step, is as large.
// - Midpoint rules: v* is extrapolated from the last two velocities. The roots of x^2 = (1 - R / D) (2 x - 1) stay in
//   the unit circle for R up to 4/3 D. Stiffness does not help, because the velocity changes sign each step.
//
// D is as large as R along single rods. Rods that nearly touch have more resistance, and D grows where mass over the
// step is too small for that. The midpoint rules then use the last u for v*, which is stable for R up to 2 D at any
// stiffness, but of first order. With extrapolation, slow motions with a resistance of a tenth of D would grow.

#include "steps/fluid_forces.hpp"

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "common/check.hpp"
#include "model/rod_rows.hpp"
#include "steps/inertia.hpp"

namespace withe {
void StokesletForces::begin(StepProblem&) { acts_ = false; }

bool StokesletForces::solve(const StepProblem& problem, const VectorX& q, const VectorX& v) {
  const Parameters& parameters = *problem.parameters;
  if (fluid_.regularization() != parameters.fluid_regularization) {
    fluid_.set_regularization(parameters.fluid_regularization);
    excess_ = 0.0;
  }
  if (!fluid_.solve(q, v, start_)) return false;
  const double viscosity = parameters.fluid_viscosity;
  inertia_ = parameters.node_mass / (viscosity * problem.duration());
  const double excess = fluid_.excess(inertia_, problem.in_middle() ? 1.3 : 1.9);
  if (excess != excess_ || version_ != parameters.version) fluid_.set_local_drag(excess * viscosity, drag_);
  excess_ = excess;
  version_ = parameters.version;
  multiply(problem.model, drag_, v, local_);
  start_ = viscosity * start_ + local_;
  acts_ = true;
  return true;
}

/// Force of the fluid at the velocities (z - q0) / h.
void StokesletForces::add(const StepProblem& problem, StepData& data, const Assembler& assembler,
                          std::span<double> values) const {
  if (!acts_) return;
  const int n = problem.model.dof_count;
  const double inverse = 1.0 / problem.interval;
  data.velocity = inverse * (data.z - problem.start->q);
  multiply(problem.model, drag_, data.velocity, data.flow_drag);
  data.row_magnitude.head(n) += start_.cwiseAbs() + data.flow_drag.cwiseAbs();
  data.flow_force = start_ - data.flow_drag;
  data.gradient.head(n) -= data.flow_force;
  if (!values.empty()) add_mass_matrix(problem, drag_, inverse, assembler, values);
}

void StokesletForces::add_adjoint(const StepProblem&, const StepData&, const Assembler&, StepAdjoint&) const {
  throw std::invalid_argument(
      "no gradient is available with a fluid of Stokeslets: use model='resistive' or "
      "drag");
}

double StokesletForces::dissipated(const StepProblem&, const StepData& data, const Assembler&,
                                   const VectorX& change) const {
  return acts_ ? -data.flow_force.dot(change) : 0.0;
}

void StokesletForces::forget() {
  fluid_.forget();
  excess_ = 0.0;
}

void StokesletForces::recall(const StokesletFluid::Memory& memory, double excess) {
  excess_ = excess;
  version_ = -1;
  fluid_.recall(memory);
}

namespace {

/// Per rod, the arc length of the whole row of connected rods to which it belongs. A row acts as one slender body.
std::vector<double> lengths_of_rows(const Model& model) {
  const std::size_t rods = model.description.rods.size();
  std::vector<int> row(rods);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t r = 0; r < rods; ++r) {
    const int next = next_in_row(model, model.rod_first_edge[r + 1] - 1, true);
    if (next < 0) continue;
    const int mine = row[r], theirs = row[at(model.edge_rod[at(next)])];
    std::replace(row.begin(), row.end(), theirs, mine);
  }
  std::vector<double> length(rods, 0.0), of_rod(rods);
  for (int e = 0; e < model.edge_count; ++e) length[at(row[at(model.edge_rod[at(e)])])] += model.edge_arc(e);
  for (std::size_t r = 0; r < rods; ++r) of_rod[r] = length[at(row[r])];
  return of_rod;
}

}  // namespace

ResistiveForces::ResistiveForces(const Model& model) {
  const SceneDescription& scene = model.description;
  const std::vector<double> length = lengths_of_rows(model);
  for (int e = 0; e < model.edge_count; ++e) {
    const auto rod = at(model.edge_rod[at(e)]);
    const RodDescription& d = scene.rods[rod];
    if (d.is_surface()) {  // bodies have no resistance
      resistance_.emplace_back();
      continue;
    }
    require(d.fluid_radius.size() == d.rest_lengths.size(), "a rod in a fluid needs one radius an edge");
    const double radius = d.fluid_radius[e - model.rod_first_edge[rod]];
    resistance_.push_back(resistive_coefficients(radius, length[rod], scene.fluid.wavelength));
  }
}

ResistiveEdge ResistiveForces::edge_of(const StepProblem& problem, const StepData& data, int edge) const {
  const Model& model = problem.model;
  const EdgeFrame<double>& f = data.configuration.edge[at(edge)];
  const double half = 0.5 * model.edge_arc(edge) * problem.parameters->fluid_viscosity;
  ResistiveEdge resistive{.dimension = model.dimension,
                          .along = half * resistance_[at(edge)].along,
                          .across = half * resistance_[at(edge)].across,
                          .tangent = {f.tangent.x, f.tangent.y, f.tangent.z},
                          .inverse_length = f.inverse_length,
                          .change = {},
                          .inverse_duration = 1.0 / problem.interval};
  const int dof[2] = {model.tail_dof[at(edge)], model.head_dof[at(edge)]};
  for (int end = 0; end < 2; ++end)
    for (int k = 0; k < model.dimension; ++k)
      resistive.change[end][k] = data.z[dof[end] + k] - problem.start->q[dof[end] + k];
  return resistive;
}

void ResistiveForces::add(const StepProblem& problem, StepData& data, const Assembler& assembler,
                          std::span<double> values) const {
  if (!problem.resists()) return;
  Local local;
  for (int e = 0; e < problem.model.edge_count; ++e) {
    resistive_local(edge_of(problem, data, e), !values.empty(), local);
    add_element(assembler.stretch, e, local, data, values);
  }
}

/// The forces depend on the start only through the displacement of edges: their tangents are those at z.
void ResistiveForces::add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                                  StepAdjoint& adjoint) const {
  if (!problem.moves()) return;
  const Model& model = problem.model;
  Local local;
  double rows[kMaxLocal];
  for (int e = 0; e < model.edge_count; ++e) {
    const ResistiveEdge edge = edge_of(problem, data, e);
    resistive_local(edge, false, local);
    gather(assembler.stretch, e, adjoint.rows, rows);
    const int d = model.dimension, dof[2] = {model.tail_dof[at(e)], model.head_dof[at(e)]};
    for (int end = 0; end < 2; ++end) {
      const double* by = rows + end * d;
      double forward = 0.0;
      for (int i = 0; i < d; ++i) {
        forward += edge.tangent[i] * by[i];
        adjoint.coefficients.fluid_viscosity +=
            by[i] * local.gradient[end * d + i] / problem.parameters->fluid_viscosity;
      }
      for (int i = 0; i < d; ++i)
        adjoint.start[dof[end] + i] -=
            edge.inverse_duration * (edge.across * by[i] + (edge.along - edge.across) * forward * edge.tangent[i]);
    }
  }
}

double ResistiveForces::dissipated(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                                   const VectorX& change) const {
  double work = 0.0;
  if (!problem.moves()) return work;
  Local local;
  for (int e = 0; e < problem.model.edge_count; ++e) {
    resistive_local(edge_of(problem, data, e), false, local);
    work += work_of(assembler.stretch, e, local, change);
  }
  return work;
}

}  // namespace withe
