#pragma once
/// Hands that yield, see forces/hand.hpp: each holds every edge that it touches by a share of its stiffness.

#include <array>
#include <vector>

#include "steps/ring_forces.hpp"

namespace withe {

class DiscreteAdjoint;

class HandForces final : public Term {
 public:
  explicit HandForces(const Model& model);

  void declare(std::vector<ElementTable*>& tables) override {
    tables.push_back(&table_);
    if (rings_.count() > 0) tables.push_back(&rings_.table());
  }
  bool has_potential() const override { return !slips_; }
  bool dissipates(const Parameters&) const override { return slips_; }
  std::string note() const override;
  void begin(StepProblem& problem) override;
  void add(const StepProblem& problem, StepData& data, const Assembler& assembler,
           std::span<double> values) const override;
  void add_adjoint(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                   StepAdjoint& adjoint) const override;
  void add_rounding(const StepProblem& problem, StepData& data) const override;
  double dissipated(const StepProblem& problem, const StepData& data, const Assembler& assembler,
                    const VectorX& change) const override;

  /// Adds to derivatives by what a step is given those by what it leaves of slips, `adjoint.hands_after`: to `by_end`,
  /// that by q1, and to the adjoint. To come before `add_adjoint`.
  void add_slip_adjoint(const StepProblem& problem, const VectorX& q1, StepAdjoint& adjoint, VectorX& by_end) const;
  /// Adds derivatives of a scalar that goes with what one hand holds with, by that force and moment: what they depend
  /// on at z to `by_z`, all else to the adjoint. Throws std::invalid_argument where none is known.
  void add_wrench_adjoint(const StepProblem& problem, const StepData& data, int support, const Vector3& by_force,
                          const Vector3& by_moment, StepAdjoint& adjoint, VectorX& by_z) const;
  bool slips() const { return slips_; }
  const RingForces& rings() const { return rings_; }
  /// True if something slips where a state is, or would with any more force.
  bool at_limit(const State& state) const;
  /// Work of hands in a step that has just been evaluated [J].
  double work(const StepProblem& problem, const StepData& data, const VectorX& q1) const;
  /// Takes a state whose q is that of the end of a step there: supports are at `end`, and hands slip where the force is
  /// too great. `c`: of that q; not used in a plane. Returns what stays with rings that rods have left [J].
  double accept(const std::vector<SupportPose>& end, const Configuration& c, State& state) const;

 private:
  struct Held {
    int support = 0, touched = 0;
  };
  struct Piece;
  struct Grip;
  struct Turn;
  /// Pose of a hand at which its forces act, and at the end of the step.
  SupportPose pose_of(const StepProblem& problem, int support) const;
  SupportPose end_pose(const StepProblem& problem, int support) const;
  Piece piece(const StepProblem& problem, const StepData& data, int element) const;
  Turn put_planar_turn(const StepProblem& problem, const StepData& data, const Piece& p, bool with_matrix,
                       Local& local) const;
  Turn put_turn(const StepProblem& problem, const StepData& data, const Piece& p, double twist, Local& local) const;
  /// Whose work in an energy-momentum step is what the energy changes by.
  Turn put_discrete_turn(const StepProblem& problem, const StepData& data, const Held& held, bool with_matrix,
                         Local& local) const;
  Grip grip_over(const StepProblem& problem, const StepData& data, const Held& held) const;
  void add_pose(const StepProblem& problem, int support, const Vector3& by_position, const Vector3& by_rotation,
                StepAdjoint& adjoint) const;
  void add_shift_adjoint(const StepProblem& problem, const StepData& data, int element, const Vector3& by_point,
                         StepAdjoint& adjoint) const;
  void add_moment_adjoint(const StepProblem& problem, const StepData& data, int element, const Vector3& by_moment,
                          StepAdjoint& adjoint, VectorX& by_z) const;
  std::array<double, kMaxLocal> add_discrete_turn_adjoint(const StepProblem& problem, const StepData& data, int element,
                                                          const double* rows, DiscreteAdjoint& discrete,
                                                          StepAdjoint& adjoint) const;
  void add_discrete_moment_adjoint(const StepProblem& problem, const StepData& data, int element,
                                   const Vector3& by_moment, DiscreteAdjoint& discrete, StepAdjoint& adjoint,
                                   VectorX& by_z) const;
  void add_planar_moment_adjoint(const StepProblem& problem, const StepData& data, int element, double by,
                                 StepAdjoint& adjoint, VectorX& by_z) const;
  Vector3 add_turn_adjoint(const StepProblem& problem, const StepData& data, int element, const double* rows,
                           CoefficientAdjoint& by) const;

  const Model& model_;
  RingForces rings_;
  std::vector<Held> held_;  ///< of each element
  ElementTable table_;
  bool slips_ = false;            ///< whether any may
  std::vector<SupportPose> now_;  ///< where forces act
};

/// Energy of hands that yield, or of only one of them [J].
double hand_energy(const Model& model, const BendMeasure& measure, const State& state, const Configuration& c,
                   int only = -1);
/// Displacement of the held part of the rod, in the hand's axes.
struct HandDeflection {
  Vector3 shift = Vector3::Zero(), turn = Vector3::Zero(), slip = Vector3::Zero();
};
HandDeflection hand_deflection(const Model& model, const State& state, const Configuration& c, int support);

}  // namespace withe
