#pragma once
/// Springs between nodes, see forces/spring.hpp.

#include "forces/spring.hpp"
#include "steps/term.hpp"

namespace withe {

class SpringForces final : public Term {
 public:
  explicit SpringForces(const Model& model);

  void declare(std::vector<ElementTable*>& tables) override { tables.push_back(&table_); }
  bool dissipates(const Parameters& parameters) const override;
  std::string note() const override;
  void add(const StepProblem& problem, StepData& data, const Assembler& assembler,
           std::span<double> values) const override;
  void add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   StepAdjoint& adjoint) const override;
  void add_rounding(const StepProblem& problem, StepData& data) const override;
  double dissipated(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                    const VectorX& change) const override;

 private:
  ElementTable table_;
};

/// Energy of one spring at q [J].
double spring_energy(const Model& model, const PartNumbers& numbers, const VectorX& q, int spring);
/// n of one spring, with velocities v [N].
double spring_tension(const Model& model, const Parameters& parameters, const VectorX& q, const VectorX& v, int spring);

}  // namespace withe
