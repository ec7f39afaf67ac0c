#pragma once
/// What World is made of; private to this room.

#include <atomic>

#include "integrators/statics.hpp"
#include "model/edge_vectors.hpp"
#include "run/systems.hpp"
#include "world/crossings.hpp"
#include "world/running.hpp"

namespace withe {

/// What energies are made of besides the state, as parameters say.
struct EnergyCoefficients {
  ElasticCoefficients elastic;
  MassMatrix mass;
  VectorX node_mass;                             ///< [kg]
  Vector3 gravity;                               ///< [m/s^2]
  VectorX spring_stiffness, spring_rest_length;  ///< [N/m], [m]
  long version = -1, natural_version = -1;       ///< of the parameters

  void set(const Model& model, const Parameters& parameters);
};

/// Per connected component: kinetic energy beside a frame that travels along with it, what that leaves out, elastic
/// energy [J]; mass [kg], momentum [kg m/s], velocity of the frame [m/s].
struct ComponentEnergies {
  VectorX kinetic, travelling, elastic, mass, held_nodes;
  MatrixX3 momentum, frame;
};

/// Scratch for energies.
struct EnergyScratch {
  Configuration configuration;
  EnergyCoefficients coefficients;
  ContactAtRest contact;
  ComponentEnergies components;
};

/// Functions of who runs the scene, which copies do not take over.
struct Callbacks {
  CustomFunction force;
  std::function<void(double force_time, double end_time)> before_step;  ///< StepCallback, bound to its world
  bool prescribes = false;                                              ///< true if it may move supports and obstacles
  std::function<void()> poll;
};

/// Why a model is built: at first, because supports changed or the plane was left, or to take a snapshot's state.
enum class Rebuild { first, running, restored };

struct World::Implementation : Running {
  Implementation(SceneDescription description, Options options);
  /// The same scene at the same point, without what `lagged` knows: see `recall`.
  Implementation(const Implementation& other);
  /// Likewise, but `rebuild` is to follow: there are no equations yet.
  struct Unbuilt {};
  Implementation(const Implementation& other, Unbuilt);

  SceneDescription description;
  ContactDescription drawn_contact;  ///< which holds until it is set
  Options options;
  Model model;
  Systems systems;
  std::unique_ptr<Implementation> spatial_twin;  ///< of a planar scene: see `buckles_out_of_plane`
  std::shared_ptr<Tape> tape;                    ///< of a run that is kept for gradients
  Prescribed prescribed;                         ///< for the step or the equilibrium that was sought last
  mutable EnergyScratch energy_scratch;
  /// Before what was set since the state last moved; the work of that is found when it is asked for.
  EnergyCoefficients before_settings;
  bool newly_set = false;
  Division division;  ///< of the present time step
  struct : Moving {
    long taped = 0;  ///< length of the tape
  } kept;            ///< at the start of a part that may be taken back
  struct {
    StepHistory history;
    std::vector<SupportMotion> motions;
  } mark;  ///< at the start of a time step
  Plan plan;
  bool plan_current = false;  ///< made when it is asked for
  std::string plane_left_by;  ///< what left the plane, where something did
  Statistics statistics;
  Callbacks callbacks;
  std::atomic<bool> interrupted{false};
  double separated = 0;  ///< how far overlapping rods were moved before the start [m]
  bool spatial = false;  ///< left its plane while running
  Warnings warnings;
  std::unique_ptr<CrossingWatch> crossing_watch;  ///< made when first needed
  std::vector<LeftRing> left_rings;               ///< not heard of yet
  NewtonResult last_newton;

  void check_shares(const ContactPairDescription& pair) const;

  // building.cpp
  /// Lets interruptions reach the solver.
  void listen();
  void rebuild(Rebuild why);
  Model model_of_active(Rebuild why);
  void drop_scratch();
  void begin_as_drawn();
  void note_drawn_actuation();
  void carry_over(const Model& old, Rebuild why);
  void keep_moments(const Model& old, const ElasticCoefficients& before);
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
  void orient_frame(int frame, const Matrix3& free);
  void relax_together(const std::vector<int>& frames, const std::vector<Matrix3>& free);
  void add_frame_forces(const std::vector<int>& dofs, VectorX& g, Eigen::MatrixXd& H) const;

  // set_state.cpp
  bool leaves_plane(const RodState& rod) const;
  bool arrives(int support, const std::vector<bool>& told, const VectorX& q, HeldTarget& there);
  VectorX placed(const std::vector<RodState>& rods);
  void place_rods(const std::vector<RodState>& rods);
  void place_directors(const RodState& rod, const VectorX& q, const Configuration& before);
  void set_rates(const std::vector<RodState>& rods);
  void relax_joints(const std::vector<bool>& is_told);
  void turn_frames(const std::vector<bool>& is_told);
  std::vector<bool> moved_rods(const VectorX& before, const VectorX& now) const;
  void meet_anew(const std::vector<bool>& moved);
  /// What came before no longer tells what comes next.
  void forget_motion();

  // prescribed.cpp
  /// Leads a part of a natural shape to another value over a time [s].
  template <class Value>
  void begin_ramp(Ramp<Value>& ramp, const Value& now, const Value& value, double over);
  void take_contact();
  /// Leaves the plane of a planar scene where a parameter of the kind does.
  void leave_plane_for(const ParameterSetting& setting);
  void set(std::span<const ParameterSetting> settings);
  void apply_ramps(double time);
  Eigen::VectorBlock<VectorX> natural_stretch(int rod);
  void apply_ramps(double time, const Configuration& c, double& work);
  const Configuration& configuration() const;
  void retire_ramps();
  void note_actuation();
  bool actuated() const;
  bool turns_rods() const;
  /// Sets the poses of supports, the held unknowns and the places of obstacles at a time. No custom forces.
  void prescribe(double time, Prescribed& out) const;
  /// The present custom forces, and nothing else.
  Prescribed at_rest() const;
  void spread_jumps(double duration);
  /// The held unknowns when supports are there.
  void hold(const std::vector<SupportPose>& supports, HeldTarget& target) const;
  CustomForces custom_forces(double time, const VectorX& q, const VectorX& v, bool derivatives) const;
  /// Keeps custom forces as the present ones.
  void note(const CustomForces& now);
  /// Custom forces at a time, without velocities; empty where there are none.
  CustomResponse custom_response_at_rest(double time) const;
  /// Prescribes the custom forces of a step of dt, whose held unknowns are prescribed already.
  void prescribe_custom(double dt, Prescribed& out);
  /// Prescribes custom forces at rest at a time, which are solved for.
  void prescribe_custom_at_rest(double time, Prescribed& out);
  /// Evaluates custom forces at a time and a state, which become the present ones.
  void find_custom_force(double time, const VectorX& q, const VectorX& v);
  /// Evaluates custom forces where the explicit rules of a step of dt have them act.
  void find_custom_force_of_step(double dt, Prescribed& out);
  /// The present custom forces act throughout a step.
  void put_custom_force(Prescribed& out) const;

  // hands.cpp
  bool has_hands() const;
  bool has_rings() const;
  bool release_left_rings();
  bool hands_move(const std::vector<SupportMotion>& from, const std::vector<SupportMotion>& to) const;
  /// Present poses of supports.
  std::vector<SupportPose> support_poses() const;
  VectorX neutral_motion() const;
  /// Prepares `static_gradient` for the equilibrium that the scene is in; what it refers to is in `at`. Throws
  /// std::invalid_argument where no derivative is known.
  struct AtEquilibrium {
    State frames;
    Prescribed prescribed;
  };
  StepGradient& begin_gradient(AtEquilibrium& at) const;
  EquilibriumGradient equilibrium_gradient(const CoefficientAdjoint& coefficients, const HeldAdjoint& held) const;
  double hand_energy_of(int hand) const;
  void grasp(int hand);
  void regrip(const std::vector<std::vector<int>>& held_before);
  /// The unknowns that hands hold.
  void hold_hands(const std::vector<SupportPose>& supports, HeldTarget& target) const;
  /// Sets angles of the edges that a hand holds at a rotation, once all nodes have their places in `q`. False where an
  /// edge would turn by too much.
  bool hold_edges(int hand, const Matrix3& rotation, VectorX& q) const;
  Wrench hand_reaction(int hand, const VectorX& held) const;

  // stepping.cpp
  void advance(double duration);
  void advance_in_parts(double duration);
  /// `dt`: length of the next part; `share_taken`: of the time step, in so many tries.
  [[noreturn]] void fail_error_control(long tries, double duration, double dt, double share_taken) const;
  [[noreturn]] void fail_step(Verdict why, double dt) const;
  /// Error and turns of a part.
  struct PartResult {
    double error = 0;      ///< estimated [m]
    double turn = 0;       ///< greatest of an edge [rad]
    double held_turn = 0;  ///< greatest of what supports hold [rad]
  };
  /// Excess for which parts are rejected, beside errors: turn of supported edges over the greatest accurate turn; way
  /// of an obstacle [m].
  struct Excess {
    double turn = 0, way = 0;
  };
  Verdict try_step(const StepControl& control, double dt, Excess& rejected);
  Verdict judge(const StepControl& control, const PartResult& part, double dt, Excess& rejected);
  bool may_take_back() const;
  Contact* watched_contact() const;
  double held_turn_of(const PartResult& part) const;
  void take_back();
  void commit_step(const PartResult& part);
  void return_to_start();
  void call_before_step(double force_time, double end_time);
  bool scheme_step(double dt, PartResult& part);
  bool composed_step(double dt, PartResult& part);
  bool conserving() const;
  double force_time(double start, double dt) const;
  bool inner_step(double dt, int slot, PartResult& part);
  StepRule rule_of_step() const;
  StepResult step_by_rule(double dt, int slot);
  void check_impacts(const ContactDescription& contact) const;
  void check_reversible(const Parameters& p) const;

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

  // squeezed.cpp
  void check_squeeze();
  void check_squeezed(Equations& system, const Prescribed& given, const VectorX& q, double dt);
  [[noreturn]] void fail_squeezed(const Equations& system, const Squeezed& squeezed, double dt) const;

  // step_length.cpp
  void watch_step(double dt, const Equations& system);
  void sum_motion(double dt, bool first, const Equations& system);
  void forget_component(int component);
  std::string unresolved_in_time(double dt, int component) const;
  std::string unresolved_impact(double dt, const Equations& system);
  double bending_time(int edge) const;
  void add_step_notes();

  // gradients.cpp
  void check_tape();
  void record_step(StepRule rule, double dt, bool begins);
  Reached reached() const;

  // supports.cpp
  SupportMotion standing(const Support& support) const;
  void check_pose(int support, const std::optional<Vector3>& position, const std::optional<Matrix3>& rotation);
  void lump_held();
  void note_reactions();
  void note_residual();
  bool tensions_in_middle() const;
  void note_tensions();
  void keep_reactions(double dt, bool begins);
  void make_frame_moments();
  Wrench reaction_of(int support, const VectorX& held) const;

  // equilibrium.cpp
  EquilibriumResult equilibrium(double dt, Saddles saddles = Saddles::leave);
  /// A step of the static integrator, of dt and to `end`.
  void static_step(double end, double dt);
  /// Supports between two places. `from`, `to` and `out`, whose poses follow where a hand that yields moves, must
  /// outlive it.
  Boundary boundary_between(Equations& system, const std::vector<SupportMotion>& from,
                            const std::vector<SupportMotion>& to, Prescribed& out) const;
  [[noreturn]] void fail_equilibrium(const StaticResult& result, double dt) const;
  EquilibriumResult settle(Equations& system, StaticResult& result, double time);
  /// Whether a motion out of the plane lowers the potential of an equilibrium in it. Not asked where the scene is to
  /// stay in its plane, nor where what acts has no potential.
  bool buckles_out_of_plane();
  bool drifts(Equations& system, const Prescribed& given);
  bool even_contact(Equations& system, const Prescribed& given, bool arrived);
  void settle_contact(Equations& system, const Boundary& boundary, Saddles saddles, StaticResult& r);
  void rest();
  void refresh_reactions();

  // contacts.cpp
  void check_overlap() const;

  // obstacles.cpp
  ObstacleWay obstacle_way(int obstacle) const;
  double farthest_obstacle(const State& since) const;
  std::vector<ObstaclePlace> obstacle_places(const std::function<ObstacleWay(int)>& way) const;
  void check_turn(int obstacle, const Vector3& turn) const;

  // separation.cpp
  void separate();

  std::pair<Eigen::Index, Eigen::Index> load_rows(int load) const;  ///< the first, and how many

  // energy.cpp
  Energy energy() const;
  Energy rod_energy(int rod) const;
  Energy energy_of(const State& at, double loads, double work_done, double lost) const;
  /// To be called before parameters are set, and before the state moves or what is set is copied.
  void begin_setting();
  void account_for_settings();
  /// What has been set since changed the energy of the present state by this [J].
  double work_of_settings() const;
  double elastic_energy() const;
  bool gains_under_pressure();
  void find_component_energies(const State& then, ComponentEnergies& out) const;
  double touching_energy(const State& then);
  bool contact_pumps(double dt);
  /// Energies as they are now become those that the energy of steps is compared with, where a scheme does not conserve
  /// it by itself.
  void begin_energy_watch();
  void check_energy();
  std::string longest_explicit_step();
  void check_explicit();
  void check_drift();

  // crossings.cpp
  void begin_crossing_watch();
  void check_crossings();
};

/// Puts a node in space into a configuration vector.
void put_node(const Model& model, int node, const Vector3& position, VectorX& q);
/// Row of a stencil of another model of the same scene, or -1.
Eigen::Index same_stencil(const Model& model, const BendStencil& stencil);
Eigen::Index same_stencil(const Model& model, const FrameStencil& stencil);
/// Rotation of a joint frame from the drawn axes.
Matrix3 frame_rotation(const Model& model, const State& state, int frame);
/// Of an edge, by its nodes and its spin [rad/s].
Vector3 angular_velocity(const Model& model, const State& state, const Configuration& c, int edge);

}  // namespace withe
