#pragma once
/// What World is made of; private to this room.

#include <atomic>
#include <cstdint>
#include <limits>

#include "integrators/dynamics.hpp"
#include "integrators/statics.hpp"
#include "world/world.hpp"

namespace withe {

/// Where a support is, and where it is going.
struct SupportMotion {
  Vector3 position = Vector3::Zero();      ///< now [m]
  Matrix3 rotation = Matrix3::Identity();  ///< now, from the drawn orientation
  Vector3 from_position = Vector3::Zero(), to_position = Vector3::Zero();
  Matrix3 from_rotation = Matrix3::Identity(), to_rotation = Matrix3::Identity();
  double start = 0, end = 0;  ///< of the ramp [s]
  double stretch = 1;         ///< of a held edge: its length when it was gripped, over the drawn one
};

/// How far something has come that goes evenly from a start to an end, at a time; from 0 to 1.
double ramp_fraction(double time, double start, double end);

/// Where an obstacle goes.
struct ObstacleMotion {
  ObstacleWay from, to;
  double start = 0, end = 0;  ///< [s]
};

/// What goes evenly from one value to another.
template <class Value>
struct Ramp {
  Value from, to;
  double start = 0, end = 0;  ///< [s]
  bool active = false;

  /// Sets what is on its way to where it is at a time; false where it is not.
  bool apply(double time, Value& now) const {
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

/// Natural shape of a rod: curvature [1/m] and twist [rad/m] of its stencils.
struct NaturalRamp {
  Ramp<MatrixX2> curvature;
  Ramp<VectorX> twist;
};

/// Books of the watch over plain midpoint's energy.
struct EnergyGuard {
  double turn = std::numeric_limits<double>::infinity();  ///< of the last step [rad]; before the first, not known
  double scale = 0;                                       ///< [J]
  double excess = 0;                                      ///< out of nowhere so far [J]
  double stretch_gain = 0;                                ///< of the last step, into stretching [J]
  int rescue = 0;                                         ///< energy-momentum steps still to take in its place
  std::optional<Energy> energy;                           ///< at the present state, where a step has just found it
};

/// Books of the watch over what contact puts in where surfaces slide by much within a step.
struct ContactGuard {
  double scale = 0;   ///< greatest energy so far, as it was looked at [J]
  double excess = 0;  ///< put in and not lost since, as far as it is not long ago [J]
  double put_in = 0;  ///< in the last step, by surfaces that press [J]
};

/// Sums over a few steps in a row, of squares of velocities weighed by mass; see step_length.cpp.
struct StepWatch {
  double change = 0;    ///< by how much they change within a step [J]
  double motion = 0;    ///< what that is compared with [J]
  double greatest = 0;  ///< of such sums so far [J]
  // Under backward Euler:
  double pull = 0, moved = 0;  ///< by how much forces change with the motion, over the step; the motion [J]
  VectorX acceleration;        ///< in the step before
};

/// What a step that is taken back returns to.
struct StepStart {
  State state;
  Predictor predictor;
  std::vector<SupportMotion> motions;
  double support_work = 0, actuation_work = 0, dissipated = 0, load_work = 0;
};

/// Scratch for energies.
struct EnergyScratch {
  Configuration configuration;
  ElasticCoefficients elastic;
  MassMatrix mass;
};

/// Easy steps before longer ones are tried, at least.
inline constexpr int kLeastPatience = 4;

/// Why a model is built: at first, because supports changed or the plane was left, or to take a snapshot's state.
enum class Rebuild { first, running, restored };

struct World::Implementation {
  Implementation(SceneDescription description, Options options);
  Implementation(const Implementation& other);

  SceneDescription description;
  Options options;
  Model model;
  Parameters parameters;
  std::unique_ptr<Newton> newton;
  std::unique_ptr<Equations> equations;
  std::unique_ptr<Equations> rescue_equations;  ///< energy-momentum ones, made when plain midpoint gains energy
  std::unique_ptr<Equations> static_equations;  ///< symmetric ones, made when first needed
  StepWorkspace work;
  mutable EnergyScratch energy_scratch;
  Predictor predictor;
  StepStart kept;
  std::vector<SupportMotion> motions_before, kept_motions;  ///< at the start of a time step, of a part of it
  State state;
  Plan plan;
  Statistics statistics;
  std::vector<SupportMotion> motions;
  std::vector<ObstacleMotion> obstacle_motions;  ///< none until one moves
  std::vector<NaturalRamp> ramps;
  std::vector<Vector3> load_values;
  MatrixX3 custom_force;        ///< of the last step [N]
  MatrixX3 custom_moments;      ///< likewise, where there are any [N m]
  VectorX custom_force_before;  ///< per unknown, at the start of an explicit step
  CustomFunction force_function;
  std::function<void(double, double)> callback;  ///< StepCallback, bound to its world
  std::function<void()> poll;
  std::atomic<bool> interrupted{false};
  double separated = 0;           ///< how far overlapping rods were moved before the start [m]
  bool spatial = false;           ///< left its plane while running
  int level = 0;                  ///< present halvings of the time step, in `notches()` to each
  int easy_steps = 0;             ///< since it changed
  int patience = kLeastPatience;  ///< of them before longer steps are tried
  bool grown = false;             ///< fewer easy steps than the least patience ago
  EnergyGuard guard;
  ContactGuard contact_guard;
  double error_rate = 0;   ///< greatest estimated error of the last steps over the power of the step that it goes with
  double grid_origin = 0;  ///< time = grid_origin + grid_steps time_step after whole steps, free of summed rounding
  std::int64_t grid_steps = 0;
  double support_work = 0, actuation_work = 0, dissipated = 0, load_work = 0;
  std::optional<Energy> alarm;  ///< energies at the start, for the explicit scheme's alarm
  /// Of a mesh too coarse for the motion, and empty once it was heard; none yet where there was no reason.
  std::optional<std::string> warning;
  StepWatch step_watch;
  std::optional<std::string> step_warning;  ///< likewise, of steps too long for the motion
  NewtonResult last_newton;
  VectorX reaction_residual;  ///< full residual of the last solve
  bool reaction_current = false;

  // building.cpp
  /// Lets interruptions reach the solver.
  void listen();
  void rebuild(Rebuild why);
  void make_plan();
  /// Equations for other loads than before.
  void remake_equations();
  void add_contact_notes();
  void add_coarse_notes();
  std::string fluid_note() const;
  /// Drops the plane; throws when the user asked for it. `why` names the argument that leaves the plane.
  void leave_plane(const std::string& why);
  State transferred(const Model& old, const State& from) const;
  void relax_frames(const std::vector<bool>& is_new);
  void relax_frame(int frame, const Matrix3& free);

  // set_state.cpp
  bool leaves_plane(const RodState& rod) const;
  VectorX placed(const std::vector<RodState>& rods) const;
  void place_rods(const std::vector<RodState>& rods);
  void set_rates(const std::vector<RodState>& rods);
  void relax_joints(const std::vector<bool>& is_told);
  void turn_frames(const std::vector<bool>& is_told);
  /// What came before no longer tells what comes next.
  void forget_motion();

  // prescribed.cpp
  /// Gives a part of a natural shape another value, at once or over a time [s].
  template <class Value>
  void actuate(Ramp<Value>& ramp, Value& now, const Value& value, double over);
  void apply_ramps(double time);
  void retire_ramps();
  bool actuated() const;
  void aim_supports(double time);
  void spread_jumps(double duration);
  void hold_now(HeldTarget& target) const;
  void set_motion_at(SupportMotion& motion, double time) const;
  CustomForces custom_forces(double time, const VectorX& q, const VectorX& v, bool derivatives);
  void solve_for_custom(Equations& target, double dt);
  void solve_for_custom_at_rest(Equations& target, double time);
  /// Ends that, with custom forces as they were before.
  void forget_custom(Equations& target, const MatrixX3& forces, const MatrixX3& moments);
  /// Asks for custom forces at a time and a state, on each unknown.
  void ask_custom_force(Equations& target, double time, const VectorX& q, const VectorX& v);
  /// Those of a step of dt, which leads to where `work.held` says.
  void find_custom_force(Equations& target, double dt);
  void update_custom_force(Equations& target) const;

  // stepping.cpp
  enum class Attempt { failed, gained_energy, rescued, inaccurate, hard, easy };
  /// Equal parts in which the rest of a time step, from a fraction of it on, is taken.
  struct Division {
    double from = 0.0;
    long parts = 1, done = 0;
    double reached() const { return from + (1.0 - from) * (static_cast<double>(done) / static_cast<double>(parts)); }
  };
  void advance(double duration);
  void advance_in_parts(double duration);
  bool may_cut() const;
  int notches() const;
  void divide_rest(Division& division) const;
  void cut(Attempt why, Division& division, double dt);
  bool grow(Attempt attempt, double dt);
  double local_order() const;
  bool may_grow(double dt, double times) const;
  Attempt try_step(double dt);
  void keep_for_return();
  void take_back();
  void commit_step();
  void return_to_start();
  bool scheme_step(double dt, double& error);
  bool composed_step(double dt, double& error);
  bool conserving() const;
  double force_time(double start, double dt) const;
  bool inner_step(double dt, int slot, double& error);
  Equations& equations_of_step();
  StepResult step_by_rule(double dt, int slot);
  void keep_reactions();
  void check_reversible(const Parameters& p) const;
  /// Matrices of earlier steps.
  void forget_matrix();
  void forget_contacts();

  // failure.cpp
  struct Place {
    int rod = -1, node = -1;
    std::string words;
  };
  Place place_of(int row) const;
  Place place_of_node(int node) const;
  std::string crushed() const;
  std::string unresolved() const;
  void check_resolution();
  std::string what_to_try() const;
  /// `hint`: what to try, where the caller knows better than `what_to_try`.
  [[noreturn]] void fail(const NewtonResult& newton, double dt, const std::string& what,
                         const std::string& hint = "") const;

  // step_length.cpp
  void watch_step(double dt, const Equations& system);
  std::string unresolved_in_time(double dt) const;
  void add_step_notes();

  // equilibrium.cpp
  EquilibriumResult equilibrium(double dt);
  void rest();
  Equations& statics();
  Equations& rescue();
  void refresh_reactions();

  // contacts.cpp
  void check_overlap() const;

  // obstacles.cpp
  /// Tells the contact of a step where obstacles are at its end; `release_obstacles`: that there is no step.
  void aim_obstacles(Equations& system, double time) const;
  static void release_obstacles(Equations& system);
  ObstacleWay obstacle_way(int obstacle) const;
  std::vector<ObstaclePlace> obstacle_places(const std::function<ObstacleWay(int)>& way) const;
  void check_turn(int obstacle, const Vector3& turn) const;

  // separation.cpp
  void separate();

  // energy.cpp
  Energy energy() const;
  Energy rod_energy(int rod) const;
  Energy energy_of(const State& at, double loads, double work_done, double lost) const;
  double actuation_energy() const;
  bool gains_energy();
  bool contact_pumps(double dt);
  void begin_explicit();
  std::string longest_explicit_step();
  void check_explicit();
};

/// Position of a node in space, from any configuration vector.
Vector3 node_position(const Model& model, const VectorX& q, int node);
Vector3 node_velocity(const Model& model, const VectorX& v, int node);
/// Directors of an edge: columns d1, d2, t.
Matrix3 edge_directors(const Model& model, const Configuration& c, int edge);
/// Rotation of a joint frame from the drawn axes.
Matrix3 frame_rotation(const Model& model, const State& state, int frame);

}  // namespace withe
