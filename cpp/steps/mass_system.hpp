#pragma once
/// The masses of a scene as a system of equations: M x = b at a configuration, where held unknowns stay, parts that
/// bodies carry follow these, and closed loops of joints stay closed.

#include <memory>
#include <span>
#include <vector>

#include "assembly/assembler.hpp"
#include "steps/loop_forces.hpp"
#include "steps/step_problem.hpp"

namespace withe {

class MassSystem {
 public:
  /// The model must outlive it.
  explicit MassSystem(const Model& model);

  /// Factorises M at a state, which must outlive the calls that follow. False if closed loops have no independent rates
  /// there.
  bool begin(const State& state, const Parameters& parameters);
  /// Adds rows of parts that bodies carry to the rows of the bodies.
  void fold(VectorX& rows);
  /// Replaces folded rows b by x.
  void solve(VectorX& rows);
  /// Replaces velocities by the nearest ones, measured by M, with which closed loops stay closed. Held velocities stay.
  /// Returns the kinetic energy that this removes [J].
  double close_loops(VectorX& velocity) { return constrain(assembler_.held_part(velocity), velocity); }
  /// As `close_loops`, but held velocities become the given ones, by an impulse of the supports.
  double constrain(VectorX held, VectorX& velocity);
  const MassMatrix& mass() const { return problem_.mass; }

 private:
  void evaluate_loops(const VectorX& z, std::span<double> values);

  StepProblem problem_;
  std::unique_ptr<LoopForces> loops_;  ///< null if there are none
  Assembler assembler_;
  StepData data_;
  std::vector<Carrying> carrying_;
  VectorX unused_;
};

}  // namespace withe
