#pragma once
/// State of a scene: the values that change while it runs.

#include <algorithm>
#include <compare>
#include <vector>

#include "model/model.hpp"

namespace withe {

/// Whose surfaces meet: edge `a` (its end `end` against a plane; else -1) and edge `b`, or an obstacle as -1 - index.
struct ContactKey {
  int a = 0, b = 0, end = -1;
  friend auto operator<=>(const ContactKey&, const ContactKey&) = default;
};

/// Memory of a contact from one step to the next.
struct ContactRecord {
  ContactKey key;
  double force = 0;      ///< pressing the surfaces apart [N]
  double stiffness = 0;  ///< [N/m]
  double yielded = 0;    ///< depth that presses no more, since the contact became stiffer under load; fades [m]
  double approach = 0;   ///< speed at which the surfaces met [m/s]; 0: they rest on each other
  double age = 0;        ///< time since then [s]
  Vec3d stick{};         ///< elastic slip of an anchored contact, of a's surface over b's [m]
  Vec3d roll{};          ///< elastic slip of anchored rolling friction, by a's turning alone [m]
  Vec3d friction{};      ///< friction force on body a [N]
  bool sticking = false;
};

/// Place of an obstacle, in the axes of the unknowns (in a plane: its two, and zero).
struct ObstaclePlace {
  Vec3d point{}, other{};  ///< plane: a point, and the normal; capsule: both ends [m]
  Vec3d turn{};            ///< about its own axis, since it was drawn; full turns count [rad]
  Vec3d velocity{};        ///< velocity in the last step [m/s]
};

/// Finds items by their keys in a sorted sequence. Searches mostly come in this order, so that the item after the last
/// one is checked first.
class OrderedLookup {
 public:
  /// Returns null if there is none. `key_of(item)` is the key.
  template <class Items, class KeyOf>
  auto find(Items& items, const ContactKey& key, const KeyOf& key_of) -> decltype(items.data()) {
    if (next_ >= items.size() || !(key_of(items[next_]) == key)) {
      const auto found = std::lower_bound(items.begin(), items.end(), key,
                                          [&](const auto& item, const ContactKey& k) { return key_of(item) < k; });
      if (found == items.end() || !(key_of(*found) == key)) return nullptr;
      next_ = static_cast<std::size_t>(found - items.begin());
    }
    return &items[next_++];
  }

 private:
  std::size_t next_ = 0;
};

/// The record of a contact among sorted ones, or null.
template <class Records>
auto find_record(Records& records, const ContactKey& key, OrderedLookup& lookup) -> decltype(records.data()) {
  return lookup.find(records, key, [](const ContactRecord& r) -> const ContactKey& { return r.key; });
}
template <class Records>
auto find_record(Records& records, const ContactKey& key) -> decltype(records.data()) {
  OrderedLookup lookup;
  return find_record(records, key, lookup);
}

/// Passage of a rod through a ring; see forces/ring.hpp.
struct RingState {
  SplinePlace place;         ///< where
  double origin = 0;         ///< s0, arc length there at first [m]
  double fed = 0, slip = 0;  ///< [m]
  bool left = false;         ///< true if the rod has left the ring: an end has passed
};

/// Pose of a hand, and the held rod in the axes of the hand.
struct HandState {
  Vector3 position = Vector3::Zero();      ///< [m]
  Matrix3 rotation = Matrix3::Identity();  ///< columns: its axes
  /// As it was grasped, from the hand and in its axes: nodes that it spans, or points on edges where it yields [m].
  std::vector<Vector3> points;
  std::vector<Matrix3> edges;  ///< columns d1, d2, t of the edges that it touches
  // Yielding hands only, per edge:
  std::vector<Vector3> slip;  ///< along d1, d2, t of the grasped frame [m]
  VectorX twist;              ///< twist of the edge against that frame, which fixes the branch of the angle [rad]
  RingState ring;             ///< place of the ring on the rod
};

/// Configuration, velocities and the frames they are measured from. The frames advance by time-parallel
/// transport once per accepted step or load increment.
/// Mean velocities over the last two steps, the later one first, by which a fluid's force, custom
/// ones and the velocities of supports are predicted.
struct Motion {
  int known = 0;
  VectorX velocity[2];  ///< [m/s]; empty if unused
  double time[2] = {};  ///< middles of these steps [s]
};

struct State {
  double time = 0.0;                    ///< [s]
  VectorX q, v;                         ///< positions [m], angles [rad]; frames of joints: increments from `frame`
  VectorX acceleration;                 ///< of the last step, to predict the next one (explicit: to begin it)
  bool acceleration_current = false;    ///< explicit scheme: `acceleration` belongs to q and the present forces
  VectorX load_force;                   ///< explicit scheme: of loads and custom forces there, for their work; or empty
  VectorX friction_force;               ///< explicit scheme: of friction there, for its work; or empty
  std::vector<Vec3d> tangent;           ///< per edge: source of the reference director
  std::vector<Vec3d> director;          ///< per edge: reference director, normal to `tangent`
  std::vector<Matrix3> frame;           ///< per joint frame (in a plane: not used, q holds the angle)
  VectorX bend_tau, half_tau;           ///< twist of each stencil, which fixes the branch of the angle [rad]
  std::vector<ContactRecord> contacts;  ///< sorted by key
  std::vector<ObstaclePlace> obstacles;
  std::vector<HandState> hands;  ///< per support; empty for supports that are no hands
  VectorX contact_stiffness;     ///< per rod, of contacts that begin [N/m]; where a scene has contact
  Motion motion;
  VectorX stop_rates;  ///< per revolute joint, rate at which it has met the stop that it is in, or 0 [rad/s]; or empty
};

State initial_state(const Model& model);
/// Displacement [m] and rotation [rad] of an obstacle since the drawing.
struct ObstacleWay {
  Vector3 shift = Vector3::Zero(), turn = Vector3::Zero();
};
ObstaclePlace obstacle_place(const Model& model, const ObstacleDescription& drawn, const ObstacleWay& way = {});
/// That way back; in a plane, within it.
ObstacleWay way_from_drawn(const Model& model, const ObstacleDescription& drawn, const ObstaclePlace& place);

/// Everything that follows from q and the source frames of a state.
struct Configuration {
  std::vector<EdgeFrame<double>> edge;
  VectorX length;                           ///< per edge [m]
  std::vector<Matrix3> frame;               ///< per joint frame, rotation from the drawn axes
  std::vector<EdgeFrame<double>> attached;  ///< per frame stencil: the attached end as an edge of unit length
  Columns3 bend_strain, half_strain;        ///< kappa1, kappa2, tau; in a plane: kappa, -, -
};

/// Fills `out` from q, measured from the frames of `state`. Does not allocate after the first call.
void compute_configuration(const Model& model, const State& state, const VectorX& q, Configuration& out);
/// The same without strains.
void compute_frames(const Model& model, const State& state, const VectorX& q, Configuration& out);
/// The turn about a hinge since it was drawn, in the axes of the drawn scene; none where hinge is -1.
Matrix3 hinge_turn(const Model& model, const VectorX& q, int hinge);
/// Directors of an edge in the axes of space: columns d1, d2, t.
Matrix3 edge_directors(const Model& model, const Configuration& c, int edge);

/// Both of an explicit step, in space: `out` from q, measured from where the edges are there, and of `next` all that
/// `accept_configuration` sets. Returns the smallest cosine of the angles by which edges turn on the way from `state`.
double advance_configuration(const Model& model, const State& state, const VectorX& q, Configuration& out, State& next);

/// Makes q the configuration of the state: transports the frames and the twists along.
void accept_configuration(const Model& model, const VectorX& q, const Configuration& configuration, State& state);

}  // namespace withe
