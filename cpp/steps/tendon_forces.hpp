#pragma once
/// Tendons through guides on edges, see forces/tendon.hpp.

#include "forces/tendon.hpp"
#include "steps/term.hpp"

namespace withe {

class DiscreteAdjoint;

class TendonForces final : public Term {
 public:
  explicit TendonForces(const Model& model);

  void declare(std::vector<ElementTable*>& tables) override { tables.push_back(&table_); }
  std::string note() const override;
  void add(const StepProblem& problem, StepData& data, const Assembler& assembler,
           std::span<double> values) const override;
  void add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   StepAdjoint& adjoint) const override;
  void add_rounding(const StepProblem& problem, StepData& data) const override;
  void add_applied(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   VectorX& force) const override;

 private:
  void evaluate(const StepProblem& problem, const StepData& data, int segment, double tension, bool with_matrix,
                TendonLocal& out) const;

  void add_frame_adjoint(const StepProblem& problem, const StepData& data, int segment,
                         const double (&rows)[kTendonUnknowns], StepAdjoint& adjoint) const;
  void add_discrete_adjoint(const StepProblem& problem, const StepData& data, int segment, DiscreteAdjoint& discrete,
                            StepAdjoint& adjoint) const;

  std::vector<TendonSegment> segments_;
  ElementTable table_;
};

}  // namespace withe
