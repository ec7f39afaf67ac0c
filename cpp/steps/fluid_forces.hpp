#pragma once
/// The force of a viscous fluid, by either model.

#include <memory>

#include "forces/resistive.hpp"
#include "forces/stokeslets.hpp"
#include "steps/term.hpp"

namespace withe {

/// Resistive-force theory: each edge independently of the others.
class ResistiveForces final : public Term {
 public:
  explicit ResistiveForces(const Model& model);

  bool dissipates(const Parameters&) const override { return true; }
  void add(const StepProblem& problem, StepData& data, const Assembler& assembler,
           std::span<double> values) const override;
  void add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   StepAdjoint& adjoint) const override;
  double dissipated(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                    const VectorX& change) const override;

 private:
  ResistiveEdge edge_of(const StepProblem& problem, const StepData& data, int edge) const;

  std::vector<ResistiveCoefficients> resistance_;  ///< per edge
};

/// Regularised Stokeslets: all edges act on each other. Velocities `v` and positions `q` are given before the step. The
/// force of the fluid is the force at these, plus a local drag on the difference between the velocities of the step and
/// `v`; see fluid_forces.cpp.
class StokesletForces final : public Term {
 public:
  explicit StokesletForces(const Model& model) : fluid_(model) {}

  bool dissipates(const Parameters&) const override { return true; }
  void begin(StepProblem& problem) override;
  /// Must be called after a step has begun. Returns false if no solution was found.
  bool solve(const StepProblem& problem, const VectorX& q, const VectorX& v);
  void add(const StepProblem& problem, StepData& data, const Assembler& assembler,
           std::span<double> values) const override;
  void add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   StepAdjoint& adjoint) const override;
  double dissipated(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                    const VectorX& change) const override;

  /// Factor by which the local drag of the last step exceeded the drag of single rods; 0: unknown.
  double excess() const { return excess_; }
  /// Discards all data of earlier solutions.
  void forget();
  const StokesletFluid::Memory& memory() const { return fluid_.memory(); }
  void recall(const StokesletFluid::Memory& memory, double excess);

 private:
  StokesletFluid fluid_;
  MassMatrix drag_;        ///< local drag [N s/m]
  VectorX start_, local_;  ///< force of the fluid without the local drag [N]
  VectorX inertia_;        ///< per node, mass over viscosity and step [m]
  double excess_ = 0;
  long version_ = -1;  ///< version of the parameters of the local drag
  bool acts_ = false;
};

}  // namespace withe
