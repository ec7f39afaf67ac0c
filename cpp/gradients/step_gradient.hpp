#pragma once
/// The adjoint of one step: it maps derivatives of a scalar by the state at the end of a step to derivatives by the
/// state at its start and by the parameters of the step.
///
/// A step solves R(z; start, p) = 0. With zbar the derivative of the scalar by z, R_z^T r = -zbar gives r. The
/// derivative by any other quantity x is r^T R_x, plus direct dependence on x [Giles and Pierce 2000, sec. 2.1]. R_z is
/// the exact matrix. The terms compute r^T R_x (`Term::add_adjoint`).
///
/// Besides q and v, a step passes on the orientation of directors. A reference director that is transported along has
/// one angle to the director. A state is therefore differentiated by positions, by the rotation psi of an edge's
/// directors about the edge, and by the rotation vector of a joint's frame. These stand in the places of angles and
/// frames in q. From a start with vector e0 to the vector e, directors turn by
///   d psi = d theta + spin . d e + back . d e0,    spin = -(t0 x t) / (l (1 + t0 . t)),   back = l / l0 spin,
/// where theta counts from the transported start.

#include <optional>

#include "steps/equations.hpp"

namespace withe {

/// Derivatives of a scalar by a state, in the places of its unknowns.
struct StateAdjoint {
  VectorX q;  ///< positions [1/m], turns of directors and of frames [1/rad], angles of hinges
  VectorX v;  ///< [s/m], [s/rad]
  ApproachAdjoint approach = {};
  HandAdjoint hands = {};   ///< empty: nothing
  MatrixX3 obstacles = {};  ///< by positions of obstacles, in the axes of the unknowns [1/m]; empty: zero
};

/// Step that is differentiated, from `start` to q1.
struct StepTaken {
  const State& start;
  const Parameters& parameters;
  StepRule rule;
  double duration;  ///< [s]; statics: 0
  const VectorX& end;
  const VectorX* held_velocity = nullptr;  ///< of held unknowns at the end, elsewhere undefined; null: at rest
  /// Per constraint, the share of the change of the mean velocity that is added to the velocity at the end; null: zero.
  const VectorX* held_gain = nullptr;
  /// Poses of hands and places of obstacles at the end; must outlive the step.
  const Prescribed& prescribed = Prescribed::nothing();
};

/// Derivatives of a scalar by the reactions of supports in a step, as `World::reaction` has them; or empty.
struct SupportAdjoint {
  MatrixX3 forces, moments;  ///< per support [1/N], [1/(N m)]; zero for supports after the last row
};

/// Derivatives by reactions that are read out after a time step, which may have several inner steps, and the positions
/// of hands at that time, about which moments are taken.
struct ReactionAdjoint {
  const SupportAdjoint& by;
  std::vector<SupportPose> about;  ///< per support; none: there is no hand
  double share = 1;                ///< share of the inner step in the time step, over which reactions are means
};

/// Derivatives of a scalar by prescribed motion; undefined for free unknowns.
struct HeldAdjoint {
  VectorX pose;        ///< by held unknowns at the end of a step, in coordinates of the state
  VectorX mean;        ///< by the mean velocity of the previous step, which is visited next [s/m], [s/rad]
  HandAdjoint hands;   ///< by poses of hands at the end of a step, besides the effect of held unknowns
  MatrixX3 obstacles;  ///< by positions of obstacles at the end of a step, as in `StateAdjoint`

  explicit HeldAdjoint(const Model& model) : pose(VectorX::Zero(model.dof_count)), mean(pose), hands(model) {}
};

/// Maps derivatives by axial forces in a configuration to derivatives by its unknowns and by coefficients.
void add_axial_forces(const Model& model, const Parameters& parameters, const Configuration& configuration,
                      const VectorX& by, VectorX& unknowns, CoefficientAdjoint& coefficients);

class StepGradient {
 public:
  StepGradient(const Model& model, EquationOptions options);

  Equations& equations() { return equations_; }

  /// Prepares a step; its references must outlive `pull_back`. Throws std::invalid_argument if the parameters do not
  /// determine the state.
  void begin(const StepTaken& step);
  /// Imbalance of the last evaluation: greatest residual force, beyond rounding, over the greatest force [-].
  double imbalance() const;
  /// Maps the adjoint of the state at the end to that of the state at the start, and adds derivatives by coefficients
  /// and held unknowns (at the end, in coordinates of the state). `reactions`, and `tensions` in the middle, per edge
  /// [1/N], are further read-outs of this step. Throws std::invalid_argument if no gradient is available.
  void pull_back(StateAdjoint& state, CoefficientAdjoint& by, HeldAdjoint& held,
                 const ReactionAdjoint* reactions = nullptr, const VectorX* tensions = nullptr);
  /// Residual of the last evaluation [N], [N m].
  const VectorX& residual() const { return data_.residual; }
  /// Change of the unknowns of an equilibrium in forward mode, R_z dz = -dR. The residual at fixed unknowns changes by
  /// `residual`, and held unknowns by `held` (zero elsewhere). Throws std::invalid_argument if the parameters do not
  /// determine the state.
  VectorX respond(const VectorX& residual, const VectorX& held);
  /// Adds the derivatives of the work of an equilibrium's residual over a motion.
  void add_work_along(const VectorX& motion, CoefficientAdjoint& by, HeldAdjoint& held);

 private:
  void set_end(const StateAdjoint& state);
  void add_reactions(const ReactionAdjoint& reactions, StepAdjoint& adjoint);
  void add_reaction(const Support& support, const Vector3& by_force, const Vector3& by_moment);
  void add_hand_reaction(int support, const Vector3& by_force, const Vector3& by_moment, const Vector3& about,
                         StepAdjoint& adjoint);
  Vector3 add_angle_reaction(int edge, const Vector3& arm, const Vector3& by_moment, const VectorX& held);
  void add_frame_reaction(int dof, CoefficientAdjoint& coefficients);
  void add_held_inertia(int angle, CoefficientAdjoint& coefficients) const;
  void solve();
  void add_transport(const StateAdjoint& state, const StepAdjoint& adjoint, VectorX& start) const;
  void add_frames(const StateAdjoint& state, const StepAdjoint& adjoint, VectorX& start) const;
  void add_held(const StepAdjoint& adjoint, const VectorX& end_velocity, VectorX& start, VectorX& velocity,
                HeldAdjoint& held) const;
  void turn_held(VectorX& start, VectorX& pose) const;
  void turn_held_edge(int edge, VectorX& start, VectorX& pose) const;
  bool moves() const { return step_->rule != StepRule::statics; }
  bool in_middle() const { return equations_.problem().in_middle(); }
  double end_rate() const { return equations_.problem().end_rate(); }

  Equations equations_;
  std::optional<StepTaken> step_;
  StepData data_;
  Configuration own_end_;
  const Configuration* end_ = nullptr;  ///< at q1, in space
  VectorX rates_;                       ///< derivatives of velocities at the end by q1 [1/s]
  VectorX held_acceleration_, z_, by_end_, by_z_, rows_, columns_;
  VectorX by_rows_;       ///< by rows of the residual, on which reactions depend directly; empty: none
  bool shifted_ = false;  ///< the factorised matrix, against neutral modes
};

}  // namespace withe
