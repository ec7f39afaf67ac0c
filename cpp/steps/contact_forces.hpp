#pragma once
/// Contact among the equations. It acts at the end of the step: its forces are those there, and its matrix counts twice
/// where z is the middle.

#include "contact/contact.hpp"
#include "steps/term.hpp"

namespace withe {

class ContactForces final : public Term {
 public:
  explicit ContactForces(const Model& model) : contact_(model) {}

  Contact& contact() { return contact_; }
  const Contact& contact() const { return contact_; }

  void begin(StepProblem& problem) override;
  void find(const StepProblem& problem, StepData& data, Assembler& assembler, bool with_matrix) override;
  void add(const StepProblem& problem, StepData& data, const Assembler& assembler,
           std::span<double> values) const override;

  /// How much of a step of z contact allows, from 0 to 1.
  double allowed(const StepProblem& problem, const VectorX& z, const VectorX& step);
  /// Tells contact of a step of Newton's method from where it was last evaluated, of which `kept` is left.
  void foresee(const StepProblem& problem, const VectorX& step, double kept);
  /// What contact takes from the motion over `change`, and from obstacles that move, and does not store [J].
  double loss(const StepData& data, const VectorX& change, double obstacle_work) const;

 private:
  Contact contact_;
  VectorX end_, change_;  ///< scratch
};

}  // namespace withe
