#pragma once
/// A run as the adjoint method needs it: what each step led to, so that states come again without a solve.

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
  PoseAdjoint poses;    ///< by where what supports hold was, and obstacles
  DrawnAdjoint drawn;   ///< by a drawing in which the run began; where no support moves
};

/// Takes derivatives of a scalar by what acted from a step on until the next that it is given; or by what a read-out at
/// a moment takes, then `moment` is its place among those given, else -1. `time`: when these numbers acted, in the last
/// of the steps [s]. From the end of a run to its start.
using ParameterVisitor = std::function<void(long step, long moment, double time, const ParameterGradient&)>;

/// Derivatives of the state at the end of a run by that at its start and by what acts, a row each for the numbers of a
/// state vector (state_vector.hpp).
struct RunJacobian {
  MatrixX state;
  std::vector<ParameterGradient> rows;
};

/// Derivatives of a scalar at a moment of a run, after a number of steps; moments in the order of time.
struct MomentAdjoint {
  long steps = 0;
  ReadoutAdjoint by;
};

/// Share of the way that positions and rotations of supports, and positions of obstacles, have gone, from 0
/// to 1; empty: all are there.
struct Reached {
  MatrixX supports;
  VectorX obstacles;
};

/// Takes derivatives by poses at the end of a step, and how far they had come then.
using PoseVisitor = std::function<void(long step, const Reached& reached, const PoseAdjoint&)>;

/// A step that has been accepted.
struct AcceptedStep {
  StepRule rule;
  double duration;
  const VectorX& end;            ///< q1
  const State& after;            ///< at its end
  const Parameters& parameters;  ///< as they acted
  Reached reached;
  std::vector<SupportPose> hands;   ///< where hands are at its end, per support; empty: there is none
  bool begins = true;               ///< whether it is the first part of a time step
  const char* unknown = nullptr;    ///< why no gradient goes through it, unless it is cut off again
  bool tensions_in_middle = false;  ///< whether axial forces after it are read out in its middle
};

class Tape {
 public:
  /// Tape of a run that begins so, with friction or not; these are kept. `hands`: see `AcceptedStep`.
  Tape(const Model& model, EquationOptions options, State first, const Parameters& parameters, bool frictional,
       std::vector<SupportPose> hands);

  long count() const { return static_cast<long>(steps_.size()); }
  void record(const AcceptedStep& step);
  /// Notes the natural shapes by which read-outs go now: ramps act in the middle of steps.
  void note_moment(const Parameters& now);
  /// Begins a new stretch of parameters.
  void divide() { acting_.divide(); }
  /// Forgets all but so many.
  void cut(long count, const State& after, std::vector<SupportPose> hands);
  /// Says why no gradient goes through this run; the first reason stays.
  void refuse(const std::string& why);
  /// True if that is what the last step led to.
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
  /// Jacobian of a run in which nothing was set; costs a solve of each step for every row.
  RunJacobian jacobian() const;

 private:
  struct Step {
    StepRule rule;
    double duration, time;  ///< and that at its end [s]
    VectorX end;
    VectorX held;  ///< velocities at its end of what supports hold, one after the other; none: they rest, as before it
    VectorX gain;  ///< see `StepTaken::held_gain`; none: nothing
    Reached reached;
    std::vector<SupportPose> hands;        ///< at its end; none: where they were before it
    std::vector<ObstaclePlace> obstacles;  ///< at its end; none: where they were before it
    std::vector<ContactRecord> contacts;   ///< at its end
    bool begins;
    const char* unknown;  ///< why no gradient goes through it, if so
    bool tensions_in_middle;
  };
  /// As it is read out, where it is another than the one that acted last.
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
  std::vector<State> starts_;             ///< of every stretch of steps that are played again together
  VectorX last_, last_velocity_;          ///< what the last step led to
  std::vector<SupportPose> last_hands_;   ///< poses of hands after the last step
  std::vector<ObstaclePlace> last_obstacles_;
  std::string refused_;
  bool frictional_;
};

}  // namespace withe
