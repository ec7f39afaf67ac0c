#pragma once
/// Hands that yield, see forces/hand.hpp. A hand holds every edge that it touches with a share of its stiffness.

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

  /// Converts the derivatives by slips at the end of a step, `adjoint.hands_after`, into derivatives by q1, which it
  /// adds to `by_end`, and by the input of the step, which it adds to the adjoint. Must be called before `add_adjoint`.
  void add_slip_adjoint(const StepProblem& problem, const VectorX& q1, StepAdjoint& adjoint, VectorX& by_end) const;
  /// Adds derivatives of a scalar that depends on the force and the moment of one hand. `by_force` and `by_moment` are
  /// its derivatives by these. Derivatives by z are added to `by_z`, all others to the adjoint. Throws
  /// std::invalid_argument if the derivatives are unknown.
  void add_wrench_adjoint(const StepProblem& problem, const StepData& data, int support, const Vector3& by_force,
                          const Vector3& by_moment, StepAdjoint& adjoint, VectorX& by_z) const;
  bool slips() const { return slips_; }
  const RingForces& rings() const { return rings_; }
  /// True if a rod slips in a hand in this state, or would slip under any greater force.
  bool at_limit(const State& state) const;
  /// Work of hands in a step that has just been evaluated [J].
  double work(const StepProblem& problem, const StepData& data, const VectorX& q1) const;
  /// Moves the hands of a state to the end of a step, where its q is already. Supports are at `end`, and hands slip if
  /// their force is too great. `c`: configuration at this q, not used in a plane. Returns the energy that remains in
  /// rings that rods have left [J].
  double accept(const std::vector<SupportPose>& end, const Configuration& c, State& state) const;

 private:
  struct Held {
    int support = 0, touched = 0;
  };
  struct Piece;
  struct Grip;
  struct Turn;
  /// Poses of a hand: `pose_of` where its forces act, `end_pose` at the end of the step.
  SupportPose pose_of(const StepProblem& problem, int support) const;
  SupportPose end_pose(const StepProblem& problem, int support) const;
  Piece piece(const StepProblem& problem, const StepData& data, int element) const;
  Turn put_planar_turn(const StepProblem& problem, const StepData& data, const Piece& p, bool with_matrix,
                       Local& local) const;
  Turn put_turn(const StepProblem& problem, const StepData& data, const Piece& p, double twist, Local& local) const;
  /// Moment whose work in an energy-momentum step is the change of the energy.
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
  std::vector<Held> held_;  ///< per element
  ElementTable table_;
  bool slips_ = false;            ///< true if any hand may slip
  std::vector<SupportPose> now_;  ///< poses at which forces act
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
