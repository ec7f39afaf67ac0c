#pragma once
/// Problem of contact in one step: const while the step is solved.

#include <algorithm>
#include <vector>

#include "contact/bodies.hpp"
#include "contact/pressing_law.hpp"

namespace withe {

/// Law of the pressing force in a step (see pressing_law.hpp). `still`: for statics and explicit steps, without
/// impacts. `end`: the force at the end of the step. `mean`: the force of the whole step, for surfaces that have just
/// met. `mean_direction`: as `mean`, and along the mean direction too, so that sliding gains no energy.
enum class Pressing { still, end, mean, mean_direction };

/// Gradient and Hessian of one contact in its own unknowns.
struct ContactLocal {
  double gradient[kContactUnknowns];
  double hessian[kContactUnknowns][kContactUnknowns];
};

/// The same of a piece of a planar curve.
struct PlaneLocal {
  double gradient[kPlaneUnknowns];
  double hessian[kPlaneUnknowns][kPlaneUnknowns];
};

/// Impact with a restitution below 1, which happens within one step; see rebound.hpp.
struct Strike {
  bool happens = false;
  double apart = 0;  ///< distance of the surfaces at the end of the step; below 0: their depth [m]
  double speed = 0;  ///< at which the surfaces part then [m/s]
};

/// One contact at a configuration.
struct Touching {
  ContactPair pair;
  Proximity proximity;
  double now[kContactUnknowns] = {};  ///< its unknowns
  ContactEnergy energy;               ///< times the stiffness
  double stiffness = 0, yielded = 0;
  double approach = 0, age = 0;  ///< see ContactRecord
  double before = 0;             ///< distance at the start of the step, where `law` needs it [m]
  double turn = 0;               ///< for a new impact: angle between its directions at both ends of the step [rad]
  Strike strike;
  PressingLaw law;
  PressingForce pressing;
  Vec3d stick{}, roll{};  ///< elastic slips, see ContactRecord
  int lagged = -1;        ///< friction of the start and no pressing: index in ContactProblem::lagged_friction

  /// Ends of edges as `Bodies::end_points` has them.
  void end_points(Vec3d (&x)[4]) const {
    for (int i = 0; i < 4; ++i) x[i] = {now[3 * i], now[3 * i + 1], now[3 * i + 2]};
  }
  /// Depth of the surfaces in each other, less the yielded part, over the smaller radius.
  double depth() const { return (pair.radii() - (proximity.distance + yielded)) / pair.scale; }
  /// True if no more than the tail of the contact law presses the surfaces.
  bool apart() const { return proximity.distance + yielded >= pair.radii(); }
  /// True of an impact with a restitution below 1 that a force at the end of the step has turned round.
  bool struck() const { return strike.happens && pressing.first < 0.0; }
};

/// Place of a pair in a sorted part of a list of contacts: of itself, or of the first one behind it.
template <class Iterator>
Iterator place_of(const ContactKey& key, Iterator from, Iterator end) {
  return std::lower_bound(from, end, key,
                          [](const Touching& t, const ContactKey& other) { return comes_before(t.pair.key, other); });
}

/// Friction with J and N of the start of the step; semi-explicit: along the slip velocity there, where it has one.
struct LaggedFriction {
  double slip[3][kContactUnknowns];
  double pressing = 0;  ///< times how far from sticking the contact starts, if semi-explicit [N]
  Vec3d direction{};
  Vec3d drift{};   ///< motion of an obstacle along the surface [m]
  Vec3d turned{};  ///< part of it by rotation [m]

  Vec3d column(int i) const { return {slip[0][i], slip[1][i], slip[2][i]}; }
};

/// Depth of two bodies in each other below which they do not press, if they press as a step begins.
struct BodyOffset {
  int rod = 0, other = 0;  ///< the latter, or an obstacle as -1 - index
  double force = 0;        ///< [N]
  double moment = 0;       ///< sum of forces times depths that press no more [N m]
};

/// Parameters that contact needs.
struct ContactParameters {
  ContactParameters() = default;
  ContactParameters(const Surfaces& surfaces, const Parameters& parameters);

  long version = -1;
  double gravity = 0;         ///< [m/s^2]
  Vec3d pull{};               ///< gravity, in the axes of the unknowns [m/s^2]
  double slip_tolerance = 0;  ///< nu [m/s]
  VectorX edge_mass;          ///< [kg]
  VectorX least_stiffness;    ///< lower bound of the stiffness of contacts, per rod [N/m]
  VectorX firm_stiffness;     ///< per rod, from which on the distance tolerance is whole [N/m]
};

struct ContactProblem {
  const Surfaces* surfaces = nullptr;
  const ContactParameters* parameters = nullptr;
  const State* start = nullptr;
  Pressing pressing = Pressing::still;
  double duration = 0;                 ///< the time in which slip happens [s]
  Bodies bodies;                       ///< with obstacles in their positions at the end
  std::vector<Vec3d> shift;            ///< displacement of each obstacle in the step [m]; empty: none moves
  std::vector<Vec3d> turn;             ///< rotation of each obstacle in the step [rad]; empty: none turns
  std::vector<Vec3d> velocity;         ///< velocity of each obstacle's points in the step [m/s]; empty: none moves
  bool starting = false;               ///< true while the contacts at the start of the step are searched
  std::vector<BodyOffset> offsets;     ///< of bodies that have any
  std::vector<ContactRecord> renewed;  ///< records of contacts that begin with the scene, or whose surfaces approach
                                       ///< again in the step; sorted
  std::vector<ContactKey> unrecorded;  ///< contacts at the start without a record
  std::vector<Touching> leaving;       ///< contacts that return their energy in the step, for any end of it
  std::vector<Touching> striking;      ///< impacts that end with surfaces apart, for any end of the step; sorted
  std::vector<Touching> lagged;        ///< contacts of the start, for their friction alone
  std::vector<LaggedFriction> lagged_friction;
  double start_energy = 0, start_pressing = 0;  ///< energy of contact and anchors, and of pressing alone [J]

  const Model& model() const { return *bodies.model; }
  const ContactDescription& description() const { return model().description.contact; }
  bool frictional() const { return surfaces->frictional(); }
  /// True if friction is that of contacts at the start of the step.
  bool lags() const { return lags(model()); }
  static bool lags(const Model& model) {
    const FrictionLaw law = model.description.contact.friction_law;
    return law == FrictionLaw::lagged || law == FrictionLaw::semi_explicit;
  }
  /// True if edges spin by the rates of finite rotations, as in energy-momentum steps.
  bool finite_turns() const { return pressing == Pressing::mean_direction; }
  /// True if the Jacobian of friction is unsymmetric.
  bool unsymmetric() const { return frictional() && !lags(); }
  bool anchored() const { return description().friction_law == FrictionLaw::anchored; }
  /// Way of a pair's obstacle in the step [m], and by which it turns then [rad].
  Vec3d shift_of(const ContactPair& pair) const { return of_obstacle(pair, shift); }
  Vec3d turn_of(const ContactPair& pair) const { return of_obstacle(pair, turn); }
  /// Known before anything is found, unlike the way.
  Vec3d velocity_of(const ContactPair& pair) const { return of_obstacle(pair, velocity); }
  /// Record of a contact as the step begins, or null.
  const ContactRecord* record_of(const ContactKey& key, OrderedLookup& lookup) const {
    const ContactRecord* found = renewed.empty() ? nullptr : find_record(renewed, key);
    return found ? found : find_record(start->contacts, key, lookup);
  }
  const ContactRecord* record_of(const ContactKey& key) const {
    OrderedLookup lookup;
    return record_of(key, lookup);
  }
  /// Initial yielded depth of a new contact: the mean depth of its bodies' contacts, weighted by force. A contact that
  /// takes over from a resting one is then neither lower nor higher [m].
  double offset(const ContactPair& pair) const;
  void find_offsets();
  /// True if surfaces at that distance, with this yielded depth, are near enough to press.
  bool touch(const ContactPair& pair, double distance, double yielded) const {
    return distance + (offsets.empty() ? 0.0 : std::min(yielded, offset(pair))) < pair.reach();
  }
  /// True if a stiffness is given.
  bool fixed(const ContactPair& pair) const {
    return pair.stiffness > 0.0 || surfaces->parameters().contact_stiffness > 0.0;
  }
  /// From which stiffness on, of a whole node, the distance tolerance of a pair is whole [N/m].
  double firm_stiffness(const ContactPair& pair) const {
    const VectorX& of_rod = parameters->firm_stiffness;
    return pair.rod_b < 0 ? of_rod(pair.rod_a) : std::max(of_rod(pair.rod_a), of_rod(pair.rod_b));
  }
  /// Stiffness of a whole node at which surfaces carry a force, or store an energy, at the corresponding depth [N/m].
  double stiffness_to_bear(const ContactPair& pair, double force) const;
  double stiffness_to_store(const ContactPair& pair, double energy) const;
  /// Stiffness that carries a multiple of the force of another stiffness, for a pair or rod with that firm stiffness.
  double stiffness_to_bear_more(double firm, double stiffness, double times) const;
  /// The distance tolerance of a contact so stiff, of a whole node [m].
  double tolerance(const ContactPair& pair, double stiffness) const;
  /// Mass of the edges, or of half of both beside a node, that a contact holds up [kg].
  double mass_of(const ContactPair& pair) const;
  /// Adds `by` times its derivatives by masses of edges.
  void add_mass_slopes(const ContactPair& pair, double by, VectorX& edge_mass) const;
  /// True if surfaces press along the mean direction of the step. Curves have a mean of their own; and in a midpoint
  /// step only rods do, which thereby keep their angular momentum, unless friction is to stay symmetric.
  bool turns(const ContactPair& pair) const;
  /// True if curves do, along shares of the directions at both ends.
  bool means_direction() const {
    return pressing == Pressing::mean_direction || (pressing == Pressing::mean && unsymmetric());
  }
  /// A curve's distance as the step begins, an obstacle being where it was.
  CurveDistance<double> curve_at_start(const ContactPair& pair) const {
    return bodies.piece_distance(pair, start->q, shift_of(pair));
  }
  /// The closest points as the step begins, and the end points then, with the initial position of an obstacle.
  ClosestPoints closest_at_start(const ContactPair& pair, Vec3d (&x)[4]) const;

 private:
  /// From a stiffness at the whole depth to that at the depth that goes with it; both to `power` are in proportion.
  double at_own_depth(double firm, double stiffness, double power) const;
  static Vec3d of_obstacle(const ContactPair& pair, const std::vector<Vec3d>& ways) {
    return pair.key.b < 0 && !ways.empty() ? ways[static_cast<std::size_t>(-1 - pair.key.b)] : Vec3d{};
  }
};

}  // namespace withe
