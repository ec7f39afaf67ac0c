#pragma once
/// Torques of revolute joints, see forces/joint.hpp.

#include "forces/joint.hpp"
#include "steps/term.hpp"

namespace withe {

class JointForces final : public Term {
 public:
  explicit JointForces(const Model& model);

  void declare(std::vector<ElementTable*>& tables) override { tables.push_back(&table_); }
  bool dissipates(const Parameters& parameters) const override;
  void add(const StepProblem& problem, StepData& data, const Assembler& assembler,
           std::span<double> values) const override;
  void add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   StepAdjoint& adjoint) const override;
  void add_rounding(const StepProblem& problem, StepData& data) const override;
  double dissipated(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                    const VectorX& change) const override;
  void add_applied(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   VectorX& force) const override;

 private:
  ElementTable table_;
  bool stops_dissipate_ = false;
};

/// Torque of the motor, spring, damper and stops of a joint.
JointTorque joint_torque(const Model& model, const Parameters& parameters, const ElasticCoefficients& elastic,
                         int joint);
/// Notes in a state, which is that at the start of the problem, the rates at which joints meet stops in a step to q1.
void enter_stops(const StepProblem& problem, const VectorX& q1, State& state);
/// Torque of a joint in a step [N m]: minus the row of the unknown `JointAngle::turning`, and the row of `against`.
double joint_row(const StepProblem& problem, const StepData& data, int joint);
/// Energy of the spring and the stops of one joint at q [J].
double joint_energy(const Model& model, const PartNumbers& numbers, const VectorX& q, int joint);

}  // namespace withe
