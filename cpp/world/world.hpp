#pragma once
/// A scene while it runs: model + state + workspace behind one object; step, read out, snapshot, restore.

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/SparseCore>

#include "common/types.hpp"
#include "forces/custom_forces.hpp"
#include "gradients/tape.hpp"
#include "integrators/options.hpp"
#include "model/parameter_index.hpp"
#include "run/energy.hpp"
#include "run/failure.hpp"
#include "run/placing.hpp"
#include "run/plan.hpp"
#include "run/read.hpp"
#include "run/warnings.hpp"

namespace withe {

struct Statistics {
  long steps = 0;  ///< inner steps accepted
  long rejected_steps = 0;
  long iterations = 0;   ///< Newton iterations
  long evaluations = 0;  ///< of the residual, with or without its matrix
  long factorizations = 0;
  double largest_turn = 0;  ///< of an edge in one step [rad]; plain midpoint loses energy balance above about 0.1
  long energy_momentum_steps = 0;  ///< inner steps by that rule, those of fourth order included
  long fourth_order_steps = 0;     ///< steps composed of five
  /// Greatest amplitude so far of motion that steps under `tolerance` do not resolve [m].
  double unresolved_amplitude = 0;
  long branch_changes = 0;  ///< equilibria that were found on another branch
  double assembly_time = 0, solve_time = 0, fluid_time = 0, total_time = 0;  ///< [s]
};

struct Reaction {
  Vector3 force = Vector3::Zero();   ///< of the support on the rod [N]
  Vector3 moment = Vector3::Zero();  ///< of the support on the rod, about the node [N m]
};

/// Displacement of the held part of a rod in its hand, along the hand's axes and about them.
struct Deflection {
  Vector3 shift = Vector3::Zero(), turn = Vector3::Zero();  ///< [m], [rad]
  Vector3 slip = Vector3::Zero();                           ///< slip beside that [m]
};

/// Passage of a rod through a ring.
struct RingPassage {
  bool passes = false;   ///< until an end of the rod has passed
  double at = 0;         ///< arc length of the rod [m]
  double pull = 0;       ///< of the ring on the rod, back along it [N]
  double press = 0;      ///< across it [N]
  double feed_rate = 0;  ///< of its drive [m/s]
};

/// A ring that is released, since an end of its rod has passed.
struct LeftRing {
  int support = 0;
  double time = 0;  ///< [s]
};

struct EquilibriumResult {
  bool stable = false;
  /// True if the stiffness alone decides the stability. Loads that turn with the rod make it unsymmetric; flutter then
  /// depends on mass too.
  bool decided = true;
  bool branch_changed = false;  ///< a jump, or a saddle that was left, lies between the state before and this one
  int iterations = 0;
  double residual = 0;  ///< greatest force out of balance [N]
};

/// A path of equilibria by arc length; see arc_length.hpp.
struct PathOptions {
  std::vector<int> loads;  ///< whose values go with the factor; none: the motion of supports and what is out of balance
  double start = 0, end = 1;
  int most_points = 1000;
  double turn = 0.1;  ///< greatest turn of an edge between two points [rad]
};

struct PathPoint {
  double factor = 0;
  bool stable = false, limit = false;
  MatrixX3 positions;        ///< every node once [m]
  MatrixX3 forces, moments;  ///< per support, zero where it is released [N], [N m]
};

struct EquilibriumPath {
  std::vector<PathPoint> points;
  bool finished = false;
  int iterations = 0;
};

/// Contacts, one per row.
struct ContactTable {
  /// Rod and edge of a; rod and edge of b, or -1 - obstacle and -1; whether it sticks.
  Eigen::Matrix<int, Eigen::Dynamic, 5, Eigen::RowMajor> bodies;
  /// Columns: distance of the centrelines (of a centreline and an obstacle's plane or axis); gap of the surfaces. Point
  /// (3); normal from b to a (3). Normal force; friction on a (3). Place along a and along b, from 0 to 1.
  Eigen::Matrix<double, Eigen::Dynamic, 14, Eigen::RowMajor> numbers;
};

/// Equations linearised about the present configuration, without what supports hold: mass x'' + stiffness x = 0. The
/// stiffness is geometric + gradients^T diag(stiffnesses) gradients. The parts are kept apart because the sum rounds
/// away slow motions. These bend N edges by 1 / N^2 of what a single node's motion would. Their energy is some 1 / N^4
/// of the sum's entries.
struct Linearisation {
  SparseMatrix geometric;     ///< free unknowns x free unknowns: of forces in the rods, loads, contact
  SparseMatrix gradients;     ///< strains x free unknowns: elongations [m], discrete curvatures and twists [-]
  VectorX stiffnesses;        ///< per strain: [N/m], [N m]
  SparseMatrix mass;          ///< free unknowns x free unknowns
  SparseMatrix displacement;  ///< (3 nodes) x free unknowns: node displacements [m] of each unknown
  SparseMatrix turn;          ///< (dimension x edges) x free unknowns: by how much edges turn or stretch [-]
  VectorX imbalance;          ///< per free unknown, what is out of balance: [N], [N m]
};

/// Derivatives of scalars of an equilibrium by what acts, and by where supports hold and obstacles are.
struct EquilibriumGradient {
  ParameterGradient parameters;
  PoseAdjoint poses;
  DrawnAdjoint drawn;
};

struct EquilibriumGradients {
  std::vector<EquilibriumGradient> scalars;
  /// Gradients of the work of the residual over a motion that costs nothing, such as the spin of a free rod, and over a
  /// random motion. Empty where no motion is free. A parameter on which the former depends drives that motion, and has
  /// no derivative.
  std::vector<EquilibriumGradient> works;
};

class World {
 public:
  World(SceneDescription description, Options options);
  World(const World&);
  World& operator=(const World&) = delete;
  ~World();

  const SceneDescription& description() const;
  const Options& options() const;
  const Plan& plan() const;
  /// Normal of the plane that the scene moves in, if it does.
  std::optional<Vector3> plane_normal() const;
  /// True if frames of joints and clamps, and hinges on them, are turned as they were drawn, within 1e-9.
  bool frames_as_drawn() const;
  const Statistics& statistics() const;
  double time() const;

  /// Advances exactly `count` time_steps. Throws ConvergenceFailure; the state is then the last accepted one.
  void step(int count = 1);
  /// Advances to `time`, with time_steps stretched or shortened evenly to land on it.
  void advance_to(double time);
  EquilibriumResult equilibrium(Saddles saddles = Saddles::leave);
  /// Follows a path of equilibria through limit points, to its last point.
  EquilibriumPath equilibrium_path(const PathOptions& wanted);
  /// From another thread or a signal: ends a running step() or equilibrium() within one Newton iteration (throws
  /// Interrupted), with the state the last accepted one.
  void interrupt();

  // Called before every inner step. `force_time`: time at which loads act in this step; `end_time`: its end. May call
  // set_load and, if it `prescribes`, prescribe. Empty: none.
  using StepCallback = std::function<void(World&, double force_time, double end_time)>;
  void set_step_callback(const StepCallback& callback, bool prescribes = true);
  /// Asked before every inner step and Newton iteration; what it throws ends the call, with the state the last
  /// accepted one. Must leave the world alone. Empty: none.
  void set_poll(const std::function<void()>& poll);
  /// Custom forces, evaluated at the time at which the scheme's forces act: once an inner step, for the state
  /// extrapolated to that time. Where the scene solves for them (`custom_implicit`), and in every equilibrium, they are
  /// evaluated for each state that Newton's method tries. Empty: the last forces stay.
  void set_force_function(const CustomFunction& force);

  /// One row, or one an edge, as it was put on: world axes of the drawn scene [N], [N m], [N/m].
  void set_load(int load, const Eigen::Ref<const MatrixX3>& values);
  MatrixX3 load(int load) const;
  int add_load(const LoadDescription& load);  ///< acts from now on; its index
  void remove_load(int load);                 ///< one put on while running; those after it move up by one
  /// Sets parameters by their index, all or, where one is refused, none. What this does to the energy at the present
  /// state is work of actuation.
  void set(std::span<const ParameterSetting> settings, double over = 0.0);
  MatrixX parameter(ParameterKind kind, int owner = 0) const;  ///< present values of a rod, a part or the scene
  /// Ramped linearly over `over` seconds from now (0: at once); a row a stencil, or one for all.
  void set_natural_curvature(int rod, const MatrixX2& curvature, double over);
  void set_natural_twist(int rod, const VectorX& twist, double over);
  /// Length of every edge free of stress, or one for all, over that of the drawing [-]; ramped as curvature.
  void set_natural_stretch(int rod, const VectorX& stretch, double over);
  MatrixX2 natural_curvature(int rod) const;  ///< present value, of the smooth rod [1/m]
  VectorX natural_twist(int rod) const;       ///< [rad/m]
  /// Time at which the ramp of a parameter ends [s]; nothing without a ramp.
  std::optional<double> due(ParameterKind kind, int owner) const;
  void set_added_mass(const VectorX& mass);
  void set_gravity(const Vector3& gravity);

  // Supports; indices are rows of description().supports.
  int add_support(const SupportDescription& support);  ///< holds the present position and orientation
  void remove_support(int support);                    ///< the next one to be added takes its row
  /// Target position [m] and rotation relative to the drawn orientation, reached `over` seconds from now. What is not
  /// given goes on as it does. `roll` [rad] is the part of the rotation about the drawn axis of the support, in drawn
  /// axes, with full turns counted. Only an equilibrium or a static step follows it, so `over` must be 0.
  void move_support(int support, const std::optional<Vector3>& position, const std::optional<Matrix3>& rotation,
                    double over, const Vector3& roll = Vector3::Zero());
  /// Sets position and rotation at the end of the coming inner step, from the step callback.
  void prescribe_support(int support, const std::optional<Vector3>& position, const std::optional<Matrix3>& rotation);
  Vector3 support_position(int support) const;
  Matrix3 support_rotation(int support) const;
  /// The rotation that a support turns to, and when it is there [s].
  std::pair<Matrix3, double> support_turn(int support) const;
  Reaction reaction(int support) const;  ///< of a hand: about where it is
  /// Force and moment that a joint with a body transmits to the parts of `side`, about its node. `joint`: row of
  /// description().joints. `side`: rods and bodies at the joint.
  Reaction joint_reaction(int joint, const std::vector<RodPass>& side) const;
  Deflection deflection(int support) const;  ///< of a hand
  /// The drive of a ring feeds the rod towards its end from now on, by length at rest [m/s].
  void feed(int support, double rate);
  RingPassage passage(int support) const;  ///< of a ring
  /// Friction of a ring without a drive, from now on [-]. The change of the energy stored there is work of actuation.
  void set_ring_friction(int support, double friction);
  /// Rings that were released since this was last asked, at the end of the time step in which their rods left them.
  std::vector<LeftRing> take_left_rings();

  // Obstacles. Their place is that of the point they are drawn with: a plane's, a sphere's centre, a capsule's start.
  // They turn about the normal of a plane, the axis of a capsule, the centre of a sphere, by `turn` since drawn [rad].
  /// Reached `over` seconds from now. What is not given goes on as it does.
  void move_obstacle(int obstacle, const std::optional<Vector3>& position, const std::optional<Vector3>& turn,
                     double over);
  /// Sets the place at the end of the coming inner step.
  void prescribe_obstacle(int obstacle, const std::optional<Vector3>& position, const std::optional<Vector3>& turn);
  Vector3 obstacle_position(int obstacle) const;  ///< [m]
  Vector3 obstacle_turn(int obstacle) const;      ///< [rad]
  /// Index of the pair of two bodies that owns contact parameters; a new pair has those of the obstacle or the scene.
  /// A body is a rod, or -1 - index of an obstacle.
  int own_contact(int first, int second);
  /// Friction of the nodes, then of the edges, of a rod on an obstacle, over the coefficients of their pair. The pair
  /// is one of the description's.
  void set_friction_shares(int pair, const VectorX& shares);

  // Read-outs: copies.
  MatrixX3 positions() const;   ///< every node once [m]
  MatrixX3 velocities() const;  ///< [m/s]
  void set_velocities(const MatrixX3& velocities);
  /// Puts rods into the given states, all at once. Frames of joints take the orientation that stresses them least,
  /// and turn as the edges at them do on the mean. Throws std::invalid_argument, and changes nothing, where a support
  /// holds what would move, an edge has no length, or surfaces would overlap.
  void set_state(const std::vector<RodState>& rods, std::optional<double> time);
  MatrixX9 directors(int rod) const;         ///< per edge
  MatrixX2 curvatures(int rod) const;        ///< per stencil, of the smooth rod [1/m]
  VectorX twists(int rod) const;             ///< per stencil [rad/m]
  VectorX tensions(int rod) const;           ///< per edge, in the middle of the last step if by the midpoint rule [N]
  double spring_tension(int spring) const;   ///< positive where it pulls; its damper's part included [N]
  double tendon_length(int tendon) const;    ///< from its first guide to its last [m]
  MatrixX3 tendon_points(int tendon) const;  ///< where its guides are [m]
  double joint_angle(int joint) const;       ///< of what turns, from how it is drawn, whole turns counted [rad]
  double joint_rate(int joint) const;        ///< [rad/s]
  double joint_torque(int joint) const;      ///< on what turns: of its motor, its stiffness and its damping [N m]
  Matrix3 body_rotation(int body) const;     ///< of a rigid body since it was drawn
  Vector3 body_spin(int body) const;         ///< angular velocity of a rigid body [rad/s]
  int body_base(int body) const;             ///< node whose unknowns are those of a rigid body
  /// Sets the velocity of the base of a body [m/s], and its angular velocity [rad/s]; all its points follow.
  /// `held`: velocity of that node in the directions that supports hold.
  void set_body_motion(int body, const Vector3& velocity, const Vector3& spin, const Vector3& held);
  VectorX spins(int rod) const;  ///< per edge, angular velocity about the tangent [rad/s]
  Energy energy() const;
  /// Energy of one rod: kinetic, stretch, bend, twist, gravity and their sum. The energy around a joint belongs to the
  /// rods whose edges meet there. The sum over all rods is that of the scene without loads, contact and the ledger.
  Energy rod_energy(int rod) const;
  Momentum momentum() const;
  /// Warnings since they were last taken.
  Warnings take_warnings();
  ContactTable contacts() const;
  Linearisation linearise() const;

  /// Gradients of scalars whose derivatives by read-outs are given, in the present equilibrium. Throws
  /// std::invalid_argument where the scene is in none, or where no gradient is known.
  EquilibriumGradients equilibrium_gradients(const std::vector<ReadoutAdjoint>& by) const;
  /// Forward mode, for few numbers and many read-outs. `equilibrium_residual`: residual of statics with the present
  /// forces, per unknown. `support_directions`: derivative of the unknowns that a support holds by its position and a
  /// rotation vector, (unknowns, 6). `equilibrium_responses`: motions of nodes, (3 nodes, n), where the residual and
  /// the held unknowns change by the columns of the arguments. They throw std::invalid_argument where rods touch, with
  /// custom forces, and where `equilibrium_gradients` does.
  VectorX equilibrium_residual() const;
  MatrixX support_directions(int support) const;
  MatrixX equilibrium_responses(const MatrixX& residual, const MatrixX& held) const;
  /// Keeps the steps from here on, for gradients; nothing: no more.
  std::shared_ptr<Tape> start_tape();
  /// A frame has been taken of the run that is recorded.
  void note_moment();
  void stop_tape();
  /// From where another world of the same scene is to where this one is, as a vector; see state_vector.hpp.
  VectorX state_difference(const World& reference) const;
  /// Adds such a vector to the present state. Throws std::invalid_argument, and changes nothing, where that is no
  /// state.
  void displace_state(const VectorX& by);

  /// The whole state as bytes, for a description and options equal to this world's (supports may differ).
  std::string snapshot() const;
  /// Throws std::invalid_argument when the bytes are damaged or belong to another scene.
  void restore(const std::string& bytes);

  struct Implementation;

 private:
  /// With the work of what was set accounted for: what goes on from here does so with the same bits.
  Implementation& accounted() const;
  std::unique_ptr<Implementation> implementation_;
};

/// Thrown by step() and equilibrium() after interrupt(). Becomes KeyboardInterrupt.
class Interrupted : public std::runtime_error {
 public:
  Interrupted() : std::runtime_error("interrupted") {}
};

}  // namespace withe
