#pragma once
/// A run as the adjoint method needs it: the result of each step, from which states are replayed without a solve.

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "gradients/acting.hpp"
#include "gradients/held_gradient.hpp"
#include "gradients/parameter_gradient.hpp"
#include "gradients/readout_gradient.hpp"

namespace withe {

/// Derivatives of a scalar by the state that a run began with.
struct InitialGradient {
  MatrixX3 positions;   ///< per node [1/m]; directors turn along with their edges, without spin
  MatrixX3 velocities;  ///< per node [s/m]
  PoseAdjoint poses;    ///< by the initial poses of supports and obstacles
  DrawnAdjoint drawn;   ///< by the drawing, if the run began in it; only without moving supports
};

/// Receives derivatives of a scalar by parameters, from the end of a run to its start. A call reports the parameters
/// that acted from `step` on to the previously reported step. If `moment` is not -1, it reports the parameters of the
/// read-out at this index among the moments instead. `time` is the time in the last of these steps [s].
using ParameterVisitor = std::function<void(long step, long moment, double time, const ParameterGradient&)>;

/// Derivatives of the state at the end of a run by the state at its start and by parameters. There is one row per
/// component of a state vector (state_vector.hpp).
struct RunJacobian {
  MatrixX state;
  std::vector<ParameterGradient> rows;
};

/// Derivatives of a scalar at a moment of a run, after a number of steps; moments are sorted by time.
struct MomentAdjoint {
  long steps = 0;
  ReadoutAdjoint by;
};

/// Completed share of the motion of supports (positions and rotations) and of obstacles (positions), from 0 to 1. Empty
/// if all motions are complete.
struct Reached {
  MatrixX supports;
  VectorX obstacles;
};

/// Receives derivatives by poses at the end of a step, and the completed shares of their motions.
using PoseVisitor = std::function<void(long step, const Reached& reached, const PoseAdjoint&)>;

/// Accepted step of a run.
struct AcceptedStep {
  StepRule rule;
  double duration;
  const VectorX& end;            ///< q1
  const State& after;            ///< at the end of the step
  const Parameters& parameters;  ///< in the step
  Reached reached;
  std::vector<SupportPose> hands;   ///< poses of hands at the end, per support; empty: no hands
  bool begins = true;               ///< true for the first part of a time step
  const char* unknown = nullptr;    ///< reason why no gradient exists through the step, unless `cut` removes it
  bool tensions_in_middle = false;  ///< true if axial forces after the step are read out in its middle
};

class Tape {
 public:
  /// Tape of a run with this initial state, with or without friction. The arguments are copied. `hands`: see
  /// `AcceptedStep`.
  Tape(const Model& model, EquationOptions options, State first, const Parameters& parameters, bool frictional,
       std::vector<SupportPose> hands);

  long count() const { return static_cast<long>(steps_.size()); }
  void record(const AcceptedStep& step);
  /// Notes the natural shapes by which read-outs go now: ramps act in the middle of steps.
  void note_moment(const Parameters& now);
  /// Begins a new stretch of parameters.
  void divide() { acting_.divide(); }
  /// Removes all steps after the first `count`.
  void cut(long count, const State& after, std::vector<SupportPose> hands);
  /// Notes the reason why this run has no gradient; the first reason stays.
  void refuse(const std::string& why);
  /// True if the last step led to this state.
  bool continues(const State& state) const;
  /// True if these are as many loads as at the start.
  bool has_loads(const Parameters& parameters) const { return parameters.loads.rows() == acting_.load_rows(); }

  /// True if friction is there, or not, and pairs of bodies have their own, as at the start.
  bool has_friction(const ContactDescription& contact, bool frictional) const {
    return frictional == frictional_ && contact.pairs.size() == model_.description.contact.pairs.size();
  }

  /// Throws std::invalid_argument where none is known.
  /// `visit_poses` may be empty.
  InitialGradient gradient(const std::vector<MomentAdjoint>& moments, const ParameterVisitor& visit,
                           const PoseVisitor& visit_poses) const;
  /// Jacobian of a run without changes of parameters; it costs a solve of each step for every row.
  RunJacobian jacobian() const;

 private:
  struct Step {
    StepRule rule;
    double duration, time;  ///< and that at its end [s]
    VectorX end;
    VectorX held;  ///< velocities of held unknowns at its end, in order; empty: they rest, as before it
    VectorX gain;  ///< see `StepTaken::held_gain`; empty: null
    Reached reached;
    std::vector<SupportPose> hands;        ///< at its end; empty: as before it
    std::vector<ObstaclePlace> obstacles;  ///< at its end; empty: as before it
    std::vector<ContactRecord> contacts;   ///< at its end
    bool begins;
    const char* unknown;  ///< reason why no gradient exists, or null
    bool tensions_in_middle;
  };
  /// Natural shape for read-outs, if it differs from the one of the last step.
  struct NaturalShape {
    std::vector<MatrixX2> curvature;
    std::vector<VectorX> twist;
    VectorX stretch;
  };
  class Player;
  class Moments;
  /// Poses of hands after a number of steps.
  std::vector<SupportPose> hands_after(long steps) const;
  std::vector<SupportPose> moved_hands(const std::vector<SupportPose>& hands);
  std::vector<ObstaclePlace> moved_obstacles(const std::vector<ObstaclePlace>& obstacles);
  VectorX held_velocities(const VectorX& v) const;
  VectorX held_gains(const AcceptedStep& step) const;

  void check_known() const;
  /// When the numbers act that a step has [s].
  static double acting_time(const Step& step) {
    return step.rule == StepRule::backward_euler ? step.time : step.time - 0.5 * step.duration;
  }
  /// A step that is gone back through: its gradient has begun, `end` makes the state that it led to.
  struct Passage {
    std::size_t step, stretch;
    StepGradient& gradient;
    const Parameters& parameters;
    const std::vector<SupportPose>& hands;
    const std::function<State()>& end;
  };
  void walk_back(Player& player, const std::function<void(const Passage&)>& visit) const;

  Model model_;
  EquationOptions options_;
  ActingNumbers acting_;
  std::vector<Step> steps_;
  std::map<long, NaturalShape> natural_;  ///< by the number of steps
  std::vector<State> starts_;             ///< initial state of every stretch of steps that is replayed together
  VectorX last_, last_velocity_;          ///< result of the last step
  std::vector<SupportPose> last_hands_;   ///< poses of hands after the last step
  std::vector<ObstaclePlace> last_obstacles_;
  std::string refused_;
  bool frictional_;
};

}  // namespace withe
