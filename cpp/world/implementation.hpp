#pragma once
/// Data and functions of World; private to this room.

#include <atomic>

#include "integrators/statics.hpp"
#include "model/edge_vectors.hpp"
#include "run/built.hpp"
#include "run/crossings.hpp"
#include "run/custom_drive.hpp"
#include "run/running.hpp"
#include "run/systems.hpp"
#include "run/warnings.hpp"
#include "world/world.hpp"

namespace withe {

/// Functions of a user, which copies do not take over.
struct Callbacks {
  CustomFunction force;
  std::function<void(double force_time, double end_time)> before_step;  ///< StepCallback, bound to its world
  bool prescribes = false;                                              ///< true if it may move supports and obstacles
  std::function<void()> poll;
};

/// Why a model is built: at first, because supports changed or the plane was left, or to take a snapshot's state.
enum class Rebuild { first, running, restored };

struct World::Implementation : Built, Running {
  Implementation(SceneDescription description, Options options);
  /// A copy without the memory of solves: see `Systems::recall`.
  Implementation(const Implementation& other);
  /// A copy without equations: `rebuild` must follow.
  struct Unbuilt {};
  Implementation(const Implementation& other, Unbuilt);

  Systems systems;
  std::unique_ptr<Implementation> spatial_twin;  ///< of a planar scene: see `buckles_out_of_plane`
  std::shared_ptr<Tape> tape;                    ///< of a run that is kept for gradients
  Prescribed prescribed;                         ///< for the step or the equilibrium that was sought last
  mutable EnergyScratch energy_scratch;
  /// Coefficients before parameters were set in the present state. The work of setting them is found on demand.
  EnergyCoefficients before_settings;
  bool newly_set = false;
  Division division;        ///< of the present time step
  bool composable = false;  ///< true if the present time step may have fourth-order steps
  struct : Moving {
    long taped = 0;  ///< length of the tape
  } kept;            ///< at the start of a part that may be taken back
  struct {
    StepHistory history;
    std::vector<SupportMotion> motions;
  } mark;  ///< at the start of a time step
  Plan plan;
  bool plan_current = false;  ///< made when it is asked for
  Statistics statistics;
  Callbacks callbacks;
  std::atomic<bool> interrupted{false};
  Warnings warnings;
  std::unique_ptr<CrossingWatch> crossing_watch;  ///< made when first needed
  std::vector<LeftRing> left_rings;               ///< that the user has not asked for yet
  NewtonResult last_newton;

  // building.cpp
  /// Lets interruptions reach the solver.
  void listen();
  void rebuild(Rebuild why);
  void carry_over(const Model& old, Rebuild why);
  /// Makes equations for other loads than before.
  void remake_equations();
  /// Drops the plane; throws when the user asked for it. `why` names the argument that leaves the plane.
  void leave_plane(const std::string& why);

  // set_state.cpp
  void place(const std::vector<RodState>& rods);
  void renew_contacts(const std::vector<bool>& moved);
  /// Forgets predictions from past motion.
  void forget_motion();

  // prescribed.cpp
  void take_contact();
  void set_contact(ContactDescription wanted);
  /// Leaves the plane of a planar scene where a parameter of the kind does.
  void leave_plane_for(const ParameterSetting& setting);
  void set(std::span<const ParameterSetting> settings, double over);
  double shortest_ramp(const ParameterSetting& setting) const;
  void begin_ramp(const ParameterSetting& setting, double over);
  void end_ramp(const ParameterSetting& setting);
  /// Configuration of the present state.
  const Configuration& configuration() const;
  /// Contact in time steps; none where nothing can touch.
  Contact* contact() const { return systems.scheme().contact(); }
  void retire_ramps();
  void note_actuation();
  CustomDrive custom() { return {model, callbacks.force, *this}; }
  /// Prescribes the custom forces of a step of dt, whose held unknowns are prescribed already.
  void prescribe_custom(double dt, Prescribed& out);
  /// Evaluates custom forces where the explicit rules of a step of dt have them act.
  void find_custom_force_of_step(double dt, Prescribed& out);

  // hands.cpp
  bool release_left_rings();
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

  // stepping.cpp
  void advance(double duration);
  void advance_in_parts(double duration);
  /// `dt`: length of the next part; `share_taken`: of the time step, in so many tries.
  [[noreturn]] void fail_error_control(long tries, double duration, double dt, double share_taken) const;
  [[noreturn]] void fail_step(Verdict why, double dt) const;
  /// Error and turns of a part.
  struct PartResult {
    StepErrors errors;        ///< estimated [m]
    double turn = 0;          ///< greatest of an edge [rad]
    double held_turn = 0;     ///< greatest of what supports hold [rad]
    double rebound_gain = 0;  ///< greatest, see ReboundWork
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
  /// True if error control may take fourth-order steps. Nothing dissipates, and no function of a user needs to be
  /// called in the order of time. No support moves, because velocities of supports are known to second order only.
  bool may_compose() const;
  /// True if the present part is a fourth-order step.
  bool composes() const { return options.integrator == Integrator::fourth_order || lengths.composed; }
  bool composed_step(double dt, PartResult& part);
  bool inner_step(double dt, int slot, PartResult& part);
  StepRule rule_of_step() const;
  StepResult step_by_rule(double dt, int slot);

  // watches.cpp
  void check_resolution();
  void check_squeeze();
  void check_squeezed(Equations& system, const Prescribed& given, const VectorX& q, double dt);
  void begin_crossing_watch();
  void check_crossings();
  /// `hint`: what to try, where the caller knows better than `what_to_try`.
  [[noreturn]] void fail(const NewtonResult& newton, double dt, const std::string& what,
                         const std::string& hint = "") const;

  // supports.cpp
  void lump_held();
  void note_reactions();
  void note_residual();
  void note_tensions();
  void keep_reactions(double dt, bool begins);

  // equilibrium.cpp
  EquilibriumResult equilibrium(double dt, Saddles saddles = Saddles::leave);
  /// A step of the static integrator, of dt and to `end`.
  void static_step(double end, double dt);
  EquilibriumResult settle(Equations& system, StaticResult& result, double time);
  /// True if a motion out of the plane lowers the potential of an equilibrium in it. False where a user keeps the scene
  /// in its plane, or where forces have no potential.
  bool buckles_out_of_plane();
  void rest();
  void refresh_reactions();

  std::pair<Eigen::Index, Eigen::Index> load_rows(int load) const;  ///< the first, and how many

  // energy.cpp
  Energy energy() const;
  /// Called before parameters are set (`begin_setting`), and before the state moves or is copied.
  void begin_setting();
  void account_for_settings();
  /// Keeps the present energies for comparison with later ones, under schemes that do not conserve energy.
  void begin_energy_watch();
  void check_energy();
  std::string longest_explicit_step();
  void check_explicit();
};

}  // namespace withe
