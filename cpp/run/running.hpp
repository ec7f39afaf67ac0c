#pragma once
/// Values of a scene while it runs: everything that acts on later steps. Copies copy all of it.

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "integrators/dynamics.hpp"
#include "model/actuation.hpp"
#include "model/parameter_index.hpp"
#include "run/energy.hpp"
#include "run/step_control.hpp"

namespace withe {

/// Share of the time from a start to an end that has passed at a time, from 0 to 1.
double ramp_fraction(double time, double start, double end);

/// Start and end of a motion [s].
struct Span {
  double start = 0, end = 0;

  double fraction(double time) const { return ramp_fraction(time, start, end); }
};

/// Pose of a support and its motion. Position and rotation move independently.
struct SupportMotion {
  Vector3 position = Vector3::Zero();      ///< now [m]
  Matrix3 rotation = Matrix3::Identity();  ///< now, from the drawn orientation
  Vector3 from_position = Vector3::Zero(), to_position = Vector3::Zero();
  Matrix3 from_rotation = Matrix3::Identity(), to_rotation = Matrix3::Identity();
  Vector3 roll =
      Vector3::Zero();  ///< of a static change, full turns counted [rad], about a drawn axis; see `swing_between`
  Span shift, turn;     ///< when each of them goes
  double stretch = 1;   ///< of a held edge: its length when it was gripped, over the drawn one
  // The drive of a ring: length that it has fed, now and at a time from which it feeds evenly.
  double fed = 0, fed_before = 0;         ///< [m]
  double feed_rate = 0, feeds_since = 0;  ///< [m/s], [s]

  /// True if the support was moved at once, and no step has led it there yet.
  bool jumps() const { return shift.start == shift.end && position != to_position; }
  SupportPose pose() const { return {position, rotation, fed}; }
  SupportPose pose_at(double time) const;
  void put(const SupportPose& pose);
};

std::vector<SupportPose> poses_of(const std::vector<SupportMotion>& motions);

/// Motion of an obstacle.
struct ObstacleMotion {
  ObstacleWay from, to;
  Span shift, turn;

  ObstacleWay at(double time) const;
};

/// A change from one value to another, linear in time.
template <class Value>
struct Ramp {
  Value from, to;
  double start = 0, end = 0;  ///< [s]
  bool active = false;

  /// Sets what is on its way to where it is at a time; false where it is not.
  template <class Now>
  bool apply(double time, Now&& now) const {
    if (!active) return false;
    const double s = ramp_fraction(time, start, end);
    now.noalias() = (1.0 - s) * from + s * to;
    return true;
  }

  /// At rest from the end on.
  void retire(double time) {
    if (time >= end) active = false;
  }
};

/// Natural shape of a rod: curvature [1/m] and twist [rad/m] of its stencils, stretch of its edges [-].
struct NaturalRamp {
  Ramp<MatrixX2> curvature;
  Ramp<VectorX> twist, stretch;
};

/// Linear ramp of the number of one part.
struct NumberRamp {
  ParameterKind kind{};
  int part = 0;
  double from = 0, to = 0;
  Span span;
};

struct Ramps {
  std::vector<NaturalRamp> natural;  ///< per rod
  std::vector<NumberRamp> numbers;   ///< of parts, in the order in which they began
};

/// Energy balance of the watch over what contact puts in where surfaces slide by much within a step.
struct ContactGuard {
  double scale = 0;   ///< greatest energy so far, as it was looked at [J]
  double excess = 0;  ///< put in and not lost since, as far as it is not long ago [J]
  double put_in = 0;  ///< in the last step, by surfaces that press [J]
};

/// Sums over a few steps in a row, of squares of velocities weighed by mass, per connected component; see
/// step_watch.hpp.
struct StepWatch {
  VectorX change;    ///< by how much they change within a step [J]
  VectorX motion;    ///< what that is compared with [J]
  VectorX greatest;  ///< of such sums so far [J]
  // Under backward Euler:
  VectorX pull, moved;   ///< by how much forces change with the motion, over the step; the motion [J]
  VectorX acceleration;  ///< in the step before
};

/// Values that a user sets, and the ramps that lead to them.
struct Settings {
  Parameters parameters;
  Ramps ramps;
  std::vector<ObstacleMotion> obstacle_motions;  ///< none until one moves
  Actuation actuation_before;                    ///< with which the state last moved
  bool actuation_changed = false;                ///< since then, or since the scene was drawn, which is free of stress
};

/// Values that a step changes. They are put back where a step is rejected.
struct Moving {
  State state;
  Predictor predictor;
  std::vector<SupportMotion> motions;
  Ledger ledger;
  /// Impulses of supports in the parts of a time step so far, per support as in `reaction_of` [N s], [N m s]; and the
  /// length of these parts [s]. Empty where the last time step had one part.
  std::vector<Wrench> impulses;
  std::vector<Wrench> joint_impulses;  ///< the same of the parts at joints of bodies
  double impulse_time = 0;
};

/// History by which the next steps are chosen and judged.
struct StepHistory {
  StepLengths lengths;
  double grid_origin = 0;  ///< time = grid_origin + grid_steps time_step after whole steps, free of summed rounding
  std::int64_t grid_steps = 0;
  std::int64_t steps_taken = 0;  ///< inner steps accepted since the scene was built
  ContactGuard contact_guard;
  StepWatch step_watch;
  /// Energies at the start, by which the energy of explicit and of midpoint steps is judged.
  std::optional<Energy> first_energy;
  double greatest_kinetic = 0;  ///< kinetic energy since then, at the steps that are looked at [J]
};

/// Results of the last step or solve, for read-outs.
struct Found {
  MatrixX3 custom_force;               ///< of the last step [N]
  MatrixX3 custom_moments;             ///< of the last step, where there are any [N m]
  VectorX reaction_residual;           ///< full residual of the last solve
  VectorX reaction_place;              ///< the configuration in which its forces act, in the middle of midpoint steps
  std::vector<Wrench> hand_wrenches;   ///< of hands that yield, per support, about the origin
  std::vector<Wrench> joint_wrenches;  ///< on the parts at joints of bodies, see steps/joint_wrenches.hpp
  VectorX tensions;                    ///< per edge, in the middle of a midpoint step [N]; none: those of the state
  bool reaction_current = false;
};

struct Running : Settings, Moving, StepHistory, Found {};

}  // namespace withe
