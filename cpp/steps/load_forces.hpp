#pragma once
/// Loads that a user applies, see forces/loads.hpp.

#include "steps/term.hpp"

namespace withe {

class LoadForces final : public Term {
 public:
  LoadForces(const Model& model, const Loads& loads);

  void declare(std::vector<ElementTable*>& tables) override;
  bool has_potential() const override { return has_potential_; }
  void add(const StepProblem& problem, StepData& data, const Assembler& assembler,
           std::span<double> values) const override;
  void add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   StepAdjoint& adjoint) const override;
  void add_applied(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   VectorX& force) const override;

  /// Tables of one element each, per piece.
  const std::vector<ElementTable>& tables() const { return tables_; }

 private:
  std::vector<ElementTable> tables_;
  bool has_potential_;
};

/// Value of the load of a piece.
inline Vector3 value_of(const Parameters& parameters, const AppliedForces& custom, const LoadPiece& piece) {
  if (piece.load >= 0) return parameters.loads.row(piece.load);
  return custom.moments[static_cast<std::size_t>(piece.node)];
}

}  // namespace withe
