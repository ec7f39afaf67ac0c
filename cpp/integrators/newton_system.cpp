#include "integrators/newton_system.hpp"

#include <cmath>

#include "common/timer.hpp"

namespace withe {

bool factorize(Equations& equations, NewtonWorkspace& work, bool hold_neutral) {
  const Timer timer(work.counters.solve_time);
  LinearSolver& solver = equations.assembler().solver();
  ++work.counters.factorizations;
  const auto shifted = [&] {
    return solver.factorize({work.trial.data(), static_cast<std::size_t>(work.trial.size())}).status ==
           FactorStatus::ok;
  };
  if (hold_neutral) {
    work.trial = neutral_shift(equations, kEpsilon);
    if (shifted()) return true;
  } else if (solver.factorize().status == FactorStatus::ok) {
    return true;
  }
  const double greatest = equations.assembler().greatest_diagonal();
  work.trial.setConstant(equations.model().dof_count, 1e-12 * greatest);
  return greatest > 0.0 && shifted();
}

VectorX neutral_shift(const Equations& equations, double share) {
  VectorX shift(equations.model().dof_count);
  for (int i = 0; i < equations.model().dof_count; ++i) shift[i] = share * std::abs(equations.assembler().diagonal(i));
  return shift;
}

void NewtonSystem::evaluate(const VectorX& z, bool matrix, const double* axial_force) const {
  const Timer timer(work.counters.assembly_time);
  ++work.counters.evaluations;
  equations.evaluate(z, matrix, axial_force, work.data, work.contact);
  if (target) work.data.residual -= *target;
}

void NewtonSystem::solve_for(VectorX& step) const {
  const Timer timer(work.counters.solve_time);
  step = -work.data.residual;
  equations.assembler().solver().solve({step.data(), static_cast<std::size_t>(step.size())});
  equations.expand(work.data, step);
}

}  // namespace withe
