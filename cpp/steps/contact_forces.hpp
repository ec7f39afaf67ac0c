#pragma once
/// Contact in the equations. It acts at the end of the step: its forces are the forces at the end. If z is the middle
/// of the step, its matrix counts twice.

#include "steps/contact_rows.hpp"
#include "steps/term.hpp"

namespace withe {

class ContactForces final : public Term {
 public:
  explicit ContactForces(const Model& model);

  Contact& contact() { return contact_; }
  const Contact& contact() const { return contact_; }
  ContactRows& rows() { return rows_; }
  const ContactRows& rows() const { return rows_; }

  bool has_potential() const override { return !contact_.frictional(); }
  void begin(StepProblem& problem) override;
  void find(const StepProblem& problem, StepData& data, Assembler& assembler, bool with_matrix) override;
  void add(const StepProblem& problem, StepData& data, const Assembler& assembler,
           std::span<double> values) const override;
  void add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   StepAdjoint& adjoint) const override;
  void add_rounding(const StepProblem& problem, StepData& data) const override;

  /// True if anything is in contact at z. Updates the contacts for an evaluation at z.
  bool touches(const StepProblem& problem, const VectorX& z);
  /// Share of a step of z that contact allows, from 0 to 1.
  double allowed(const StepProblem& problem, const VectorX& z, const VectorX& step);
  /// Predicts the friction of a step of Newton's method from the last evaluation. `kept`: share of its full length to
  /// which `step` has been shortened.
  void predict_friction(const StepProblem& problem, const VectorX& step, double kept,
                        ContactLinearisation& linearisation);
  /// Energy that contact removes from the motion over `change`, and from moving obstacles, without storing it [J].
  double loss(const StepData& data, const VectorX& change, double obstacle_work) const;

 private:
  Contact contact_;
  ContactRows rows_;
  VectorX end_, change_;  ///< scratch
};

}  // namespace withe
