#pragma once
/// The masses of a scene as a system of equations: M x = b at a configuration, where held unknowns stay, parts that
/// bodies carry follow these, and closed loops of joints stay closed.

#include <memory>
#include <vector>

#include "assembly/assembler.hpp"
#include "steps/loop_forces.hpp"
#include "steps/step_problem.hpp"

namespace withe {

class MassSystem {
 public:
  /// The model must outlive it.
  explicit MassSystem(const Model& model);

  /// Factorises M at a state, which must outlive the calls that follow.
  void begin(const State& state, const Parameters& parameters);
  /// Adds rows of parts that bodies carry to the rows of the bodies.
  void fold(VectorX& rows) const;
  /// Replaces folded rows b by x.
  void solve(VectorX& rows);
  const MassMatrix& mass() const { return problem_.mass; }

 private:
  StepProblem problem_;
  std::unique_ptr<LoopForces> loops_;  ///< null if there are none
  Assembler assembler_;
  StepData data_;
  std::vector<Carrying> carrying_;
  mutable VectorX unused_;
};

}  // namespace withe
