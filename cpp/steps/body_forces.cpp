#include "steps/body_forces.hpp"

#include "steps/inertia.hpp"

namespace withe {
void set_gravity_force(const Model& model, const Parameters& p, VectorX& force) {
  force.setZero(model.dof_count);
  for (int i = 0; i < model.node_count; ++i) {
    const int dof = model.node_dof[at(i)];
    if (model.planar())
      force.segment<2>(dof) =
          p.node_mass(i) * Vector2(p.gravity.dot(model.plane->first), p.gravity.dot(model.plane->second));
    else
      force.segment<3>(dof) = p.node_mass(i) * p.gravity;
  }
}

void Gravity::add(const StepProblem& problem, StepData& data, const Assembler&, std::span<double>) const {
  const int n = problem.model.dof_count;
  data.gradient.head(n) -= problem.gravity;
  data.row_magnitude.head(n) += problem.gravity.cwiseAbs();
  data.potential -= problem.gravity.dot(data.z);
}

void Gravity::add_adjoint(const StepProblem&, const StepData&, const Assembler&, StepAdjoint& adjoint) const {
  adjoint.coefficients.gravity -= adjoint.rows;
}

void Gravity::add_explicit(const StepProblem& problem, StepData& data, const Assembler&, const VectorX&) const {
  data.gradient.head(problem.model.dof_count) -= problem.gravity;
}

void Drag::add(const StepProblem& problem, StepData& data, const Assembler& assembler, std::span<double> values) const {
  if (!problem.parameters->dragged || !problem.resists()) return;
  const int n = problem.model.dof_count;
  const double inverse = 1.0 / problem.interval;
  data.velocity = inverse * (data.z - problem.start->q);
  multiply(problem.model, problem.drag, data.velocity, data.drag_force);
  data.gradient.head(n) += data.drag_force;
  data.row_magnitude.head(n) += data.drag_force.cwiseAbs();
  if (!values.empty()) add_mass_matrix(problem, problem.drag, inverse, assembler, values);
}

void Drag::add_adjoint(const StepProblem& problem, const StepData& data, const Assembler&, StepAdjoint& adjoint) const {
  if (!problem.moves()) return;
  const double inverse = 1.0 / problem.interval;
  const VectorX velocity = inverse * (data.z - problem.start->q);
  add_mass_adjoint(problem.model, velocity, adjoint.rows, adjoint.coefficients.drag,
                   adjoint.coefficients.drag_coupling);
  VectorX force;
  multiply(problem.model, problem.drag, adjoint.rows, force);
  adjoint.start -= inverse * force;
}

double Drag::dissipated(const StepProblem& problem, const StepData& data, const Assembler&,
                        const VectorX& change) const {
  return problem.parameters->dragged && problem.resists() ? data.drag_force.dot(change) : 0.0;
}

}  // namespace withe
