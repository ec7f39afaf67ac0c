#pragma once
/// Custom forces in the equations: see forces/custom_forces.hpp.

#include "steps/load_forces.hpp"

namespace withe {

class CustomTerm final : public Term {
 public:
  /// `loads` has the pieces of moments, if there are any, and must outlive the term.
  explicit CustomTerm(const LoadForces* loads) : loads_(loads) {}

  bool has_potential() const override { return false; }
  void find(const StepProblem& problem, StepData& data, Assembler& assembler, bool with_matrix) override;
  void add(const StepProblem& problem, StepData& data, const Assembler& assembler,
           std::span<double> values) const override;
  void add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   StepAdjoint& adjoint) const override;
  void add_applied(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   VectorX& force) const override;

 private:
  template <class Add>
  void for_each_derivative(const StepProblem& problem, const Add& add) const;
  void couple(const StepProblem& problem, Assembler& assembler);
  void add_matrix(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                  std::span<double> values) const;

  const LoadForces* loads_;
  CustomForces found_;                                   ///< of the last evaluation with a matrix, with derivatives
  std::vector<std::vector<std::size_t>> moment_pieces_;  ///< pieces of custom moments, per node
};

/// Converts forces and moments (if there are any), per node in world axes, to the form of the equations.
AppliedForces applied_forces(const Model& model, const MatrixX3& forces, const MatrixX3& moments);
/// Custom forces of a problem that does not solve for them.
AppliedForces given_forces(const StepProblem& problem);

}  // namespace withe
