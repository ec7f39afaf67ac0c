#pragma once
/// The scene as flat arrays: everything that `build` decides once, and the parameters that may change during a run.
/// `build_model` makes it; it is immutable except for `Parameters`.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/types.hpp"
#include "geometry/bend_measure.hpp"
#include "geometry/frames.hpp"
#include "model/description.hpp"
#include "model/rod_curve.hpp"

namespace withe {

inline Vec3d to_vec3(const Vector3& v) { return {v.x(), v.y(), v.z()}; }
inline Vector3 to_eigen(const Vec3d& v) { return {v.x, v.y, v.z}; }

/// The plane of a planar scene: x = origin + u first + v second.
struct Plane {
  Vector3 origin, first, second, normal;
};

/// An inner node of a rod, with the ordinary stencil of two edges. Edges are oriented along the stencil;
/// a sign of -1 marks one that runs against its rod (only where rods meet, in joints of form `pairs`).
struct BendStencil {
  int edge[2];
  int node[3];
  int sign[2];
};

/// A stencil of half length between a frame (of a joint, or of a wall) and an edge.
struct FrameStencil {
  int frame;
  int edge;
  int hinge;           ///< -1, or the hinge between the frame and this edge
  bool frame_first;    ///< the edge leaves the node (the rod goes from the frame to the edge)
  Matrix3 attachment;  ///< columns d1, d2, t of the attached end, in the axes of the drawn scene
};

struct Hinge {
  int frame;
  Vector3 axis;  ///< in the axes of the drawn scene
  int dof;
};

/// Motion of a part along an axis of a body.
struct Slide {
  int frame;     ///< of the body
  Vector3 axis;  ///< in the axes of the drawn scene, unit length
  int dof;       ///< its coordinate, 0 as drawn [m]
};

/// A part that a rigid body carries. It has unknowns like any other part, but they follow those of the body: forces on
/// it are added to the rows of the body; see steps/carried_parts.hpp. The part is one of these:
/// - a node, x = x_base + R (arm + s axis), where R turns the frame of the body; s is the coordinate of a slide, or 0
/// - the frame of a second body, on a hinge or a slide of the first
/// - the angle of an edge of its surface
struct CarriedPart {
  int frame = -1;  ///< of the body
  // A node:
  int node = -1, base = -1;       ///< the node, and that of the body
  Vector3 arm = Vector3::Zero();  ///< from the base, in the axes of the drawn scene [m]
  int slide = -1;
  // A frame, which turns with the body if it is on no hinge:
  int own_frame = -1, hinge = -1;
  // An edge:
  int edge = -1;

  // Unknowns: its own, and those of the body (base, frame and slide, or frame and hinge).
  int own_dof = -1, own_size = 0;
  std::vector<int> body_dofs;
  bool is_held = false;  ///< true of a node or an edge whose body a support holds in every direction

  bool is_node() const { return node >= 0; }
  bool is_frame() const { return own_frame >= 0; }
};

/// A closed loop of joints, and its multipliers: forces [N] and moments [N m] on the copy, in the axes of the copy.
struct Loop {
  int copy_node = -1, body_node = -1, copy_frame = -1, body_frame = -1;
  int body_center = -1;  ///< node with the mass of the body
  int body = -1;
  int dof = -1;  ///< of the first force; forces come first, then moments
};

/// The angle of a revolute joint by the unknowns, 0 as drawn: sign (q[turning] - q[against]). In space a hinge has its
/// own unknown, and `against` is unused. In a plane the hinge lies between two frames. In a plane nothing turns about
/// an axis that lies in it.
struct JointAngle {
  int turning = -1, against = -1;
  double sign = 1;
  int node = 0;
  JointStops stops;

  bool turns() const { return turning >= 0; }
  /// Angle of a joint from unknowns, or its rate from rates.
  double angle(const VectorX& q) const {
    return turns() ? sign * (q[turning] - (against < 0 ? 0.0 : q[against])) : 0.0;
  }
};

/// Place of the curvature of a rod's stencil: an ordinary stencil, or one or two halves at a frame.
struct StencilPlace {
  int bend = -1;
  int half[2] = {-1, -1};
};

/// Unknowns that a support holds: `size` numbers from `first`, free along the projector only.
struct Constraint {
  int first = 0;
  int size = 0;
  Matrix3 free = Matrix3::Zero();

  /// Its numbers of a vector over all unknowns, with zeros behind where they are fewer than three.
  Vector3 part(const VectorX& vector) const {
    Vector3 own = Vector3::Zero();
    own.head(size) = vector.segment(first, size);
    return own;
  }
  /// Held part of the constrained unknowns.
  Vector3 held(const VectorX& vector) const { return held_of(part(vector)); }
  /// Held part of the change from one vector to another.
  Vector3 held_change(const VectorX& from, const VectorX& to) const { return held_of(part(to) - part(from)); }

  Vector3 held_of(const Vector3& own) const { return own - free * own; }
};

/// An edge that a hand touches.
struct TouchedEdge {
  int edge = 0;
  double place = 0;  ///< middle of the touched part, from 0 at the edge's tail to 1
  double share = 0;  ///< share of the hand's length on the edge
};

/// Resolved support, with its held unknowns.
struct Support {
  bool active = false;
  SupportDescription description;
  int node = -1;                       ///< global node
  int frame = -1;                      ///< frame of a clamp
  int other_node = -1;                 ///< hold_edge
  int edge = -1;                       ///< hold_edge
  Vector3 tangent = Vector3::UnitX();  ///< drawn tangent of the held rod at a frame, or of a held edge
  std::vector<int> nodes, edges;       ///< nodes whose places and edges whose angles it holds
  // Data of a hand:
  std::vector<TouchedEdge> touched;  ///< in the order of the rod
  std::vector<int> span;             ///< nodes of these edges, in that order
  int at_edge = -1;                  ///< index in `touched` of the edge with the held point
  double at_place = 0;               ///< place of this point on the edge
  RodCurve curve;                    ///< curve of a ring's rod

  bool is_hand() const { return description.kind == SupportKind::hand; }
  bool yields() const { return is_hand() && description.hand.yields; }
  bool slides() const { return is_hand() && description.hand.slides; }
};

/// Coefficients of contact and friction: between rods, on obstacles, and of pairs of bodies with coefficients of
/// their own.
struct SurfaceParameters {
  double friction = 0;               ///< between rods [-]
  double slip_tolerance = 1e-3;      ///< nu [m/s]
  double restitution = 1;            ///< between rods [-]
  double contact_stiffness = 0;      ///< [N/m]; 0: found by the rule
  MatrixX3 obstacle_friction;        ///< per obstacle, of rods that slide towards their end, their start, across [-]
  VectorX obstacle_rolling;          ///< per obstacle, of rolling friction over a rod's radius [-]
  VectorX obstacle_restitution;      ///< per obstacle [-]
  MatrixX3 pair_friction;            ///< per pair, the same; negative: that of its bodies [-]
  std::vector<VectorX> pair_shares;  ///< per pair, see `ContactPairDescription::shares`
  VectorX pair_restitution;          ///< per pair; negative: that of its bodies [-]
  VectorX pair_contact_stiffness;    ///< per pair; 0: that of the scene [N/m]

  bool operator==(const SurfaceParameters& other) const;
};

/// Parameters that may change during a run, with one entry per edge, stencil or node. The parameters that users set
/// have names in parameter_index.hpp.
struct Parameters : PartNumbers {
  VectorX edge_stretch;  ///< EA [N]
  MatrixX2 edge_bend;    ///< EI1, EI2 [N m^2]
  VectorX edge_twist;    ///< GJ [N m^2]
  VectorX edge_density, edge_rotary, edge_viscous_time, edge_drag;
  VectorX edge_natural_stretch;  ///< natural length over drawn length [-]
  VectorX added_mass;
  std::vector<Matrix3> body_inertia;  ///< per body, about its centre of mass, axes as drawn [kg m^2]
  Vector3 gravity;
  double fluid_viscosity = 0;               ///< [Pa s]
  double fluid_regularization = 0;          ///< regularization of Stokeslets [m]
  std::vector<MatrixX2> natural_curvature;  ///< per rod and stencil, smooth [1/m]
  std::vector<VectorX> natural_twist;       ///< per rod and stencil [rad/m]
  SurfaceParameters surfaces;
  MatrixX3 loads;  ///< rows of all loads, load by load; see `LoadDescription::values`
  BendMeasure measure;
  bool lumped = false;       ///< true if all masses are at nodes; see mass_matrix.hpp
  bool held_lumped = false;  ///< true if masses of edges at held nodes are at nodes

  // Derived from the above by `update_derived`.
  VectorX node_mass, node_drag;                  ///< half edges around a node, plus added ones [kg], [N s/m]
  VectorX edge_inertia;                          ///< inertia of theta [kg m^2]
  VectorX frame_inertia, hinge_inertia;          ///< [kg m^2]
  MatrixX3 bend_stiffness, half_stiffness;       ///< per stencil: EI1 / V, EI2 / V, GJ / V [N m]
  MatrixX3 bend_natural, half_natural;           ///< per stencil: f (kappa1, kappa2, tau)
  VectorX bend_viscous_time, half_viscous_time;  ///< [s]
  bool viscous = false, dragged = false;
  /// Other numbers whenever anything above has changed, natural shapes and strains apart, and whenever these have;
  /// never used twice.
  long version = 0, natural_version = 0;
};

/// Refuses a load at a node that is not there, of the wrong size, or not finite.
void check_load(const SceneDescription& scene, const LoadDescription& load);

struct Model {
  SceneDescription description;
  std::optional<Plane> plane;
  std::string plane_reason;  ///< why there is no plane
  int dimension = 3;         ///< unknowns a node
  int node_count = 0, edge_count = 0, frame_count = 0;
  std::vector<int> rod_first_edge;  ///< edges of rod r: rod_first_edge[r] .. rod_first_edge[r + 1]
  std::vector<int> edge_rod;
  std::vector<int> edge_tail, edge_head;
  VectorX edge_length;            ///< at rest [m]
  VectorX edge_arc;               ///< length of the arc whose chord the edge is [m]
  std::vector<bool> rod_curved;   ///< true if its edges are chords of arcs of more than a radian in all
  std::vector<bool> edge_lumped;  ///< true if its mass is at its nodes; see mass_matrix.hpp
  std::vector<bool> edge_held;    ///< true if a support holds one of its nodes
  std::vector<BendStencil> bend;
  std::vector<int> reversed_bend;  ///< stencils with an edge against its rod
  std::vector<FrameStencil> half;
  VectorX bend_voronoi, half_voronoi;  ///< [m]
  std::vector<VectorX> rod_voronoi;    ///< [rod](stencil), of the whole stencil, wherever its curvature is [m]
  MatrixX2 bend_share;                 ///< per stencil: the part of each of its edges whose bending it carries; 1/2,
  VectorX half_share;                  ///< but 5/12 at a frame and 7/12 at the edge's other end; see build_model.cpp
  std::vector<Hinge> hinges;           ///< in space
  std::vector<Slide> slides;
  std::vector<int> body_frame;  ///< per body
  std::vector<Loop> loops;
  std::vector<CarriedPart> carried;      ///< parts that bodies carry, each after those that carry it
  std::vector<JointAngle> joint_angles;  ///< per revolute joint, in the order of the scene's joints and their links
  std::vector<std::vector<StencilPlace>> place;  ///< [rod][stencil]
  std::vector<Vector2> planar_components;        ///< per rod: kappa = p . (kappa1, kappa2)
  std::vector<std::vector<int>> wall_half;       ///< [rod]: halves at its first and last node, or -1
  /// Per stencil: discrete strains that are added to the natural ones. They come from the drawing (at joints of form
  /// `pairs`, and where rods are joined at an angle) and from ends without correction.
  MatrixX3 bend_offset, half_offset;
  std::vector<std::pair<int, int>> bend_owner;  ///< (rod, stencil), or (-1, -1) across rods
  std::vector<int> bend_across;                 ///< stencils across rods
  /// Per entry of `SceneDescription::uncorrected_ends`: its half stencil, and the bend stencil at its other node.
  std::vector<std::pair<int, int>> uncorrected_ends;
  std::vector<std::pair<int, int>> half_owner;  ///< (rod, nearest stencil); (rod, -1) where the rod has none

  // Layout of the unknowns.
  int dof_count = 0;
  std::vector<int> frame_node;
  std::vector<int> node_dof, edge_dof, frame_dof;  ///< first unknown of each; edge_dof is empty in a plane
  std::vector<int> tail_dof, head_dof;             ///< per edge: first unknown of its nodes
  int component_count = 0;                         ///< connected components, by joints and springs
  std::vector<int> dof_component;                  ///< per unknown
  std::vector<Constraint> constraints;
  std::vector<Support> supports;

  // The drawn state.
  VectorX initial_q;
  std::vector<Vec3d> initial_tangent, initial_director;
  VectorX initial_bend_tau, initial_half_tau;
  double length_scale = 1.0;     ///< [m]
  double shortest_length = 1.0;  ///< of an edge of a rod; of bodies alone the length scale [m]

  bool planar() const { return plane.has_value(); }
  int frame_size() const { return planar() ? 1 : 3; }
  /// Multipliers of a closed loop of joints.
  int loop_size() const { return dimension + frame_size(); }
  int component_of_node(int node) const {
    return dof_component[static_cast<std::size_t>(node_dof[static_cast<std::size_t>(node)])];
  }
  bool has_bodies() const { return !body_frame.empty(); }
  /// True of an edge of the surface of a body.
  bool is_surface(int edge) const {
    return description.rods[static_cast<std::size_t>(edge_rod[static_cast<std::size_t>(edge)])].is_surface();
  }
  int component_of_edge(int edge) const { return component_of_node(edge_tail[static_cast<std::size_t>(edge)]); }
};

/// Resolves joints and supports, lays out the unknowns, finds the plane. Throws std::invalid_argument.
Model build_model(const SceneDescription& description, std::optional<bool> planar);
/// Adds strains f (kappa1, kappa2, tau) to the natural ones of the stencils of an uncorrected end; `update_natural`
/// must follow.
void add_offsets(Model& model, std::size_t uncorrected_end, const Vector3& at_frame, const Vector3& at_next);
/// Parameters as described, derived ones included.
Parameters initial_parameters(const Model& model);
/// Set the coefficients of contact and friction from the description; update_derived must follow.
void set_contact(const ContactDescription& contact, Parameters& parameters);
/// Write the numbers of surfaces back to the description of their scene.
void describe_contact(const SurfaceParameters& surfaces, ContactDescription& contact);
/// Stiffnesses, densities, viscous time and drag of one rod, from one value an edge; update_derived must follow.
void set_rod(const Model& model, int rod, const RodDescription& description, Parameters& parameters);
/// Masses, stencil stiffnesses and discrete natural strains from the rest.
void update_derived(const Model& model, Parameters& parameters);
/// Updates the discrete natural strains of one rod.
void update_natural(const Model& model, Parameters& parameters);
void update_natural(const Model& model, Parameters& parameters, int rod);

/// The plane that contains the whole scene, or none (with the reason). A straight scene has a plane only if `asked`:
/// the plane of its first director.
std::optional<Plane> find_plane(const SceneDescription& description, std::optional<bool> asked, std::string& reason);

/// Square of the angle by which an arc of `arc` over a chord of `chord` turns [rad^2], to its fourth power.
inline double square_of_turn(double chord, double arc) { return 24.0 * (arc / chord - 1.0); }

/// The arc that the edges of a stencil are chords of, as its drawn natural curvature has it.
struct ArcOfStencil {
  bool turns = false;
  double square_of_turn = 0;        ///< [rad^2]
  Vector2 share = Vector2::Zero();  ///< share of the squared curvature towards either director
};
/// EI1, EI2 of an edge; in a plane the only bending stiffness is the first [N m^2].
Vector2 bend_of(const Model& model, const Parameters& parameters, int edge);
ArcOfStencil arc_of_bend(const Model& model, Eigen::Index stencil);
ArcOfStencil arc_of_half(const Model& model, Eigen::Index stencil);

/// Discrete curvature 2 tan(|kappa| V / 2) along kappa. Needs |kappa| V < pi.
Vector2 discrete_curvature(const Vector2& smooth, double voronoi);
/// Its inverse.
Vector2 smooth_curvature(const Vector2& discrete, double voronoi);
/// Curvatures of the smooth rod from discrete ones, one stencil a row [1/m].
MatrixX2 smooth_curvatures(const MatrixX2& discrete, const VectorX& voronoi);
/// Refuses smooth curvatures, one row per stencil or one for all, that turn a rod by pi or more at a node. Throws
/// std::invalid_argument that names the node and the `owner`.
void check_turns(const Eigen::Map<const MatrixX>& smooth, const VectorX& voronoi,
                 const std::function<std::string()>& owner);

}  // namespace withe
