#pragma once
/// The force of a viscous fluid, by either model.

#include <memory>

#include "forces/resistive.hpp"
#include "forces/stokeslets.hpp"
#include "steps/term.hpp"

namespace withe {

/// Resistive-force theory: each edge for itself.
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

/// Regularised Stokeslets: all edges on each other. The fluid's force is that on velocities `v` at positions `q`, given
/// before the step, and a local drag for what the velocities of the step differ from them; see fluid_forces.cpp.
class StokesletForces final : public Term {
 public:
  explicit StokesletForces(const Model& model) : fluid_(model) {}

  bool dissipates(const Parameters&) const override { return true; }
  void begin(StepProblem& problem) override;
  /// After a step has begun. False where no solution was found.
  bool solve(const StepProblem& problem, const VectorX& q, const VectorX& v);
  void add(const StepProblem& problem, StepData& data, const Assembler& assembler,
           std::span<double> values) const override;
  void add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   StepAdjoint& adjoint) const override;
  double dissipated(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                    const VectorX& change) const override;

  /// By which the local drag of the last step was greater than that of single rods; 0: not known.
  double excess() const { return excess_; }
  /// Without what earlier solutions left behind.
  void forget();
  const StokesletFluid::Memory& memory() const { return fluid_.memory(); }
  void recall(const StokesletFluid::Memory& memory, double excess);

 private:
  StokesletFluid fluid_;
  MassMatrix drag_;        ///< local [N s/m]
  VectorX start_, local_;  ///< the fluid's force but for the local drag [N]
  VectorX inertia_;        ///< per node, mass over viscosity and step [m]
  double excess_ = 0;
  long version_ = -1;  ///< of the parameters that the local drag belongs to
  bool acts_ = false;
};

}  // namespace withe
