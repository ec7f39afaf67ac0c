#pragma once
/// The equations of a scene's steps under one scheme: its terms, and the matrix that they share.

#include <memory>
#include <string>
#include <vector>

#include "assembly/assembler.hpp"
#include "steps/carried_parts.hpp"
#include "steps/joint_wrenches.hpp"
#include "steps/terms.hpp"

namespace withe {

/// Memory for later solves.
struct EquationsMemory {
  /// Contacts for which the order of elimination was determined, and contacts in the matrix; both sorted.
  std::vector<ContactKey> ordered, coupled;
  std::vector<std::vector<int>> groups;  ///< groups of unknowns that custom forces couple
  std::vector<double> matrix;            ///< matrix whose factorisation is in use; empty: none
  double flow_excess = 0;
  StokesletFluid::Memory fluid;
};

/// Options that determine the form of the equations.
struct EquationOptions {
  StepRule rule = StepRule::midpoint;
  double static_duration = 0;  ///< time in which slip happens in statics [s]
  SolverKind solver = SolverKind::automatic;
  /// True if matrices have every derivative, including the rows and columns of held unknowns. They are then not
  /// projected, and often unsymmetric.
  bool exact = false;
  WorkerPool* workers = nullptr;  ///< threads that share the work of these equations, which they must outlive; or null
};

class Equations {
 public:
  Equations(const Model& model, const EquationOptions& options);
  Equations(const Equations&) = delete;
  Equations& operator=(const Equations&) = delete;

  const Model& model() const { return problem_.model; }
  /// The problem that was begun last.
  const StepProblem& problem() const { return problem_; }
  Assembler& assembler() { return assembler_; }
  const Assembler& assembler() const { return assembler_; }
  Loads& loads() { return problem_.loads; }
  const Loads& loads() const { return problem_.loads; }
  const MassMatrix& mass() const { return problem_.mass; }
  ElasticCoefficients& elastic() { return problem_.elastic; }
  const ElasticCoefficients& elastic() const { return problem_.elastic; }
  /// Causes that make the Jacobian unsymmetric, in words.
  const std::vector<std::string>& asymmetries() const { return asymmetries_; }
  /// Notes of the terms for the plan.
  std::vector<std::string> notes() const;
  /// True where statics minimise a potential.
  bool has_potential() const { return has_potential_; }
  /// True if there is a potential with the contacts of the last evaluation: none of them has friction.
  bool has_potential_here() const;

  const std::vector<std::unique_ptr<Term>>& terms() const { return terms_.all; }

  /// Puts the parts that bodies carry where the bodies have them at z.
  void place(VectorX& z) const { place_carried(problem_, z); }
  /// Sets the displacements of these parts in a step from the last evaluation by those of the bodies.
  void expand(const StepData& data, VectorX& step) const { expand_step(problem_, data.z, step); }

  /// Null if no contact is possible in the scene.
  Contact* contact() { return terms_.contact ? &terms_.contact->contact() : nullptr; }
  const Contact* contact() const { return terms_.contact ? &terms_.contact->contact() : nullptr; }
  void forget_contacts();
  /// Null if no hand yields.
  HandForces* hands() { return terms_.hands; }
  /// Null if joints of bodies form no closed loop.
  const LoopForces* loops() const { return terms_.loops; }
  /// Share of a step of z that contact allows, from 0 to 1.
  double allowed(const VectorX& z, const VectorX& step);
  /// True if anything is in contact at z. Updates the contacts for an evaluation at z.
  bool touches(const VectorX& z);
  /// Predicts the friction of a step of Newton's method from the last evaluation. `kept`: share of its full length to
  /// which `step` has been shortened.
  void predict_friction(const VectorX& step, double kept, ContactLinearisation& linearisation);
  double contact_loss(const StepData& data, const VectorX& change, double obstacle_work) const;

  /// Prepares a step from `state` over h (0: statics). The state, the parameters and the prescribed motions must
  /// outlive it. `held_acceleration`: acceleration of supported unknowns, see StepProblem.
  void begin(const State& state, const Parameters& parameters, StepRule rule, double h,
             const Prescribed& prescribed = Prescribed::nothing(), const VectorX* held_acceleration = nullptr);
  /// True if Stokeslets act. Then `begin_flow` must follow `begin`, with velocities `v` at positions `q`. It returns
  /// false if no solution was found.
  bool flows() const { return terms_.stokeslets != nullptr; }
  bool begin_flow(const VectorX& q, const VectorX& v);
  double flow_excess() const { return terms_.stokeslets->excess(); }
  void forget_flow();

  /// Evaluates the residual at z, and the matrix if `with_matrix`. `axial_force`: see stretch_hessian. `contact`: the
  /// linearisation of contact in Newton's method.
  void evaluate(const VectorX& z, bool with_matrix, const double* axial_force, StepData& data,
                const ContactLinearisation& contact = {});
  /// Evaluates only the full residual: forces without inertia at the start of the problem, with velocities v. The data
  /// must have the configuration at the start. Contact, viscosity, drag and fluid are omitted.
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
  /// Sets the wrenches at joints of bodies, by the last evaluation of a problem whose start is not changed yet.
  void find_joint_wrenches(StepData& data) const {
    if (joint_wrenches_.any()) joint_wrenches_.find(problem_, assembler_, data);
  }
  /// Force of loads, motors of joints, tendons and custom forces in the last evaluation, per unknown.
  void load_force(const StepData& data, VectorX& out) const;

  /// Memory of solves for later ones, with the matrix if its factorisation may serve again.
  EquationsMemory memory(bool with_matrix) const;
  /// Restores this memory, except the factorisation. False if the memory has no matrix to factorise.
  bool recall(const EquationsMemory& memory);
  /// Marks the present memory. It is copied once, before it changes for the first time, and kept until the next mark.
  void mark() { mark_ = Mark::set; }
  bool marked() const { return mark_ != Mark::none; }
  /// Memory at the mark; null if it has not changed since.
  const EquationsMemory* since_mark() const { return mark_ == Mark::passed ? &at_mark_ : nullptr; }

 private:
  void set_parameters(const Parameters& parameters);
  void clear(const VectorX& z, StepData& data) const;
  void find(StepData& data, bool with_matrix);
  void fold(StepData& data, std::span<double> values);
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
  JointWrenches joint_wrenches_;
  enum class Mark { none, set, passed };
  Mark mark_ = Mark::none;
  EquationsMemory at_mark_;
  std::vector<ContactKey> ordered_;  ///< contacts for which the assembler has determined the order of elimination
};

}  // namespace withe
