#include "steps/mass_system.hpp"

#include "steps/carried_parts.hpp"
#include "steps/inertia.hpp"

namespace withe {
namespace {

std::vector<ElementTable*> tables_of(LoopForces* loops) {
  std::vector<ElementTable*> tables;
  if (loops != nullptr) loops->declare(tables);
  return tables;
}

}  // namespace

MassSystem::MassSystem(const Model& model)
    : problem_(model),
      loops_(model.loops.empty() ? nullptr : std::make_unique<LoopForces>(model)),
      assembler_(model, tables_of(loops_.get()), loops_ ? Symmetry::unsymmetric : Symmetry::symmetric,
                 SolverKind::automatic) {
  problem_.rule = StepRule::settling;
  problem_.interval = 1.0;
  problem_.prescribed = &Prescribed::nothing();
}

bool MassSystem::begin(const State& state, const Parameters& parameters) {
  const Model& model = problem_.model;
  problem_.start = &state;
  problem_.parameters = &parameters;
  if (problem_.version != parameters.version) set_mass(model, parameters, problem_.mass);
  problem_.version = parameters.version;
  if (model.has_bodies()) turn_bodies(model, parameters, state, problem_.mass);
  const std::span<double> values = assembler_.solver().values();
  std::fill(values.begin(), values.end(), 0.0);
  add_mass_matrix(problem_, problem_.mass, 1.0, assembler_, values);
  if (loops_) {
    loops_->begin(problem_);
    evaluate_loops(state.q, values);
  }
  if (!model.carried.empty()) {
    carrying_.assign(model.carried.size(), Carrying{});
    fold_matrix(problem_, state.q, carrying_, assembler_);
  }
  assembler_.project_matrix();
  return assembler_.solver().factorize().status == FactorStatus::ok;
}

void MassSystem::fold(VectorX& rows) {
  unused_.setZero(rows.size());
  fold_rows(problem_, problem_.start->q, rows, unused_);
}

void MassSystem::solve(VectorX& rows) {
  assembler_.project(rows);
  assembler_.solver().solve({rows.data(), static_cast<std::size_t>(rows.size())});
  expand_step(problem_, problem_.start->q, rows);
  clear_multipliers(problem_.model, rows);
}

/// Sets the rows of closed loops at z in data_, and adds their derivatives to a matrix.
void MassSystem::evaluate_loops(const VectorX& z, std::span<double> values) {
  data_.z = z;
  data_.gradient.setZero(z.size() + kPadding);
  data_.row_magnitude.setZero(z.size() + kPadding);
  loops_->add(problem_, data_, assembler_, values);
}

/// The sum of held velocities h and x that minimises (v - h - x) . M (v - h - x) with G (h + x) = 0, G the rates of the
/// constraints. Rows of loops are linear: their change from q to q + h has the right-hand side of G x = -G h.
double MassSystem::constrain(VectorX held, VectorX& velocity) {
  const Model& model = problem_.model;
  const VectorX& q = problem_.start->q;
  const double before = kinetic_energy(model, problem_.mass, velocity);
  expand_step(problem_, q, held);
  VectorX rows;
  multiply(model, problem_.mass, velocity - held, rows);
  if (loops_) {
    evaluate_loops(q, {});
    rows += data_.gradient.head(model.dof_count);
    evaluate_loops(q + held, {});
    rows -= data_.gradient.head(model.dof_count);
  }
  fold(rows);
  solve(rows);
  velocity = held + rows;
  return before - kinetic_energy(model, problem_.mass, velocity);
}

}  // namespace withe
