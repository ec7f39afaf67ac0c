#pragma once
/// Rings that rods pass through, see forces/ring.hpp: the part of `HandForces` that slides along rods.

#include <vector>

#include "forces/ring.hpp"
#include "model/rod_curve.hpp"
#include "steps/term.hpp"

namespace withe {

class RingForces {
 public:
  explicit RingForces(const Model& model);

  ElementTable& table() { return table_; }
  int count() const { return static_cast<int>(rings_.size()); }
  /// True if any ring can slip along its rod, because of friction or a limit.
  bool slips() const { return slips_; }

  void add(const StepProblem& problem, StepData& data, std::span<double> values) const;
  void add_rounding(const StepProblem& problem, StepData& data) const;
  /// Energy that slip dissipates in a step whose forces act at `z` [J].
  double dissipated(const StepProblem& problem, const VectorX& z) const;
  /// Work of rings and their drives in a step that ends at `q1` [J].
  double work(const StepProblem& problem, const VectorX& q1) const;
  /// Moves the rings of a state to the end of a step. The hands of the state are already there. Returns the energy that
  /// remains in rings that rods have left [J].
  double accept(State& state) const;

 private:
  struct Held {
    int support = 0, first_element = 0;
  };

  const Model& model_;
  std::vector<Held> rings_;
  ElementTable table_;
  bool slips_ = false;
};

/// Passage of a rod through a ring.
struct Passage {
  SplinePlace place;
  Vector3 across = Vector3::Zero();  ///< r [m]
  double at = 0;                     ///< arc length [m]
  double slipped = 0;                ///< part of u beyond the limit [m]
  double tension = 0;                ///< T [N]
  double pull = 0;                   ///< P [N]
  double energy = 0;                 ///< [J]
};
Passage passage_of(const Model& model, const State& state, int support);

}  // namespace withe
