#pragma once
/// Contact of a scene in one step: what touches, its energy and forces, friction, and how far an iterate may go.
///
/// Contact acts at the end configuration q1 of every scheme. Its potential k E(D) stays finite where centrelines cross,
/// so every iterate is shortened until no pair of centrelines passes through another on its way (`allowed`): the path
/// from one accepted state to the next keeps every knot.

#include <algorithm>
#include <utility>
#include <vector>

#include "contact/candidates.hpp"
#include "contact/friction.hpp"
#include "contact/friction_prediction.hpp"
#include "contact/pressing_law.hpp"
#include "contact/surfaces.hpp"

namespace withe {

/// Surfaces that carry the greatest force of their rod are this deep in each other, over the smaller radius.
inline constexpr double kDepth = 0.01;
/// No deeper than this where a step, an equilibrium or a drawing is accepted.
inline constexpr double kDeepest = 0.04;

/// How surfaces press in a step (see pressing_law.hpp): in statics and explicit steps, where nothing is known of
/// impacts; by the force at its end; by that of the whole step, where they have just met; and along the mean direction
/// too, so that sliding gains nothing.
enum class Pressing { still, end, mean, mean_direction };

/// What is never more where a contact becomes stiffer under load.
enum class Keep { force, energy };

/// Gradient and Hessian of one contact in its own unknowns.
struct ContactLocal {
  double gradient[kContactUnknowns];
  double hessian[kContactUnknowns][kContactUnknowns];
};

/// One contact as a person wants it.
struct ContactReport {
  ContactKey key;
  double distance = 0;      ///< of the centrelines, or of a centreline and the obstacle [m]
  double gap = 0;           ///< of the surfaces [m]
  double s = 0, t = 0;      ///< along the edges
  Vec3d point{}, normal{};  ///< between the surfaces; from b to a
  double force = 0;         ///< normal force [N]
  Vec3d friction{};         ///< on a [N]
  bool sticking = false;
};

class Contact {
 public:
  explicit Contact(const Model& model);

  const Surfaces& surfaces() const { return surfaces_; }
  /// Whether friction is there at all, and its Jacobian unsymmetric.
  bool frictional() const { return surfaces_.frictional(); }
  bool unsymmetric() const { return frictional() && !freezes(); }
  /// Whether friction goes with the way, and not with the velocity.
  bool anchored() const { return model_.description.contact.friction_law == FrictionLaw::anchored; }

  /// Where obstacles shall be at the end of the steps to come; nothing: where they are.
  void aim(std::vector<ObstaclePlace> places) { target_ = std::move(places); }
  /// Notes in a state that obstacles have come to where they were to go.
  void leave_obstacles(State& state) const {
    if (!target_.empty()) state.obstacles = target_;
  }
  /// Whether an obstacle would pass through a rod on its way through this step.
  bool blocked() const { return blocked_; }
  /// Work of moving obstacles on rods and on what contact stores, with the forces at q1 [J].
  double obstacle_work() const;

  /// A step begins at `state`, which must outlive it. `duration`: the time in which slip happens [s].
  void begin(const State& state, const Parameters& parameters, double duration, Pressing pressing);
  /// Finds what touches at q1.
  void update(const VectorX& q1);
  int count() const { return static_cast<int>(touching_.size()); }
  /// Unknowns of contact i, -1 where there is none.
  void unknowns(int i, int (&dofs)[kContactUnknowns]) const;
  const ContactKey& key(int i) const { return pair_of(i).key; }
  void local(int i, bool with_hessian, ContactLocal& out) const;
  /// Rounding of contact i's force for coordinates up to `reach` [N].
  double rounding(int i, double reach) const;
  /// Energy of contact and of anchors at q1, and at the start of the step [J].
  double energy() const;
  double start_energy() const { return start_energy_; }
  /// What pressing has put in over a step that ends at q1, `change` after its start: more than it stored before, and
  /// friction apart [J]. Below zero along a straight way onto a surface; above it where surfaces slide over a summit.
  double pressing_gain(const VectorX& change) const;
  /// What friction takes over such a step, what anchors store apart [J].
  double friction_loss(const VectorX& change) const;
  /// The same of an explicit step, whose velocities change by the mean of the forces at both its ends; `start`, `end`:
  /// `friction_force` there.
  double mean_friction_loss(const VectorX& change, const VectorX& start, const VectorX& end) const;
  /// Minus the generalised forces of friction at q1; empty where nothing has any.
  void friction_force(VectorX& out) const;
  /// Greatest depth of surfaces in each other, over the smaller radius.
  double depth() const;
  /// Whether that is more than a step may end with.
  bool too_deep() const { return depth() > deepest_; }
  void allow_depth(double deepest) { deepest_ = deepest; }
  /// Whether a step of dt would be too long for what an impact loses by its restitution.
  bool unresolved(double dt) const;

  /// What touches or is near at q1, sorted: what the matrix should have room for.
  std::vector<ContactKey> near();

  /// How much of a change of q1 may be made before centrelines come too close, from 0 to 1.
  double allowed(const VectorX& q1, const VectorX& change) { return candidates_.allowed(q1, change); }

  /// Whether friction grows with slip, so that it can be eased: by how much the slip tolerance is greater for a while.
  bool eases() const;
  void ease(double times) { eased_ = times; }

  /// Whether derivatives lack how pressing turns, the part by which it has negative stiffness.
  void leave_out_geometric(bool left_out) { geometric_ = !left_out; }

  /// Notes the friction that a step of Newton's method reckons with, by which `change` is to be added to q1.
  /// Derivatives are then what such steps need, and no longer those of the forces, until it is forgotten.
  void foresee_friction(const VectorX& change);
  void forget_foreseen() { foreseen_.clear(); }

  /// Takes from a predicted change of q what would move surfaces that stick: friction is steep there, and from outside
  /// Newton's method would fall past it.
  void hold_sticking(const State& state, VectorX& change) const;

  /// Keeps in `state`, still where the step began, what contacts at q1 must remember; their stiffness follows the
  /// forces. Returns the energy that this put in, below zero where it took some; if that is what to keep, no more than
  /// `spare` [J].
  double accept(State& state, Keep keep, double spare);
  /// The same for a step so short that stiffness stays as it is.
  void remember(State& state) const;
  /// Makes contacts of bodies that are too deep in each other stiffer; returns the energy put in [J].
  double stiffen(State& state, Keep keep);
  /// Gives a state that has none yet the stiffness that no rod falls below.
  void initialise(State& state, const Parameters& parameters);
  /// Contacts of a state at rest, for read-outs; and their energy.
  std::vector<ContactReport> report(const State& state, const Parameters& parameters);
  double energy_of(const State& state, const Parameters& parameters);
  /// The next step finds everything anew.
  void forget();

 private:
  /// Whether friction is that of contacts at the start of the step.
  bool freezes() const {
    const FrictionLaw law = model_.description.contact.friction_law;
    return law == FrictionLaw::lagged || law == FrictionLaw::semi_explicit;
  }
  struct Touching {
    ContactPair pair;
    Proximity proximity;
    ContactEnergy energy;  ///< times the stiffness
    double stiffness = 0, yielded = 0;
    double approach = 0, age = 0;  ///< see ContactRecord
    double before = 0;             ///< distance at the start of the step, where `law` needs it [m]
    PressingLaw law;
    PressingForce pressing;
    Vec3d stick{};
    int frozen = -1;  ///< friction of the start and no pressing: index in frozen_
  };
  /// Friction with J and N of the start of the step; semi-explicit: along the slip velocity there, where it has one.
  struct Frozen {
    double slip[3][kContactUnknowns];
    double pressing = 0;  ///< times how far from sticking the contact starts, if semi-explicit [N]
    Vec3d direction{};
    Vec3d drift{};   ///< what an obstacle moves along the surface [m]
    Vec3d turned{};  ///< of that, what it does by turning [m]
  };
  struct FrozenForce {
    Vec3d force{};       ///< on the slip, against it: minus friction on a [N]
    double slope[3][3];  ///< by the slip [N/m]
    bool sticking = false;
  };
  const ContactPair& pair_of(int i) const { return touching_[static_cast<std::size_t>(i)].pair; }
  const Bodies& bodies() const { return candidates_.bodies(); }
  int end_node(int edge, int end) const {
    return (end == 0 ? model_.edge_tail : model_.edge_head)[static_cast<std::size_t>(edge)];
  }
  static Vec3d force_on_nodes(const ContactPair& pair, const ContactLocal& local);
  static double depth_of(const ContactPair& pair, double distance) {
    return (pair.radii() - distance) / pair.small_radius();
  }
  /// What is too deep is what presses.
  static double depth_of(const ContactPair& pair, const Touching& t) {
    return depth_of(pair, t.proximity.distance + t.yielded);
  }
  /// Whether a stiffness is given.
  bool fixed(const ContactPair& pair) const {
    return pair.stiffness > 0.0 || model_.description.contact.stiffness > 0.0;
  }
  void set_force(Touching& t, const ContactRecord* record) const;
  void add_leaving(std::size_t first);
  double start_distance(const ContactPair& pair) const;
  double distance_before(const ContactPair& pair, const Touching& t) const;
  double first_approach(const ContactPair& pair) const;
  double approach_speed(const ContactPair& pair) const;
  double mass_of(const ContactPair& pair) const;
  double rest_speed(const ContactPair& pair) const;
  double swing_time(const ContactPair& pair, const Touching& t) const;
  double impact_share(const ContactPair& pair, const Touching& t) const;
  bool met(const ContactPair& pair) const;
  bool apart(const Touching& t) const;
  bool turns(const ContactPair& pair) const;
  void renew_impacts();
  bool renew_impact(Touching& t, ContactRecord& record) const;
  double start_stiffness(const ContactPair& pair, const VectorX& stiffness) const;
  double impact_stiffness(const ContactPair& pair) const;
  double first_stiffness(const ContactPair& pair) const;
  double tangential_stiffness(const ContactPair& pair, double stiffness) const;
  FrictionSetting setting(const Touching& t) const;
  double pressing_energy() const;
  bool add_friction_alone(const Touching& t, ContactLocal& out) const;
  double work_against(int i, const ContactLocal& local, const VectorX& change) const;
  void press(const Touching& t, bool with_hessian, ContactLocal& out) const;
  void add_pressing(const Touching& t, bool with_hessian, ContactLocal& out) const;
  void add_mean_pressing(const Touching& t, bool with_hessian, ContactLocal& out) const;
  void add_curve_pressing(const Touching& t, bool with_hessian, ContactLocal& out) const;
  void add_start_direction(const ContactPair& pair, const Vec3d (&x1)[4], double distance, double (&along)[9],
                           double (&hessian)[9][9]) const;
  CurveDistance<double> distance_at_start(const ContactPair& pair, Vec3d (&x)[4]) const;
  void add_friction(const Touching& t, bool with_hessian, ContactLocal& out) const;
  void add_frozen_friction(const Touching& t, bool with_hessian, ContactLocal& out) const;
  FrozenForce frozen_force(const Touching& t) const;
  Vec3d frozen_slip(const Touching& t) const;
  /// A contact's slip, what a change of q1 adds to it, and the friction on it.
  struct Slipping {
    Vec3d slip{}, change{};
    ForceLaw law;
    double limit = 0;  ///< [N]
  };
  Slipping frozen_slipping(const Touching& t, const VectorX& change) const;
  Slipping slipping(const Touching& t, const VectorX& change) const;
  const Vec3d* foreseen(const Touching& t) const { return foreseen_.of(t.pair.key); }
  double slip_rate() const;
  /// Of friction by the slip, at most [N/m].
  double friction_slope(const Touching& t) const;
  void set_direction(const ContactPair& pair, Frozen& frozen) const;
  void record_frozen(std::vector<ContactRecord>& records) const;
  void freeze();
  void freeze_slip(const Touching& t, Frozen& frozen) const;
  void set_parameters(const Parameters& parameters);
  void restart(const State& state, double duration);
  void look_at(const State& state, const Parameters& parameters);
  void move_obstacles();
  /// Way of a pair's obstacle in this step [m].
  Vec3d shift_of(const ContactPair& pair) const {
    return pair.key.b < 0 && !shift_.empty() ? shift_[static_cast<std::size_t>(-1 - pair.key.b)] : Vec3d{};
  }
  /// By which it turns then [rad].
  Vec3d turn_of(const ContactPair& pair) const {
    return pair.key.b < 0 && !turn_.empty() ? turn_[static_cast<std::size_t>(-1 - pair.key.b)] : Vec3d{};
  }
  /// Work of the obstacle's turning against friction [J].
  double turning_work(const Touching& t) const;
  const ContactRecord* record_of(const ContactKey& key) const;
  double change_stiffness(const Touching& t, double ratio, double yielded, ContactRecord& record) const;
  double yielded_at(const Touching& t, double ratio, Keep keep) const;
  /// Of a whole node, for a force to press surfaces no deeper than `kDepth` [N/m].
  static double wanted_stiffness(const ContactPair& pair, double force) {
    return force / (2.0 * kDepth * pair.small_radius() * pair.share);
  }
  double worn(const Touching& t) const;
  double faded(const Touching& t) const;
  /// By how much a contact's stiffness is to change, by the force that it carries.
  double wanted_ratio(const Touching& t, const ContactRecord& record) const;
  double source_stiffness() const;
  void record_friction(const Touching& t, ContactRecord& record) const;
  ContactRecord record(const Touching& t) const;
  void keep(std::vector<ContactRecord>& records, State& state) const;

  const Model& model_;
  Surfaces surfaces_;
  Candidates candidates_;
  std::vector<ObstaclePlace> target_;
  std::vector<Vec3d> shift_;  ///< of each obstacle in this step [m]; empty: none moves
  std::vector<Vec3d> turn_;   ///< likewise [rad]; empty: none turns
  bool blocked_ = false;
  std::vector<ContactRecord> renewed_;  ///< of contacts whose surfaces near each other anew in this step; sorted
  std::vector<ContactKey> unrecorded_;  ///< what touches at the start of the step and has no record
  bool starting_ = false;
  bool current_ = false;  ///< touching_ is what touches at q1_
  const State* state_ = nullptr;
  bool geometric_ = true;
  Pressing pressing_ = Pressing::end;
  double gravity_ = 0;  ///< [m/s^2]
  double duration_ = 0, eased_ = 1, start_energy_ = 0, start_pressing_ = 0, deepest_ = kDeepest;
  VectorX q1_;
  FrictionPrediction foreseen_;
  std::vector<Touching> touching_, lagged_;
  std::vector<Touching> leaving_;  ///< what gives back in this step what it took, wherever it ends
  std::vector<Frozen> frozen_;
  long version_ = -1;  ///< of the parameters that the next two belong to
  VectorX least_stiffness_;
  VectorX edge_mass_;  ///< [kg]
};

}  // namespace withe
