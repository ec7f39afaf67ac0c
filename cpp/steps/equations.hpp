#pragma once
/// The equations of a scene's steps under one scheme: its terms, and the matrix that they share.

#include <memory>
#include <string>
#include <vector>

#include "assembly/assembler.hpp"
#include "steps/terms.hpp"

namespace withe {

/// Memory for later solves.
struct EquationsMemory {
  /// Contacts whose unknowns the order of elimination was found for, and those in the matrix; sorted.
  std::vector<ContactKey> ordered, coupled;
  std::vector<std::vector<int>> groups;  ///< of unknowns that custom forces couple
  std::vector<double> matrix;            ///< whose factorisation is in use; empty: none
  double flow_excess = 0;
  StokesletFluid::Memory fluid;
};

/// Options that determine the form of the equations.
struct EquationOptions {
  StepRule rule = StepRule::midpoint;
  double static_duration = 0;  ///< in which slip happens in statics [s]
  SolverKind solver = SolverKind::automatic;
  /// True if matrices have every derivative, and those of held unknowns and by them: then not projected, often
  /// unsymmetric.
  bool exact = false;
};

class Equations {
 public:
  Equations(const Model& model, const EquationOptions& options);
  Equations(const Equations&) = delete;
  Equations& operator=(const Equations&) = delete;

  const Model& model() const { return problem_.model; }
  /// The problem that has begun last.
  const StepProblem& problem() const { return problem_; }
  Assembler& assembler() { return assembler_; }
  const Assembler& assembler() const { return assembler_; }
  Loads& loads() { return problem_.loads; }
  const Loads& loads() const { return problem_.loads; }
  const MassMatrix& mass() const { return problem_.mass; }
  ElasticCoefficients& elastic() { return problem_.elastic; }
  const ElasticCoefficients& elastic() const { return problem_.elastic; }
  /// In words, what makes the Jacobian unsymmetric.
  const std::vector<std::string>& asymmetries() const { return asymmetries_; }
  /// Notes of the terms for the plan.
  std::vector<std::string> notes() const;
  /// True where statics minimise a potential.
  bool has_potential() const { return has_potential_; }
  /// True if there is a potential with the contacts of the last evaluation: none of them has friction.
  bool has_potential_here() const;

  const std::vector<std::unique_ptr<Term>>& terms() const { return terms_.all; }

  /// Nothing where nothing can touch.
  Contact* contact() { return terms_.contact ? &terms_.contact->contact() : nullptr; }
  const Contact* contact() const { return terms_.contact ? &terms_.contact->contact() : nullptr; }
  void forget_contacts();
  /// Nothing where no hand yields.
  HandForces* hands() { return terms_.hands; }
  /// Share of a step of z that contact allows, from 0 to 1.
  double allowed(const VectorX& z, const VectorX& step);
  /// True if anything touches at z: what is evaluated next.
  bool touches(const VectorX& z);
  /// Predicts the friction of a step of Newton's method from the last evaluation, of which `kept` is left.
  void predict_friction(const VectorX& step, double kept, ContactLinearisation& linearisation);
  double contact_loss(const StepData& data, const VectorX& change, double obstacle_work) const;

  /// Prepares a step from `state` over h (0: statics). The state, the parameters and what is prescribed must outlive
  /// it. `held_acceleration`: of what supports hold, see StepProblem.
  void begin(const State& state, const Parameters& parameters, StepRule rule, double h,
             const Prescribed& prescribed = Prescribed::nothing(), const VectorX* held_acceleration = nullptr);
  /// True if Stokeslets act: then `begin_flow` follows `begin`, with velocities `v` at positions `q`. False where no
  /// solution was found.
  bool flows() const { return terms_.stokeslets != nullptr; }
  bool begin_flow(const VectorX& q, const VectorX& v);
  double flow_excess() const { return terms_.stokeslets->excess(); }
  void forget_flow();

  /// Residual at z, and the matrix when asked for. `axial_force`: see stretch_hessian. `contact`: how Newton's method
  /// takes it.
  void evaluate(const VectorX& z, bool with_matrix, const double* axial_force, StepData& data,
                const ContactLinearisation& contact = {});
  /// Forces without inertia at the start of the problem, whose configuration the data has, with velocities v: the full
  /// residual alone. No contact, viscosity, drag or fluid.
  void evaluate_forces(const VectorX& v, StepData& data) const;

  /// True if anything but contact takes energy from the motion.
  bool dissipates(const Parameters& parameters) const;
  /// Energy that drag, viscosity, springs, joints and fluids dissipate over `change`, with the forces of the last
  /// evaluation [J].
  double dissipated(const StepData& data, const VectorX& change) const;
  bool loaded() const {
    return !loads().pieces.empty() || terms_.custom != nullptr ||
           (problem_.parameters->joint_moment.array() != 0.0).any() ||
           (problem_.parameters->tendon_tension.array() != 0.0).any();
  }
  /// Force of loads, motors of joints, tendons and custom forces in the last evaluation, per unknown.
  void load_force(const StepData& data, VectorX& out) const;

  /// Memory of solves for later ones, with the matrix if its factorisation may serve again.
  EquationsMemory memory(bool with_matrix) const;
  /// Goes on from there, but for the factorisation. False where there is no matrix to factorise.
  bool recall(const EquationsMemory& memory);
  /// From here on what would be lost of that is kept, until the next mark: copied once, when it is about to change.
  void mark() { mark_ = Mark::set; }
  bool marked() const { return mark_ != Mark::none; }
  /// Memory at the mark; nothing if it has not changed since.
  const EquationsMemory* since_mark() const { return mark_ == Mark::passed ? &at_mark_ : nullptr; }

 private:
  void set_parameters(const Parameters& parameters);
  void clear(const VectorX& z, StepData& data) const;
  void find(StepData& data, bool with_matrix);
  void finish(StepData& data) const;
  void order_for_contacts();
  void remember(EquationsMemory& out, bool with_matrix) const;
  void pass_mark();

  StepProblem problem_;
  Terms terms_;
  bool has_potential_ = true, only_friction_has_none_ = true;
  std::vector<std::string> asymmetries_;
  Assembler assembler_;
  double static_duration_;
  enum class Mark { none, set, passed };
  Mark mark_ = Mark::none;
  EquationsMemory at_mark_;
  std::vector<ContactKey> ordered_;  ///< contacts for which the assembler has found its order of elimination
};

}  // namespace withe
