#pragma once
/// Gravity and drag.

#include "steps/term.hpp"

namespace withe {

class Gravity final : public Term {
 public:
  void add(const StepProblem& problem, StepData& data, const Assembler& assembler,
           std::span<double> values) const override;
  void add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   StepAdjoint& adjoint) const override;
  void add_explicit(const StepProblem& problem, StepData& data, const Assembler& assembler,
                    const VectorX& v) const override;
};

/// D (z - q0) / h.
class Drag final : public Term {
 public:
  bool dissipates(const Parameters& parameters) const override { return parameters.dragged; }
  void add(const StepProblem& problem, StepData& data, const Assembler& assembler,
           std::span<double> values) const override;
  void add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   StepAdjoint& adjoint) const override;
  double dissipated(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                    const VectorX& change) const override;
};

/// Gravity's force per unknown.
void set_gravity_force(const Model& model, const Parameters& parameters, VectorX& force);

}  // namespace withe
