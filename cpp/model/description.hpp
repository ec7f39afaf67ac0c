#pragma once
/// Description of a scene for the engine: plain arrays in SI units, one struct per kind of part that a user
/// adds. Nodes that are joined already share one index here. Nothing in it changes after `build`.

#include <array>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "common/types.hpp"
#include "geometry/shape.hpp"

namespace withe {

/// A face of the surface of a rigid body: a region of the plane through the tail of an edge, which is normal to it. It
/// touches at a distance from that plane.
struct FaceDescription {
  int edge = 0;      ///< index of that edge of the surface
  int aside = 0;     ///< index of a node of the surface; from the tail to its foot in the plane is the first axis
  double depth = 0;  ///< of the plane below the surface [m]
  MatrixX4 outline;  ///< segments x0, y0, x1, y1 about the tail; the second axis is normal x first [m]
};

/// A rod as a chain of nodes. Arrays have one row per edge, unless their comment names stencils. An open rod of N nodes
/// has N - 1 edges and N - 2 stencils, which are the inner nodes. A closed rod has N edges and N stencils, where
/// stencil i sits at node i, between edges i - 1 and i.
struct RodDescription {
  std::string name;
  std::vector<int> nodes;  ///< rows of SceneDescription::positions, in order; closed: the first is not repeated
  bool closed = false;
  MatrixX3 directors;          ///< first director of each edge, unit length, normal to the edge
  VectorX rest_lengths;        ///< [m]
  VectorX arc_lengths;         ///< arcs of the curve whose chords the edges are [m]; empty: the edges are the rod
  VectorX stretch_stiffness;   ///< EA [N]
  MatrixX2 bend_stiffness;     ///< EI1, EI2 [N m^2]: resisting curvature towards d1 and d2
  VectorX twist_stiffness;     ///< GJ [N m^2]
  VectorX line_density;        ///< mass per length [kg/m]
  VectorX rotary_inertia;      ///< rho (I1 + I2), polar inertia per length [kg m]
  VectorX viscous_time;        ///< Kelvin-Voigt: viscosity / Young's modulus [s]
  VectorX drag;                ///< force per length and velocity [Pa s]
  MatrixX2 natural_curvature;  ///< per stencil, of the smooth rod, towards d1 and d2 [1/m]
  VectorX natural_twist;       ///< per stencil [rad/m]
  VectorX contact_radius;      ///< radius of the round contact surface [m]; empty: no contact
  VectorX fluid_radius;        ///< radius in the fluid [m]
  MatrixX2 fibre_distance;     ///< of the outermost fibres towards d1 and d2 [m]; empty: the section is unknown
  // The surface of a rigid body is a chain of edges without mass and stiffness. The body carries their nodes and
  // angles. Edges without a contact radius only connect others, or are normals of faces.
  int body = -1;  ///< that body; -1: a rod
  std::vector<FaceDescription> faces;
  std::vector<std::array<int, 2>> edge_faces;  ///< per edge: faces on its left and right, from outside; -1: none
  double friction = -1;                        ///< coefficient [-]; negative: that of the scene
  double restitution = -1;                     ///< coefficient [-]; negative: that of the scene

  bool is_surface() const { return body >= 0; }
};

/// One rod passing through, starting or ending at a shared node: rod index and node index within the rod. A point of a
/// rigid body has the rod -1 - body, and the row of its node.
struct RodPass {
  int rod = 0;
  int node = 0;

  bool on_body() const { return rod < 0; }
  int body() const { return -1 - rod; }
};

/// Stops of a joint: beyond an angle they push back by a stiffness.
struct JointStops {
  double low = -std::numeric_limits<double>::infinity(), high = -low;  ///< [rad]
  double stiffness = 0;                                                ///< [N m/rad]; 0: no stops
  double restitution = 1;  ///< rate after an impact on a stop over that before it, from 0 to 1 [-]
  double impact_loss = 0;  ///< d in forces/joint.hpp, which `build_model` finds by the restitution [-]
};

/// A link inside a joint: the second cluster turns about `axis` relative to the first. If it slides, it moves along the
/// axis instead and does not turn; the first cluster is then that of a body. Its coordinate is in metres, and the
/// numbers below are forces [N] instead of moments.
struct JointLink {
  int parent = 0;  ///< index of a cluster of the joint
  int child = 0;
  Vector3 axis = Vector3::UnitZ();  ///< unit length, in the drawn configuration
  bool slides = false;
  // Between them, see forces/joint.hpp:
  double stiffness = 0;                                         ///< k [N m/rad]
  double rest_angle = 0;                                        ///< [rad]
  double damping = 0;                                           ///< c [N m s/rad]
  double moment = 0;                                            ///< moment of a motor on the child [N m]
  double max_torque = std::numeric_limits<double>::infinity();  ///< of the spring [N m]
  double max_speed = std::numeric_limits<double>::infinity();   ///< of the rest angle as it is set [rad/s]
  JointStops stops;
};

enum class JointForm {
  frame,  ///< the joint owns a frame; every attached edge has one stencil of half length to it
  pairs,  ///< one stencil for every pair of edges, [Choi, dissertation 6.2.2]; archival
};

/// A node that several rods share. Passes in one cluster are rigidly connected; clusters are connected by
/// links, or (pinned) only by the shared node.
struct JointDescription {
  std::vector<std::vector<RodPass>> clusters;
  std::vector<int> bodies;  ///< per cluster: the rigid body in it, or -1; empty: no body
  std::vector<JointLink> links;
  JointForm form = JointForm::frame;

  int body_of(std::size_t cluster) const { return cluster < bodies.size() ? bodies[cluster] : -1; }
};

/// A rigid body: a frame at a node, and further nodes that it carries. Its mass is an added mass at the node that is
/// its centre of mass.
struct BodyDescription {
  std::string name;
  int node = 0;                       ///< row of SceneDescription::positions; its unknowns are the body's
  int center = -1;                    ///< row of its centre of mass
  std::vector<int> carried;           ///< rows of further points of the body
  Matrix3 inertia = Matrix3::Zero();  ///< about the centre of mass, axes as drawn [kg m^2]
  int carrier = -1;                   ///< body on whose hinge or slide it is; -1: none
};

/// Closure of a loop of joints. Joints of bodies form a tree. A joint that would close a loop has a massless copy of
/// its second body instead. Multipliers hold this copy and the body together; see steps/loop_forces.hpp.
struct LoopDescription {
  int copy = -1;       ///< index of the copy among the bodies
  int body = -1;       ///< index of the body
  int copy_node = -1;  ///< row of a point that the copy carries
  int body_node = -1;  ///< row of the same point of the body
};

enum class SupportKind {
  pin,             ///< position only
  clamp,           ///< position and the frame of the wall, by a stencil of half length
  hold_edge,       ///< both nodes of the end edge and its angle, the source's clamp
  spinning_clamp,  ///< a clamp that may turn about the rod's tangent
  spinning_edge,   ///< both nodes of the end edge
  hand,            ///< all edges that a length of the rod lies on, see HandDescription
};

inline bool holds_frame(SupportKind kind) { return kind == SupportKind::clamp || kind == SupportKind::spinning_clamp; }
inline bool holds_edge(SupportKind kind) {
  return kind == SupportKind::hold_edge || kind == SupportKind::spinning_edge;
}
inline bool may_spin(SupportKind kind) {
  return kind == SupportKind::spinning_clamp || kind == SupportKind::spinning_edge;
}

/// Part of a rod that a hand holds, from `at` - `length` / 2 to `at` + `length` / 2. A rigid hand holds the part as one
/// piece, in the shape that the part has when it is grasped. A yielding hand holds the part by a bed of springs of the
/// same length; see forces/hand.hpp.
struct HandDescription {
  double at = 0, length = 0;  ///< arc length at rest [m]
  /// Pose of the hand in the world as it grasps: its position, and its axes as columns. Not posed: the rod's point and
  /// its directors d1, d2, t.
  bool posed = false;
  Vector3 position = Vector3::Zero();
  Matrix3 rotation = Matrix3::Identity();
  bool yields = false;
  /// Stiffness of a hand that yields: along d1, d2, t of the held rod [N/m], and about them [N m/rad].
  std::array<double, 6> stiffness{};
  double force_limit = std::numeric_limits<double>::infinity();  ///< above it the hand slips [N]
  /// A ring, see forces/ring.hpp: it yields, with stiffness[0] across the rod and along it.
  bool slides = false;
  double friction = 0;   ///< coefficient of a ring that lets the rod slide [-]
  bool feeds = false;    ///< true if a drive holds the rod along itself
  double feed_rate = 0;  ///< initial rate of the drive: rest length towards the end of the rod [m/s]
  int node = -1;         ///< point of a rigid body that carries the ring; -1: none does
};

/// Something that holds a node of a rod.
struct SupportDescription {
  SupportKind kind = SupportKind::pin;
  RodPass pass;
  Matrix3 free = Matrix3::Zero();  ///< projector onto the directions along which the node may slide
  bool gripped = false;            ///< true if added during a run, so that it must not change the stored energy
  Vector3 axis =
      Vector3::Zero();  ///< about which a spinning clamp turns that was put on then; else that of the drawing
  HandDescription hand;
};

enum class LoadKind {
  force,        ///< at a node [N]
  moment,       ///< at a node [N m]
  distributed,  ///< along a rod [N/m]; pass.node is ignored
  pressure,     ///< along a rod, value x tangent per present length [N/m]; pass.node is ignored
};

/// True if the value of a load is an axis to turn about, and not a direction to push in.
inline bool is_axial(LoadKind kind) { return kind == LoadKind::moment || kind == LoadKind::pressure; }

struct LoadDescription {
  LoadKind kind = LoadKind::force;
  RodPass pass;
  /// World axes; a follower load keeps its direction in the frame that carries it. One row, or, along a rod, one an
  /// edge.
  MatrixX3 values = MatrixX3::Zero(1, 3);
  bool follower = false;
  bool varies = false;  ///< set by a callback while running, so `values` are only its first ones
  bool added = false;   ///< true if added during a run: it has no influence on the plane of the drawing
};

/// A spring with a damper beside it (Kelvin and Voigt) between two nodes; see forces/spring.hpp.
struct SpringDescription {
  std::array<int, 2> nodes{};  ///< rows of SceneDescription::positions
  double stiffness = 0;        ///< k [N/m]
  double rest_length = 0;      ///< L [m]
  double damping = 0;          ///< c [N s/m]
};

/// A torsion spring between two edges; see forces/torsion_spring.hpp.
struct TorsionDescription {
  std::array<int, 2> rods{}, edges{};    ///< rod of each of the two edges, and index of the edge in its rod
  Vector3 axis = Vector3::UnitZ();       ///< unit vector, as drawn
  Vector3 reference = Vector3::UnitX();  ///< unit vector normal to the axis: u and w as drawn
  double stiffness = 0;                  ///< k [N m/rad]
  double rest_angle = 0;                 ///< phi0 [rad]
};

/// Place of a tendon's guide along an edge. At the start or the end of a rod that is rigid with a joint or a clamp
/// there, it sits on that.
enum class GuidePlace { start, middle, end };

struct TendonGuide {
  int rod = 0, edge = 0;  ///< on a rigid body as in `RodPass`: -1 - body, and the row of its point
  GuidePlace place = GuidePlace::middle;

  bool on_body() const { return rod < 0; }

  friend bool operator==(const TendonGuide&, const TendonGuide&) = default;
};

/// A tendon that runs through guides from the first to the last; see forces/tendon.hpp.
struct TendonDescription {
  std::vector<TendonGuide> guides;
  MatrixX2 offsets;    ///< per guide, along the material directors d1, d2 of its edge [m]
  double tension = 0;  ///< T [N]
};

enum class ContactLaw { imcv2, imcv1, barrier, spillmann_teschner };

/// Rule for the contact stiffness if no number is given.
enum class StiffnessRule {
  forces,  ///< each contact follows its force, so that surfaces are about a hundredth of the smaller radius deep
  source,  ///< one for all, the greatest force on a node in contact times 1e5 / m [Choi, dissertation, (5.17)]
};

enum class FrictionLaw {
  implicit,       ///< normal force and slip at the end of the step, exact (unsymmetric) Jacobian
  lagged,         ///< normal force and directions from the start of the step: symmetric
  anchored,       ///< an elastic stick that holds a load without creep, by return mapping
  semi_explicit,  ///< normal force and direction of slip from the start of the step [Choi, dissertation, 4.5]
};

/// Treatment of surfaces that are drawn inside each other.
enum class Overlap {
  error,     ///< refuse the scene
  separate,  ///< move rods apart
};

enum class ObstacleKind {
  plane,    ///< fills the half-space behind it
  capsule,  ///< a segment with a radius; a sphere where its ends coincide
  shape,    ///< as its `Shape` says
};

/// Something solid, where it is drawn.
struct ObstacleDescription {
  ObstacleKind kind = ObstacleKind::plane;
  Vector3 point = Vector3::Zero();   ///< point of the plane; start of the segment [m]
  Vector3 other = Vector3::UnitZ();  ///< unit normal of the plane, away from the solid; end of the segment [m]
  double radius = 0;                 ///< radius of a capsule [m]
  std::string name;
  std::shared_ptr<const Shape> shape{};  ///< where the kind is `shape`, in axes from `point` on
};

/// Coefficients of a pair of bodies. Bodies are rods (their index) and obstacles (-1 - index).
struct ContactPairDescription {
  int first = 0, second = 0;
  bool ignored = false;
  Vector3 friction = -Vector3::Ones();  ///< as in `ContactDescription::obstacle_friction`; negative: that of the scene
  double stiffness = 0;                 ///< [N/m]; 0: that of the scene
  double restitution = -1;              ///< coefficient [-]; negative: that of the scene
  VectorX shares;  ///< for a rod and an obstacle: factors of these coefficients at nodes, then at edges [-];
                   ///< empty: 1

  bool is_of(int a, int b) const { return (first == a && second == b) || (first == b && second == a); }
};

struct ContactDescription {
  bool rods = false;  ///< true if rods touch each other and themselves
  /// True if the scene does not define contact between rods: a warning then names rods that pass through each other.
  bool warns_of_crossings = false;
  double friction = 0;           ///< coefficient between rods [-]
  MatrixX3 obstacle_friction;    ///< per obstacle, of rods that slide towards their end, their start, across [-]
  VectorX obstacle_rolling;      ///< per obstacle, of rolling friction over a rod's radius [-]; empty: none
  double restitution = 1;        ///< coefficient between rods [-]
  VectorX obstacle_restitution;  ///< per obstacle [-]; empty: 1
  ContactLaw law = ContactLaw::imcv2;
  FrictionLaw friction_law = FrictionLaw::implicit;
  double distance_tolerance = 0;  ///< delta [m]; 0: a tenth of the smaller radius of a pair at most, see `light`
  double slip_tolerance = 1e-3;   ///< nu [m/s]
  double stiffness = 0;           ///< [N/m]; 0: found by the rule
  StiffnessRule stiffness_rule = StiffnessRule::forces;
  bool centreline_friction = false;  ///< friction acts on the centrelines, as in the source
  Overlap overlap = Overlap::error;
  std::vector<ObstacleDescription> obstacles;
  std::vector<ContactPairDescription> pairs;
  /// Share of the distance tolerance, and of the depth of contact, that is left where loads are light: contact is
  /// narrower there, unless the tolerance is given.
  double light = 0.05;

  /// That share, or 1 where the tolerance does not follow the load [-].
  double least_tolerance() const {
    const bool follows =
        distance_tolerance == 0.0 && law == ContactLaw::imcv2 && stiffness_rule == StiffnessRule::forces;
    return follows ? light : 1.0;
  }
  bool any() const { return rods || !obstacles.empty(); }
};

enum class FluidModel {
  none,
  resistive,   ///< resistive-force theory: drag along and across each edge; see forces/resistive.hpp
  stokeslets,  ///< regularized Stokeslet segments: every edge moves the fluid at all others; see forces/stokeslets.hpp
};

/// A viscous fluid around all rods, at rest far away, without inertia.
struct FluidDescription {
  FluidModel model = FluidModel::none;
  double viscosity = 0;       ///< [Pa s]
  double regularization = 0;  ///< regularization of Stokeslets [m]
  double wavelength = 0;      ///< wavelength along rods, for resistive-force theory [m]; 0: rods are straight
};

/// Measure of bending strain: the angle between two edges (nearly; see geometry/bend_measure.hpp), or 2 tan of its
/// half.
enum class Bending { angle, tangent };

/// End of a rod at a joint or a clamp without end correction of bending (`Builder::share_bending`), because a support
/// held its edge. The previous amount of the correction stays as rest strain, so that nothing jumps.
struct UncorrectedEnd {
  int edge = 0;
  bool frame_first = false;  ///< true if the joint or the clamp is at the edge's tail
  /// Added to natural strains f (kappa1, kappa2, tau), also in a plane: of the stencil at the frame, and of that at the
  /// edge's other node.
  Vector3 at_frame = Vector3::Zero(), at_next = Vector3::Zero();

  bool is_of(int of, bool first) const { return edge == of && frame_first == first; }
};

struct SceneDescription {
  MatrixX3 positions;  ///< every node once [m]
  VectorX added_mass;  ///< per node [kg]
  Vector3 gravity = Vector3(0.0, 0.0, -9.81);
  Bending bending = Bending::angle;
  std::vector<RodDescription> rods;
  std::vector<BodyDescription> bodies;
  std::vector<JointDescription> joints;
  std::vector<LoopDescription> loops;
  std::vector<SupportDescription> supports;
  std::vector<UncorrectedEnd> uncorrected_ends;  ///< found by `build_model`; once one, always one
  std::vector<LoadDescription> loads;
  std::vector<SpringDescription> springs;
  std::vector<TendonDescription> tendons;
  std::vector<TorsionDescription> torsions;
  bool has_custom_force = false;  ///< nodal forces come from a callback
  bool custom_implicit = false;   ///< true if custom forces have derivatives, and are part of the residual
  bool custom_moments = false;    ///< and moments on nodes
  ContactDescription contact;
  FluidDescription fluid;
};

/// Row of the node of a pass.
inline int node_row(const SceneDescription& scene, RodPass pass) {
  return pass.on_body() ? pass.node
                        : scene.rods[static_cast<std::size_t>(pass.rod)].nodes[static_cast<std::size_t>(pass.node)];
}
/// False if a pass is at a node that is not there.
bool is_there(const SceneDescription& scene, RodPass pass);

/// Numbers that each part of a kind owns one of, or derivatives of a scalar by these numbers. parameter_index.hpp names
/// them.
struct PartNumbers {
  VectorX spring_stiffness, spring_rest_length, spring_damping;  ///< per spring [N/m], [m], [N s/m]
  /// Per revolute joint [N m/rad], [rad], [N m s/rad], [N m], [N m], [rad/s].
  VectorX joint_stiffness, joint_rest_angle, joint_damping, joint_moment, joint_max_torque, joint_max_speed;
  VectorX tendon_tension;                         ///< per tendon [N]
  VectorX torsion_stiffness, torsion_rest_angle;  ///< per torsion spring [N m/rad], [rad]
};

/// First row of a load among the rows of all loads.
inline Eigen::Index first_load_row(const SceneDescription& scene, std::size_t load) {
  Eigen::Index row = 0;
  for (std::size_t k = 0; k < load; ++k) row += scene.loads[k].values.rows();
  return row;
}

}  // namespace withe
