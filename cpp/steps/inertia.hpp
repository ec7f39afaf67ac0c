#pragma once
/// Inertia: of nodes, of edges that spin and turn, and of frames.

#include "steps/term.hpp"

namespace withe {

/// M ((z - q0) / h^2 - v0 / h), and the contribution of turning. Under backward Euler an edge that spins at omega and
/// turns also needs the couple I omega t x dt/dt. The midpoint rules conserve angular momentum exactly
/// (turning_inertia.hpp). Derivatives of the contribution of turning are a small part of the mass term, and they are
/// unsymmetric. Only exact matrices contain them.
class Inertia final : public Term {
 public:
  Inertia(const Model& model, bool exact);

  void declare(std::vector<ElementTable*>& tables) override { tables.push_back(&edges_); }
  void add(const StepProblem& problem, StepData& data, const Assembler& assembler,
           std::span<double> values) const override;
  void add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   StepAdjoint& adjoint) const override;

 private:
  ElementTable edges_;  ///< tail, angle, head; only in space, with an exact matrix
};

/// Entries of a matrix such as the mass matrix: its diagonal, and the entries off the diagonal that couple nodes.
void add_mass_matrix(const StepProblem& problem, const MassMatrix& mass, double factor, const Assembler& assembler,
                     std::span<double> values);

/// Adds to the gradient the couple of an edge that spins and turns with velocities v.
void add_explicit_spin_couple(const StepProblem& problem, StepData& data, int edge, const VectorX& v);

/// Greatest change of an angle in an energy-momentum step, whose equations hold for less than half a turn [rad].
double farthest_turn(const Model& model, const VectorX& q0, const VectorX& q1);
/// Velocities of angles at the end of an energy-momentum step that changes the unknowns by `change`.
void set_turning_velocities(const Model& model, const VectorX& v0, const VectorX& change, double dt, VectorX& v1);
/// Angular velocities of bodies at the end of a midpoint step: the mean of their rates about the axes of the body at
/// both ends is that of the step.
void set_body_velocities(const Model& model, const VectorX& v0, const VectorX& change, double dt, VectorX& v1);
/// Moves what is left of the residual of bodies into their angular velocities. The angular momentum of a body that
/// tumbles for many turns then collects neither rounding nor the tolerance of Newton's method. With closed loops of
/// joints, the linear momentum of bodies does not, either.
void balance_bodies(const StepProblem& problem, const StepData& data, VectorX& v1);
/// Derivatives of these velocities by `change`, per unknown: 2 / dt for unknowns that are not angles.
void set_velocity_rates(const Model& model, const VectorX& change, double dt, VectorX& rates);
/// Displacement over which forces of an energy-momentum step do work. It is the change of the unknowns, except for
/// angles and frames: their torques and moments are about their positions in the middle of the step.
void set_working_change(const StepProblem& problem, const StepData& data, const VectorX& change, VectorX& working);
/// Work of elastic torques on supported unknowns over the working change, minus their work over `change` itself [J].
double finite_turn_work(const StepProblem& problem, const StepData& data, const VectorX& change,
                        const VectorX& working);

}  // namespace withe
