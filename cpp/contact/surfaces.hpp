#pragma once
/// Pairs that may touch: radii, obstacles in the model's own axes, and pairs that are left out. Built once.

#include <algorithm>
#include <vector>

#include "contact/curve.hpp"
#include "geometry/vec3.hpp"
#include "model/state.hpp"

namespace withe {

/// Depth in each other of surfaces that carry the greatest force of their rod, over the smaller radius: contact is so
/// stiff that a hundredth of a radius bears it.
inline constexpr double kDepth = 0.01;
/// Depth up to which a step, an equilibrium or a drawing is accepted, over the smaller radius. Contacts
/// stiffen from half of that on.
inline constexpr double kMaxDepth = 4.0 * kDepth;

/// Distance of centrelines after an iteration, over that before or over the sum of their radii: above 0, so that
/// nothing passes through anything.
inline constexpr double kMinDistance = 0.5;
/// Distance of surfaces beyond their reach, over the sum of their radii, up to which a pair is part of the matrix's
/// pattern. Farther pairs need no exact distance.
inline constexpr double kMaxPatternDistance = 0.5;

/// Unknowns of a contact: a0, a1, b0, b1 (3 each), angle of a, angle of b; of a piece of a curve: its nodes (3 each),
/// three that are none, the angles of its edges.
inline constexpr int kContactUnknowns = 14;
/// Unknowns of a piece of a planar curve: its nodes (2 each).
inline constexpr int kPlaneUnknowns = 6;

/// Two surfaces that may touch, and all that does not change while they do.
struct ContactPair {
  ContactKey key;    ///< of a piece of a curve: the edge before its node, or behind the first, and which end of it
  CurvePiece piece;  ///< of a's curve beside an obstacle that is larger than an edge
  int rod_a = 0, rod_b = -1;          ///< -1: an obstacle
  double radius_a = 0, radius_b = 0;  ///< [m]
  double tolerance = 0;               ///< delta [m]
  double weight_a = 0, weight_b = 0;  ///< of closest_points [m^2]
  double share = 1;                   ///< of a contact's stiffness
  double friction = 0;                ///< [-]; the greatest one, where it is not the same in all directions
  double forward = 1, backward = 1;   ///< that of a rod a that slides towards its end, and its start, over it
  double across = 1;                  ///< that of one that slides across itself, over it
  double rolling = 0;                 ///< coefficient of rolling friction, over a's radius [-]
  double stiffness = 0;               ///< of its own [N/m]; 0: none
  double restitution = 1;             ///< [-]

  double radii() const { return radius_a + radius_b; }
  double reach() const { return radii() + tolerance; }
  double nearest() const { return kMinDistance * radii(); }
  double small_radius() const { return rod_b < 0 || radius_a < radius_b ? radius_a : radius_b; }
  bool curve() const { return piece.weights != nullptr; }
  bool isotropic() const { return forward == across && backward == across; }
  /// Friction coefficient along a rod, relative to `friction`, for a slip that is positive towards the end of the rod.
  double along(double slip) const { return slip >= 0.0 ? forward : backward; }
  bool rubs() const { return friction > 0.0 || rolling > 0.0; }
  /// Coefficients as in `SurfaceParameters::obstacle_friction`.
  void set_friction(double mu_forward, double mu_backward, double mu_across) {
    friction = std::max({mu_forward, mu_backward, mu_across});
    forward = friction > 0.0 ? mu_forward / friction : 1.0;
    backward = friction > 0.0 ? mu_backward / friction : 1.0;
    across = friction > 0.0 ? mu_across / friction : 1.0;
  }
};

/// Whose coefficients a contact has: a row of `Parameters::pair_friction`, else one of `obstacle_friction`, else those
/// of the scene; -1: none.
struct FrictionOwner {
  Eigen::Index pair = -1, obstacle = -1;
};

/// The order in which contacts are found: those with obstacles, one obstacle after the other, then those of edges.
bool comes_before(const ContactKey& a, const ContactKey& b);

class Surfaces {
 public:
  explicit Surfaces(const Model& model);

  const Model& model() const { return model_; }
  /// As they are drawn.
  const std::vector<Obstacle>& obstacles() const { return obstacles_; }
  /// Pairs with obstacles, one after the other: every edge, or piece of a curve, that has a surface, with every
  /// obstacle that is not ignored.
  const std::vector<ContactPair>& obstacle_pairs() const { return obstacle_pairs_; }
  /// That of a key.
  const ContactPair& obstacle_pair(const ContactKey& key) const;
  /// Edges that may touch other edges.
  const std::vector<int>& edges() const { return edges_; }
  double radius(int edge) const { return radius_[static_cast<std::size_t>(edge)]; }
  double tolerance(int edge) const;
  /// True if two edges may touch: not neighbours along the rod nearer than (pi / 2) (2 h + delta), not ignored.
  bool may_touch(int a, int b) const;
  ContactPair pair(int a, int b) const;
  double greatest_reach() const { return greatest_reach_; }
  /// Coefficients of contact and friction.
  const SurfaceParameters& parameters() const { return parameters_; }
  /// Takes over parameters that are not those there are; whether there were any.
  bool set_parameters(const SurfaceParameters& parameters);
  /// Gives a pair what its bodies have, and where their friction varies that of its place.
  void set_parameters(ContactPair& pair) const;
  /// Stiffness that is given to what a rod has with another, or an obstacle as -1 - index [N/m]; 0: none is.
  double given_stiffness(int rod, int other) const;
  FrictionOwner friction_owner(const ContactPair& pair) const;
  /// True if friction is there at all.
  bool frictional() const { return frictional_; }
  /// Unknowns of two surfaces, -1 where there is none; angles where there is friction.
  void unknowns(const ContactPair& pair, int (&dofs)[kContactUnknowns]) const;
  void unknowns(const ContactKey& key, int (&dofs)[kContactUnknowns]) const;
  /// Unknowns of a piece of a planar curve, two per node; existing ones come first.
  void plane_unknowns(const ContactPair& pair, int (&dofs)[kPlaneUnknowns]) const;

 private:
  void find_neighbours();
  void note_frictional();
  void add_obstacles();
  /// Pairs of an obstacle with straight edges, and with the pieces of curves between others.
  void add_edges(const ContactPair& prototype, const Obstacle& obstacle);
  void add_pieces(const ContactPair& prototype, const Obstacle& obstacle, int rod);
  /// True if an obstacle is large enough to be touched by a curve.
  bool smooth(const Obstacle& obstacle, int edge) const;
  /// Coefficients of two bodies wherever they touch; and the place of their pair among those given, or -1.
  struct BodyFriction {
    Eigen::RowVector3d coefficients;
    int given;
  };
  BodyFriction friction_of(int rod, int other) const;
  /// Place of what touches in `ContactPairDescription::shares`.
  Eigen::Index place_along(const ContactPair& pair) const;
  /// True if two bodies may touch.
  bool may_meet(int first, int second) const;
  void unknowns_of_edges(const ContactKey& key, int (&dofs)[kContactUnknowns]) const;

  const Model& model_;
  std::vector<double> radius_;
  std::vector<int> edges_;
  std::vector<std::vector<int>> neighbours_;  ///< per edge, sorted
  std::vector<Obstacle> obstacles_;
  std::vector<ContactPair> obstacle_pairs_;
  double greatest_reach_ = 0;
  SurfaceParameters parameters_;
  bool frictional_ = false;
};

/// Values from a node's first unknown on, as a vector of three numbers in the axes of the unknowns.
inline Vec3d local_vector(const Model& model, const VectorX& q, int dof) {
  return {q(dof), q(dof + 1), model.planar() ? 0.0 : q(dof + 2)};
}

/// Position of a node, in the same axes.
inline Vec3d local_position(const Model& model, const VectorX& q, int node) {
  return local_vector(model, q, model.node_dof[static_cast<std::size_t>(node)]);
}

}  // namespace withe
