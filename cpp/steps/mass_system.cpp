#include "steps/mass_system.hpp"

#include "common/check.hpp"
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

void MassSystem::begin(const State& state, const Parameters& parameters) {
  const Model& model = problem_.model;
  problem_.start = &state;
  problem_.parameters = &parameters;
  if (problem_.version != parameters.version || model.has_bodies()) set_mass(model, parameters, problem_.mass);
  problem_.version = parameters.version;
  if (model.has_bodies()) turn_bodies(model, parameters, state, problem_.mass);
  const std::span<double> values = assembler_.solver().values();
  std::fill(values.begin(), values.end(), 0.0);
  add_mass_matrix(problem_, problem_.mass, 1.0, assembler_, values);
  if (loops_) {
    data_.z = state.q;
    data_.gradient.setZero(model.dof_count + kPadding);
    data_.row_magnitude.setZero(model.dof_count + kPadding);
    loops_->begin(problem_);
    loops_->add(problem_, data_, assembler_, values);
  }
  if (!model.carried.empty()) {
    carrying_.assign(model.carried.size(), Carrying{});
    assembler_.fold_carried([&](std::size_t i, bool needed) {
      Carrying& part = carrying_[i];
      if (needed && !part.known) find_carrying(problem_, state.q, i, part);
      return part.known ? &part : nullptr;
    });
  }
  assembler_.project_matrix();
  require(assembler_.solver().factorize().status == FactorStatus::ok, "the masses of the scene must be positive");
}

void MassSystem::fold(VectorX& rows) const {
  unused_.setZero(rows.size());
  fold_rows(problem_, problem_.start->q, rows, unused_);
}

void MassSystem::solve(VectorX& rows) {
  assembler_.project(rows);
  assembler_.solver().solve({rows.data(), static_cast<std::size_t>(rows.size())});
  expand_step(problem_, problem_.start->q, rows);
  const Model& model = problem_.model;
  for (const Loop& loop : model.loops) rows.segment(loop.dof, model.loop_size()).setZero();
}

}  // namespace withe
