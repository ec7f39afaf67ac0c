#pragma once
/// Inertia: of nodes, of edges that spin and turn, and of frames.

#include "steps/term.hpp"

namespace withe {

/// M ((z - q0) / h^2 - v0 / h), and what turning adds. Under backward Euler an edge that spins at omega and turns also
/// needs the couple I omega t x dt/dt; under the midpoint rules angular momentum is kept exactly (turning_inertia.hpp).
/// Derivatives of what turning adds are a small part of the mass term, and unsymmetric: they are in exact matrices
/// alone.
class Inertia final : public Term {
 public:
  Inertia(const Model& model, bool exact);

  void declare(std::vector<ElementTable*>& tables) override { tables.push_back(&edges_); }
  void add(const StepProblem& problem, StepData& data, const Assembler& assembler,
           std::span<double> values) const override;
  void add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   StepAdjoint& adjoint) const override;

 private:
  ElementTable edges_;  ///< tail, angle, head; in space, where the matrix is exact
};

/// Entries of a matrix such as that of masses: its diagonal, and what couples nodes off it.
void add_mass_matrix(const StepProblem& problem, const MassMatrix& mass, double factor, const Assembler& assembler,
                     std::span<double> values);

/// Adds to the gradient the couple of an edge that spins and turns with velocities v.
void add_explicit_spin_couple(const StepProblem& problem, StepData& data, int edge, const VectorX& v);

/// Greatest change of an angle in an energy-momentum step, whose equations hold for less than half a turn [rad].
double farthest_turn(const Model& model, const VectorX& q0, const VectorX& q1);
/// Velocities of angles at the end of an energy-momentum step that changes the unknowns by `change`.
void set_turning_velocities(const Model& model, const VectorX& v0, const VectorX& change, double dt, VectorX& v1);
/// Derivatives of these velocities by `change`, per unknown: 2 / dt where it turns nothing.
void set_velocity_rates(const Model& model, const VectorX& change, double dt, VectorX& rates);
/// Displacement over which forces of an energy-momentum step do work: its change of the unknowns, but for angles and
/// frames, whose torques and moments are those about where they are in the middle.
void set_working_change(const StepProblem& problem, const StepData& data, const VectorX& change, VectorX& working);
/// Work of elastic torques on what supports hold over the working change, less that over `change` itself [J].
double finite_turn_work(const StepProblem& problem, const StepData& data, const VectorX& change,
                        const VectorX& working);

}  // namespace withe
