#pragma once
/// Globalisation of Newton's method between surfaces.
///
/// Contact and friction turn on and off, so full steps may alternate for ever. A step is kept at a length that passes
/// one of two tests. The first needs one evaluation: the potential still decreases along the step at its end, and less
/// steeply than at its start. The second is the natural monotonicity test: the next step with the same matrix is
/// smaller [Deuflhard 2011, section 3.3]. It compares displacements only, so forces and moments need no common scale.
///
/// Contact has negative geometric stiffness where surfaces slide off each other. With much of it a step may lead
/// uphill, to an unstable equilibrium. If only little of such a step can be kept, it is computed again without that
/// stiffness.

#include "integrators/newton_system.hpp"
#include "integrators/step_norms.hpp"

namespace withe {

class SurfaceSearch {
 public:
  SurfaceSearch(const StepNorms& norms, const NewtonSystem& system, const Without& heuristics)
      : norms_(norms), system_(system), heuristics_(heuristics) {}

  /// Shortens a step from z so that nothing turns or moves too far, and no surfaces come too near. Returns the factor.
  double shortened(const VectorX& z, VectorX& step) const;
  /// Shortens `work.step`, already shortened by `shorten`, until it passes a test. False if no step could be computed.
  bool run(const VectorX& z, double& shorten);
  void forget() { evaluated_ = solved_ = remade_ = false; }

  /// True if the end of the step is in `work.trial`, and evaluated without matrix.
  bool evaluated() const { return evaluated_; }
  /// True if `work.next_step` is the step from there with the same matrix.
  bool solved() const { return solved_; }
  /// True if the step was solved again with a matrix that lacks geometric stiffness.
  bool remade() const { return remade_; }

 private:
  double search(const VectorX& z, double least, double shorten);

  const StepNorms& norms_;
  const NewtonSystem& system_;
  const Without& heuristics_;
  bool evaluated_ = false, solved_ = false, remade_ = false;
};

}  // namespace withe
