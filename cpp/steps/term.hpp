#pragma once
/// One kind of force in the equations of a step. One table names all terms, `make_terms` in terms.cpp. A scene has the
/// terms that it needs.

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "assembly/assembler.hpp"
#include "steps/step_adjoint.hpp"
#include "steps/step_problem.hpp"

namespace withe {

class Term {
 public:
  Term() = default;
  Term(const Term&) = delete;
  Term& operator=(const Term&) = delete;
  virtual ~Term() = default;

  /// Adds the tables of its own elements: the assembler makes room for them in the matrix, before any step.
  virtual void declare(std::vector<ElementTable*>& /*tables*/) {}
  /// True if its forces are minus the gradient of a potential.
  virtual bool has_potential() const { return true; }
  /// True if it takes energy from the motion.
  virtual bool dissipates(const Parameters&) const { return false; }
  /// Line for the plan; empty if there is none.
  virtual std::string note() const { return {}; }

  /// Computes the values that stay constant during a step that has just begun.
  virtual void begin(StepProblem&) {}
  /// Computes the forces at data.z before any term is added. If `with_matrix`, it reserves the entries of the matrix.
  virtual void find(const StepProblem&, StepData&, Assembler&, bool /*with_matrix*/) {}
  /// Adds forces (minus the generalised ones) to the rows, energies to the potential, and derivatives to the matrix:
  /// `values`, through the assembler's offsets. `values` is empty if no matrix is needed.
  virtual void add(const StepProblem&, StepData&, const Assembler&, std::span<double> values) const = 0;
  /// Adds only the forces at the start of an explicit step with velocities v. Forces that resist velocities are
  /// omitted.
  virtual void add_explicit(const StepProblem& problem, StepData& data, const Assembler& assembler,
                            const VectorX& /*v*/) const {
    add(problem, data, assembler, {});
  }
  /// Adds to data.floor the rounding errors of its rows in the last evaluation that exceed those of their magnitude.
  virtual void add_rounding(const StepProblem&, StepData&) const {}
  /// Energy dissipated over `change` with the forces of the last evaluation [J].
  virtual double dissipated(const StepProblem&, const StepData&, const Assembler&, const VectorX& /*change*/) const {
    return 0.0;
  }
  /// Adds rows^T times the derivatives of the contribution of `add`, by the input of the step, at z. Throws
  /// std::invalid_argument if the derivatives are unknown.
  virtual void add_adjoint(const StepProblem&, const StepData&, const Assembler&, StepAdjoint&) const = 0;
  /// Adds the forces that a user applies, of the last evaluation, to generalised forces.
  virtual void add_applied(const StepProblem&, const StepData&, const Assembler&, VectorX& /*force*/) const {}
};

/// Adds the forces on one element to the rows and, if `values` is not empty, to the matrix.
template <int size>
void add_element(const ElementTable& table, int element, const LocalOf<size>& local, StepData& data,
                 std::span<double> values) {
  table.add_gradient(element, local.gradient, 1.0, data.gradient, data.row_magnitude);
  if (!values.empty()) table.add_hessian(element, local.hessian, 1.0, values);
}

/// Work of the forces on one element over `change` [J].
inline double work_of(const ElementTable& table, int element, const Local& local, const VectorX& change) {
  const int* dofs = table.dofs(element);
  double work = 0.0;
  for (int i = 0; i < table.width(); ++i)
    if (dofs[i] >= 0) work += local.gradient[i] * change[dofs[i]];
  return work;
}

/// Multipliers of the rows of one element.
template <int size>
void gather(const ElementTable& table, int element, const VectorX& rows, double (&out)[size]) {
  const int* dofs = table.dofs(element);
  for (int i = 0; i < table.width(); ++i) out[i] = dofs[i] >= 0 ? rows[dofs[i]] : 0.0;
}

}  // namespace withe
