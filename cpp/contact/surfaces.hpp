#pragma once
/// Pairs that may touch: radii, obstacles in the model's own axes, and pairs that are left out. Built once.

#include <algorithm>
#include <vector>

#include "contact/curve.hpp"
#include "contact/face.hpp"
#include "geometry/vec3.hpp"
#include "model/state.hpp"

namespace withe {

/// Overlap of surfaces under the greatest force of their rod, relative to the smaller radius. The contact stiffness is
/// chosen for this overlap.
inline constexpr double kDepth = 0.01;
/// Greatest overlap at which a step, an equilibrium or a drawing is accepted, relative to the smaller radius. Contacts
/// stiffen from half of this overlap on.
inline constexpr double kMaxDepth = 4.0 * kDepth;

/// Least distance of centrelines after an iteration, relative to the distance before it or to the sum of their radii.
/// It is above 0, so that no rod passes through another.
inline constexpr double kMinDistance = 0.5;
/// Greatest distance of surfaces beyond their reach at which a pair is part of the pattern of the matrix, relative to
/// the sum of their radii. Farther pairs need no exact distance.
inline constexpr double kMaxPatternDistance = 0.5;

/// Scale of the depth of the rounded edges of bodies, over their radius. Depth, yielded depth and distance tolerance,
/// which is a tenth of the scale, stay below the radius together, so that a corner stays on its side of a face.
inline constexpr double kSharp = 4.0;

/// Scale of the depth of contact in a channel, over the room that an edge has in it. A straight rod presses on both
/// sides of a bend by a force in proportion to its sagitta less that room, which depth and tolerance change.
inline constexpr double kChannel = 0.2;

/// Unknowns of a contact: a0, a1, b0, b1 (3 each), angle of a, angle of b; of a piece of a curve: its nodes (3 each),
/// three unused ones, the angles of its edges.
inline constexpr int kContactUnknowns = 14;
/// Unknowns of a piece of a planar curve: its nodes (2 each).
inline constexpr int kPlaneUnknowns = 6;

/// Two surfaces that may touch, and their data that do not change during contact.
struct ContactPair {
  ContactKey key;    ///< for a piece of a curve: the edge before its node (at the first node: after it), and its end
  CurvePiece piece;  ///< of the curve of a, beside an obstacle larger than an edge
  const Face* face = nullptr;         ///< of b, touched by a point of a; null: edges touch
  double point = 0;                   ///< share of the edge a at which that point is
  EdgeFaces beside_a, beside_b;       ///< of two edges of bodies with faces
  int rod_a = 0, rod_b = -1;          ///< -1: an obstacle
  double radius_a = 0, radius_b = 0;  ///< [m]
  double tolerance = 0;               ///< delta [m]
  double weight_a = 0, weight_b = 0;  ///< for closest_points [m^2]
  double scale = 0;                   ///< in proportion to which surfaces penetrate each other [m]
  double share = 1;                   ///< share of the stiffness of a contact
  double friction = 0;                ///< [-]; greatest coefficient of all directions
  double forward = 1, backward = 1;   ///< if rod a slides towards its end or start, over `friction`
  double across = 1;                  ///< if it slides across its axis, over `friction`
  double rolling = 0;                 ///< coefficient of rolling friction, over the radius of a [-]
  double stiffness = 0;               ///< given for this pair [N/m]; 0: none
  double restitution = 1;             ///< [-]
  bool of_body = false;               ///< true if one of both is the surface of a rigid body

  double radii() const { return radius_a + radius_b; }
  double reach() const { return radii() + tolerance; }
  /// A ball that came as near as rods may would pass between two rods.
  double nearest() const {
    const double smaller = rod_b < 0 || radius_a < radius_b ? radius_a : radius_b;
    return narrow() ? radii() - kMinDistance * smaller : kMinDistance * radii();
  }
  /// True if surfaces may not come as near as rods may.
  bool narrow() const { return of_body && face == nullptr; }
  /// True if surfaces that are near may not touch, see `Proximity::beyond`.
  bool may_be_beyond() const { return face != nullptr || beside_a.left != nullptr; }
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

/// Source of the friction coefficients of a contact: a row of `Parameters::pair_friction`, else a row of
/// `obstacle_friction`, else the scene; -1: none.
struct FrictionOwner {
  Eigen::Index pair = -1, obstacle = -1;
};

/// The order in which contacts are found: first contacts with obstacles, one obstacle after the other, then contacts of
/// edges.
bool comes_before(const ContactKey& a, const ContactKey& b);

/// Places of faces in the axes of the unknowns.
FaceAxes axes_of(const Model& model, const VectorX& q, const Face& face);

class Surfaces {
 public:
  explicit Surfaces(const Model& model);

  const Model& model() const { return model_; }
  /// Obstacles at their drawn positions.
  const std::vector<Obstacle>& obstacles() const { return obstacles_; }
  /// Pairs with obstacles, one after the other: every edge, or piece of a curve, that has a surface, with every
  /// obstacle that is not ignored.
  const std::vector<ContactPair>& obstacle_pairs() const { return obstacle_pairs_; }
  /// The pair of a key.
  const ContactPair& obstacle_pair(const ContactKey& key) const;
  /// Edges that may touch other edges.
  const std::vector<int>& edges() const { return edges_; }
  /// Faces of bodies.
  const std::vector<Face>& faces() const { return faces_; }
  /// Adds the pairs of an edge's points with a face.
  void add_face_pairs(int edge, const Face& face, std::vector<ContactPair>& pairs) const;
  double radius(int edge) const { return radius_[static_cast<std::size_t>(edge)]; }
  double tolerance(int edge) const;
  /// In proportion to which the surface of an edge is penetrated: its radius, or kSharp times the radius of a rounded
  /// edge [m].
  double scale(int edge) const {
    return (model_.description.rods[at(model_.edge_rod[at(edge)])].faces.empty() ? 1.0 : kSharp) * radius(edge);
  }
  /// The same beside an obstacle: no more than kChannel times the room of the edge in a channel [m].
  double scale(int edge, const Obstacle& obstacle) const {
    const double room = obstacle.shape == nullptr ? 0.0 : kChannel * (obstacle.shape->channel() - radius(edge));
    return room > 0.0 ? std::min(scale(edge), room) : scale(edge);
  }
  /// The smaller one of two surfaces; planes, spheres, capsules and faces have none [m].
  double scale(const ContactKey& key) const {
    if (key.b < 0) return scale(key.a, obstacles_[static_cast<std::size_t>(-1 - key.b)]);
    return scale(key.b) > 0.0 ? std::min(scale(key.a), scale(key.b)) : scale(key.a);
  }
  /// True if two edges may touch: not neighbours along rods and joints nearer than (pi / 2) (2 h + delta), not ignored,
  /// not surfaces of one body or of held bodies.
  bool may_touch(int a, int b) const;
  ContactPair pair(int a, int b) const;
  double greatest_reach() const { return greatest_reach_; }
  double greatest_tolerance() const { return greatest_tolerance_; }
  /// Coefficients of contact and friction.
  const SurfaceParameters& parameters() const { return parameters_; }
  /// Sets the parameters. Returns true if any of them differs from before.
  bool set_parameters(const SurfaceParameters& parameters);
  /// Sets the coefficients of a pair from its two bodies, with the friction at its place if the friction varies.
  void set_parameters(ContactPair& pair) const;
  /// Given stiffness of contacts between a rod and `other`, a rod or (as -1 - index) an obstacle [N/m]; 0: none.
  double given_stiffness(int rod, int other) const;
  FrictionOwner friction_owner(const ContactPair& pair) const;
  /// True if any surface has friction.
  bool frictional() const { return frictional_; }
  /// Unknowns of two surfaces; -1: none. Angles are included only with friction.
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
  /// Friction coefficients of two bodies at any place, and the index of their pair among the given pairs, or -1.
  struct BodyFriction {
    Eigen::RowVector3d coefficients;
    int given;
  };
  BodyFriction friction_of(int rod, int other) const;
  /// Index of the touching node or edge in `ContactPairDescription::shares`.
  Eigen::Index place_along(const ContactPair& pair) const;
  /// True if two bodies may touch.
  bool may_meet(int first, int second) const;
  /// True of a ball: the edge of its surface only shows how it turns, and its middle touches.
  bool ball(int edge) const;
  /// Weight of an edge for `closest_points` [m^2].
  double weight(int edge, double radii) const;
  /// True of the surface of a held body.
  bool held(int edge) const { return held_[static_cast<std::size_t>(edge)]; }
  /// Distance of a surface of a body from a node of the body, as drawn [m].
  struct SurfaceNode {
    int edge, node;
    double distance;
  };
  /// For each edge of a surface and each node that its body has on rods or joints, edge by edge.
  std::vector<SurfaceNode> surface_nodes() const;
  void add_points();
  void add_faces();
  /// Body of an edge of a surface; -1: an edge of a rod.
  int body_of(int edge) const { return model_.description.rods[at(model_.edge_rod[at(edge)])].body; }
  void unknowns_of_edges(const ContactKey& key, int (&dofs)[kContactUnknowns]) const;

  const Model& model_;
  std::vector<double> radius_;
  std::vector<bool> held_;  ///< per edge
  std::vector<int> edges_;
  std::vector<Face> faces_;
  std::vector<EdgeFaces> edge_faces_;  ///< per edge; empty: there are no faces
  /// A point of an edge that touches faces.
  struct TouchingPoint {
    double along;  ///< share of the edge
    int end;       ///< ContactKey::end
    double share;  ///< ContactPair::share
  };
  std::vector<std::vector<TouchingPoint>> points_;  ///< per edge; points that edges share belong to the first
  std::vector<std::vector<int>> neighbours_;        ///< per edge, sorted
  std::vector<Obstacle> obstacles_;
  std::vector<ContactPair> obstacle_pairs_;
  double greatest_reach_ = 0, greatest_tolerance_ = 0;
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
