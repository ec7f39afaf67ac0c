#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include "bindings.hpp"
#include "geometry/distance_field.hpp"
#include "geometry/tube.hpp"
#include "model/actuation.hpp"
#include "model/model.hpp"

namespace withe::bindings {
namespace {

constexpr Words<JointForm, 2> kJointForms{{{"frame", JointForm::frame}, {"pairs", JointForm::pairs}}};
constexpr Words<SupportKind, 6> kSupportKinds{{{"pin", SupportKind::pin},
                                               {"clamp", SupportKind::clamp},
                                               {"hold_edge", SupportKind::hold_edge},
                                               {"spinning_clamp", SupportKind::spinning_clamp},
                                               {"spinning_edge", SupportKind::spinning_edge},
                                               {"hand", SupportKind::hand}}};
constexpr Words<LoadKind, 4> kLoadKinds{{{"force", LoadKind::force},
                                         {"moment", LoadKind::moment},
                                         {"distributed", LoadKind::distributed},
                                         {"pressure", LoadKind::pressure}}};

constexpr Words<GuidePlace, 3> kGuidePlaces{
    {{"start", GuidePlace::start}, {"middle", GuidePlace::middle}, {"end", GuidePlace::end}}};
constexpr Words<Bending, 2> kBendings{{{"angle", Bending::angle}, {"tangent", Bending::tangent}}};
constexpr Words<ContactLaw, 4> kContactLaws{{{"imcv2", ContactLaw::imcv2},
                                             {"imcv1", ContactLaw::imcv1},
                                             {"barrier", ContactLaw::barrier},
                                             {"spillmann_teschner", ContactLaw::spillmann_teschner}}};
constexpr Words<StiffnessRule, 2> kStiffnessRules{
    {{"forces", StiffnessRule::forces}, {"source", StiffnessRule::source}}};
constexpr Words<FrictionLaw, 4> kFrictionLaws{{{"implicit", FrictionLaw::implicit},
                                               {"lagged", FrictionLaw::lagged},
                                               {"anchored", FrictionLaw::anchored},
                                               {"semi_explicit", FrictionLaw::semi_explicit}}};
constexpr Words<Overlap, 2> kOverlaps{{{"error", Overlap::error}, {"separate", Overlap::separate}}};
constexpr Words<FluidModel, 3> kFluidModels{
    {{"none", FluidModel::none}, {"resistive", FluidModel::resistive}, {"stokeslets", FluidModel::stokeslets}}};
constexpr Words<ObstacleKind, 3> kObstacleKinds{
    {{"plane", ObstacleKind::plane}, {"capsule", ObstacleKind::capsule}, {"shape", ObstacleKind::shape}}};

std::vector<Vec3d> rows_of(const MatrixX3& points) {
  std::vector<Vec3d> out;
  for (const auto& point : points.rowwise()) out.push_back({point(0), point(1), point(2)});
  return out;
}

VectorX distances(const Shape& shape, const MatrixX3& points) {
  VectorX out(points.rows());
  for (Eigen::Index i = 0; i < out.size(); ++i)
    out(i) = shape.distance({points(i, 0), points(i, 1), points(i, 2)}).distance;
  return out;
}

MatrixX3 normals(const Shape& shape, const MatrixX3& points) {
  MatrixX3 out(points.rows(), 3);
  for (Eigen::Index i = 0; i < out.rows(); ++i) {
    const Vec3d normal = shape.distance({points(i, 0), points(i, 1), points(i, 2)}).normal;
    out.row(i) << normal.x, normal.y, normal.z;
  }
  return out;
}

void register_shapes(py::module_& module) {
  py::class_<Shape, std::shared_ptr<Shape>>(module, "Shape", "A solid that rods touch, in axes of its own.")
      .def("distances", &distances, py::arg("points"), "Distances of points, shape (n,) [m].")
      .def("normals", &normals, py::arg("points"), "Gradients of the distances, shape (n, 3) [-].");
  py::class_<Tube, Shape, std::shared_ptr<Tube>>(module, "Tube", "A tube about an axis of quadratic Bezier curves.")
      .def(py::init([](const MatrixX3& ends, const MatrixX3& middles, double radius, double wall) {
             return std::make_shared<Tube>(rows_of(ends), rows_of(middles), radius, wall);
           }),
           py::arg("ends"), py::arg("middles"), py::arg("radius"), py::arg("wall"));
  py::class_<DistanceField, Shape, std::shared_ptr<DistanceField>>(module, "DistanceField",
                                                                   "A signed distance as a cubic spline on a grid.")
      .def(py::init([](const VectorX& coefficients, const std::array<int, 3>& points, const Vector3& origin,
                       const Vector3& spacing) {
             return std::make_shared<DistanceField>(std::vector<double>(coefficients.begin(), coefficients.end()),
                                                    points, Vec3d{origin.x(), origin.y(), origin.z()},
                                                    Vec3d{spacing.x(), spacing.y(), spacing.z()});
           }),
           py::arg("coefficients"), py::arg("points"), py::arg("origin"), py::arg("spacing"));
}

void register_rod(py::module_& module) {
  py::class_<FaceDescription>(module, "FaceDescription", "A face of the surface of a rigid body.")
      .def(py::init<>())
      .def_readwrite("edge", &FaceDescription::edge)
      .def_readwrite("aside", &FaceDescription::aside)
      .def_readwrite("depth", &FaceDescription::depth)
      .def_readwrite("outline", &FaceDescription::outline);
  py::class_<RodDescription>(module, "RodDescription", "A rod as a chain of nodes.")
      .def(py::init<>())
      .def_readwrite("name", &RodDescription::name)
      .def_readwrite("nodes", &RodDescription::nodes)
      .def_readwrite("closed", &RodDescription::closed)
      .def_readwrite("directors", &RodDescription::directors)
      .def_readwrite("rest_lengths", &RodDescription::rest_lengths)
      .def_readwrite("arc_lengths", &RodDescription::arc_lengths)
      .def_readwrite("stretch_stiffness", &RodDescription::stretch_stiffness)
      .def_readwrite("bend_stiffness", &RodDescription::bend_stiffness)
      .def_readwrite("twist_stiffness", &RodDescription::twist_stiffness)
      .def_readwrite("line_density", &RodDescription::line_density)
      .def_readwrite("rotary_inertia", &RodDescription::rotary_inertia)
      .def_readwrite("viscous_time", &RodDescription::viscous_time)
      .def_readwrite("drag", &RodDescription::drag)
      .def_readwrite("natural_curvature", &RodDescription::natural_curvature)
      .def_readwrite("natural_twist", &RodDescription::natural_twist)
      .def_readwrite("contact_radius", &RodDescription::contact_radius)
      .def_readwrite("fluid_radius", &RodDescription::fluid_radius)
      .def_readwrite("fibre_distance", &RodDescription::fibre_distance)
      .def_readwrite("body", &RodDescription::body)
      .def_readwrite("faces", &RodDescription::faces)
      .def_readwrite("edge_faces", &RodDescription::edge_faces)
      .def_readwrite("friction", &RodDescription::friction)
      .def_readwrite("restitution", &RodDescription::restitution);
}

void register_body(py::module_& module) {
  py::class_<BodyDescription>(module, "BodyDescription", "A rigid body: a frame at a node, and nodes that it carries.")
      .def(py::init<>())
      .def_readwrite("name", &BodyDescription::name)
      .def_readwrite("node", &BodyDescription::node)
      .def_readwrite("center", &BodyDescription::center)
      .def_readwrite("carried", &BodyDescription::carried)
      .def_readwrite("inertia", &BodyDescription::inertia)
      .def_readwrite("carrier", &BodyDescription::carrier);

  py::class_<LoopDescription>(module, "LoopDescription", "A closed loop of joints: a body, and its copy at a joint.")
      .def(py::init<int, int, int, int>(), py::arg("copy"), py::arg("body"), py::arg("copy_node"),
           py::arg("body_node"));
}

void register_contact(py::module_& module) {
  py::class_<ObstacleDescription> obstacle(module, "ObstacleDescription", "Something solid that does not move.");
  obstacle.def(py::init<>())
      .def_readwrite("point", &ObstacleDescription::point)
      .def_readwrite("other", &ObstacleDescription::other)
      .def_readwrite("radius", &ObstacleDescription::radius)
      .def_readwrite("name", &ObstacleDescription::name)
      .def("set_shape", [](ObstacleDescription& o, const std::shared_ptr<Shape>& shape) { o.shape = shape; });
  def_word(obstacle, "kind", &ObstacleDescription::kind, kObstacleKinds);
  py::class_<ContactPairDescription>(module, "ContactPairDescription", "What two bodies have of their own.")
      .def(py::init<>())
      .def_readwrite("first", &ContactPairDescription::first)
      .def_readwrite("second", &ContactPairDescription::second)
      .def_readwrite("ignored", &ContactPairDescription::ignored)
      .def_readwrite("friction", &ContactPairDescription::friction)
      .def_readwrite("stiffness", &ContactPairDescription::stiffness)
      .def_readwrite("restitution", &ContactPairDescription::restitution)
      .def_readwrite("shares", &ContactPairDescription::shares);
  py::class_<ContactDescription> contact(module, "ContactDescription", "What touches, and how.");
  contact.def(py::init<>())
      .def_readwrite("rods", &ContactDescription::rods)
      .def_readwrite("warns_of_crossings", &ContactDescription::warns_of_crossings)
      .def_readwrite("friction", &ContactDescription::friction)
      .def_readwrite("obstacle_friction", &ContactDescription::obstacle_friction)
      .def_readwrite("obstacle_rolling", &ContactDescription::obstacle_rolling)
      .def_readwrite("restitution", &ContactDescription::restitution)
      .def_readwrite("obstacle_restitution", &ContactDescription::obstacle_restitution)
      .def_readwrite("distance_tolerance", &ContactDescription::distance_tolerance)
      .def_readwrite("slip_tolerance", &ContactDescription::slip_tolerance)
      .def_readwrite("stiffness", &ContactDescription::stiffness)
      .def_readwrite("centreline_friction", &ContactDescription::centreline_friction)
      .def_readwrite("obstacles", &ContactDescription::obstacles)
      .def_readwrite("pairs", &ContactDescription::pairs);
  def_word(contact, "law", &ContactDescription::law, kContactLaws);
  def_word(contact, "friction_law", &ContactDescription::friction_law, kFrictionLaws);
  def_word(contact, "stiffness_rule", &ContactDescription::stiffness_rule, kStiffnessRules);
  def_word(contact, "overlap", &ContactDescription::overlap, kOverlaps);
}

void register_fluid(py::module_& module) {
  py::class_<FluidDescription> fluid(module, "FluidDescription", "A viscous fluid around all rods.");
  fluid.def(py::init<>())
      .def_readwrite("viscosity", &FluidDescription::viscosity)
      .def_readwrite("regularization", &FluidDescription::regularization)
      .def_readwrite("wavelength", &FluidDescription::wavelength);
  def_word(fluid, "model", &FluidDescription::model, kFluidModels);
}

void register_joints_and_supports(py::module_& module) {
  py::class_<RodPass>(module, "RodPass", "A node of a rod.")
      .def(py::init([](int rod, int node) { return RodPass{rod, node}; }), py::arg("rod"), py::arg("node"))
      .def_readwrite("rod", &RodPass::rod)
      .def_readwrite("node", &RodPass::node);

  py::class_<JointLink>(module, "JointLink", "The child cluster turns about an axis relative to the parent.")
      .def(py::init([](int parent, int child, const Vector3& axis) {
             JointLink link;
             link.parent = parent;
             link.child = child;
             link.axis = axis;
             return link;
           }),
           py::arg("parent"), py::arg("child"), py::arg("axis"))
      .def_readwrite("parent", &JointLink::parent)
      .def_readwrite("child", &JointLink::child)
      .def_readwrite("axis", &JointLink::axis)
      .def_readwrite("slides", &JointLink::slides)
      .def_readwrite("stiffness", &JointLink::stiffness)
      .def_readwrite("rest_angle", &JointLink::rest_angle)
      .def_readwrite("damping", &JointLink::damping)
      .def_readwrite("moment", &JointLink::moment)
      .def_readwrite("max_torque", &JointLink::max_torque)
      .def_readwrite("max_speed", &JointLink::max_speed)
      .def(
          "set_stops",
          [](JointLink& link, double low, double high, double stiffness, double restitution) {
            link.stops = {low, high, stiffness, restitution};
          },
          py::arg("low"), py::arg("high"), py::arg("stiffness"), py::arg("restitution"));

  py::class_<JointDescription> joint(module, "JointDescription", "A node that several rods share.");
  joint.def(py::init<>())
      .def_readwrite("clusters", &JointDescription::clusters)
      .def_readwrite("bodies", &JointDescription::bodies)
      .def_readwrite("links", &JointDescription::links);
  def_word(joint, "form", &JointDescription::form, kJointForms);

  py::class_<HandDescription>(module, "HandDescription", "What a hand holds.")
      .def(py::init<>())
      .def_readwrite("at", &HandDescription::at)
      .def_readwrite("length", &HandDescription::length)
      .def_readwrite("posed", &HandDescription::posed)
      .def_readwrite("position", &HandDescription::position)
      .def_readwrite("rotation", &HandDescription::rotation)
      .def_readwrite("yields", &HandDescription::yields)
      .def_readwrite("stiffness", &HandDescription::stiffness)
      .def_readwrite("force_limit", &HandDescription::force_limit)
      .def_readwrite("slides", &HandDescription::slides)
      .def_readwrite("friction", &HandDescription::friction)
      .def_readwrite("feeds", &HandDescription::feeds)
      .def_readwrite("feed_rate", &HandDescription::feed_rate)
      .def_readwrite("node", &HandDescription::node);

  py::class_<SupportDescription> support(module, "SupportDescription", "Something that holds a node.");
  support.def(py::init<>())
      .def_readwrite("pass_", &SupportDescription::pass)
      .def_readwrite("free", &SupportDescription::free)
      .def_readwrite("axis", &SupportDescription::axis)
      .def_readwrite("hand", &SupportDescription::hand);
  def_word(support, "kind", &SupportDescription::kind, kSupportKinds);
}

void register_loads(py::module_& module) {
  py::class_<LoadDescription> load(module, "LoadDescription", "A force, a moment or a distributed load.");
  load.def(py::init<>())
      .def_readwrite("pass_", &LoadDescription::pass)
      .def_readwrite("values", &LoadDescription::values)
      .def_readwrite("follower", &LoadDescription::follower)
      .def_readwrite("varies", &LoadDescription::varies);
  def_word(load, "kind", &LoadDescription::kind, kLoadKinds);
}

void register_springs(py::module_& module) {
  py::class_<SpringDescription>(module, "SpringDescription", "A spring with a damper beside it between two nodes.")
      .def(py::init<>())
      .def_readwrite("nodes", &SpringDescription::nodes)
      .def_readwrite("stiffness", &SpringDescription::stiffness)
      .def_readwrite("rest_length", &SpringDescription::rest_length)
      .def_readwrite("damping", &SpringDescription::damping);
}

void register_tendons(py::module_& module) {
  py::class_<TendonDescription>(module, "TendonDescription", "A tendon that runs through guides on edges.")
      .def(py::init([](const std::vector<std::tuple<int, int, std::string>>& guides, const MatrixX2& offsets,
                       double tension) {
             TendonDescription tendon{.guides = {}, .offsets = offsets, .tension = tension};
             for (const auto& [rod, edge, place] : guides)
               tendon.guides.push_back({rod, edge, from_word(kGuidePlaces, place)});
             return tendon;
           }),
           py::arg("guides"), py::arg("offsets"), py::arg("tension"));
}

void register_torsions(py::module_& module) {
  py::class_<TorsionDescription>(module, "TorsionDescription", "A torsion spring between two edges.")
      .def(py::init([](const std::array<int, 2>& rods, const std::array<int, 2>& edges, const Vector3& axis,
                       const Vector3& reference, double stiffness, double rest_angle) {
             return TorsionDescription{rods, edges, axis, reference, stiffness, rest_angle};
           }),
           py::arg("rods"), py::arg("edges"), py::arg("axis"), py::arg("reference"), py::arg("stiffness"),
           py::arg("rest_angle"));
}

}  // namespace

void register_model(py::module_& module) {
  register_rod(module);
  register_body(module);
  register_joints_and_supports(module);
  register_loads(module);
  register_springs(module);
  register_tendons(module);
  register_torsions(module);
  register_shapes(module);
  register_contact(module);
  register_fluid(module);
  py::class_<SceneDescription> scene(module, "SceneDescription", "What the scene layer hands to the engine.");
  def_word(scene, "bending", &SceneDescription::bending, kBendings);
  scene.def(py::init<>())
      .def_readwrite("positions", &SceneDescription::positions)
      .def_readwrite("added_mass", &SceneDescription::added_mass)
      .def_readwrite("gravity", &SceneDescription::gravity)
      .def_readwrite("rods", &SceneDescription::rods)
      .def_readwrite("bodies", &SceneDescription::bodies)
      .def_readwrite("joints", &SceneDescription::joints)
      .def_readwrite("loops", &SceneDescription::loops)
      .def_readwrite("supports", &SceneDescription::supports)
      .def_readwrite("loads", &SceneDescription::loads)
      .def_readwrite("springs", &SceneDescription::springs)
      .def_readwrite("tendons", &SceneDescription::tendons)
      .def_readwrite("torsions", &SceneDescription::torsions)
      .def_readwrite("has_custom_force", &SceneDescription::has_custom_force)
      .def_readwrite("custom_implicit", &SceneDescription::custom_implicit)
      .def_readwrite("custom_moments", &SceneDescription::custom_moments)
      .def_readwrite("contact", &SceneDescription::contact)
      .def_readwrite("fluid", &SceneDescription::fluid);
  module.def(
      "smooth_curvatures", &smooth_curvatures, py::arg("discrete"), py::arg("voronoi"),
      "Curvatures [1/m] of the smooth rod that turns by the same angles as discrete ones 2 tan(phi / 2), a row a "
      "stencil.");
  module.def("drawn_strains", &drawn_strains, py::arg("tangents"), py::arg("directors"), py::arg("closed"),
             "Strains (kappa1, kappa2, tau) of the stencils of a rod as it is drawn, by its edges' tangents and first "
             "directors, a row each.");
  module.def(
      "check_turns",
      [](const MatrixX2& smooth, const VectorX& voronoi, const std::string& owner) {
        check_turns({smooth.data(), smooth.rows(), 2}, voronoi, [&] { return owner; });
      },
      py::arg("smooth"), py::arg("voronoi"), py::arg("owner"),
      "Refuse curvatures [1/m] that turn a rod by pi or more at a node.");
}

}  // namespace withe::bindings
