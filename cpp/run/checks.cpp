#include "run/checks.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "common/check.hpp"
#include "common/text.hpp"
#include "model/edge_vectors.hpp"
#include "run/failure.hpp"
#include "run/places.hpp"
#include "run/read.hpp"

namespace withe {
namespace {

/// True if a node of one edge is where a node of the other is, to rounding.
bool nodes_meet(const Model& model, const VectorX& q, int a, int b) {
  const int first[2] = {model.edge_tail[at(a)], model.edge_head[at(a)]},
            second[2] = {model.edge_tail[at(b)], model.edge_head[at(b)]};
  for (int i : first)
    for (int j : second)
      if ((node_position(model, q, i) - node_position(model, q, j)).norm() <= 1e-9 * model.length_scale) return true;
  return false;
}

}  // namespace

void check_impacts(const Options& options, const ContactDescription& contact) {
  const auto elastic = [](const ContactPairDescription& pair) {
    return !(pair.restitution >= 0.0) || pair.restitution == 1.0;
  };
  require(options.integrator != Integrator::verlet ||
              ((!contact.rods || contact.restitution == 1.0) && (contact.obstacle_restitution.array() == 1.0).all() &&
               std::all_of(contact.pairs.begin(), contact.pairs.end(), elastic)),
          "integrator 'verlet' supports elastic impacts only: use restitution=1, or an "
          "implicit integrator");
}

const char* dissipation_of(const Model& model, const Parameters& p) {
  if (model.description.contact.any()) return "contact";
  if (p.viscous) return "viscosity";
  if (model.description.fluid.model != FluidModel::none) return "a fluid";
  for (const Support& s : model.supports)
    if (s.active && s.yields() && (std::isfinite(s.description.hand.force_limit) || s.description.hand.friction != 0.0))
      return "hands that slip";
  if ((p.spring_damping.array() != 0.0).any()) return "damping of springs";
  if ((p.joint_damping.array() != 0.0).any()) return "damping of joints";
  for (const JointAngle& joint : model.joint_angles)
    if (joint.stops.stiffness != 0.0 && joint.stops.restitution != 1.0) return "restitution of stops below 1";
  return nullptr;
}

void check_reversible(const Model& model, const Options& options, const Parameters& p) {
  check_impacts(options, model.description.contact);
  require(
      options.integrator != Integrator::verlet || std::none_of(model.supports.begin(), model.supports.end(),
                                                               [](const Support& s) { return s.active && s.yields(); }),
      "integrator 'verlet' supports rigid hands only: use an implicit integrator for "
      "a hand that yields");
  require(options.integrator != Integrator::verlet || !model.has_bodies(),
          "integrator 'verlet' does not support rigid bodies: use 'energy_momentum' or 'backward_euler'");
  if (options.integrator != Integrator::fourth_order) return;
  const char* instead =
      ", because its inner steps go back in time: use integrator 'implicit_midpoint' or 'energy_momentum'";
  const char* dissipates = dissipation_of(model, p);
  require(!dissipates, "integrator 'fourth_order' does not support ", dissipates ? dissipates : "", instead);
  if (!p.dragged) return;
  for (int i = 0; i < model.node_count; ++i)
    require(p.node_drag(i) * options.time_step <= p.node_mass(i),
            "integrator 'fourth_order' supports drag for a time_step up to mass over drag only, ",
            p.node_mass(i) / p.node_drag(i), " s at node ", i, instead);
}

void check_fibre_strain(const Model& model, const Parameters& parameters, const Configuration& now, double time) {
  for (std::size_t r = 0; r < model.description.rods.size(); ++r) {
    const RodDescription& rod = model.description.rods[r];
    if (rod.fibre_distance.rows() == 0) continue;
    const MatrixX2 change = curvatures(model, parameters, now, static_cast<int>(r)) - parameters.natural_curvature[r];
    double worst = 0.0, curvature = 0.0, distance = 0.0;
    for (std::size_t s = 0; s < model.place[r].size(); ++s) {
      const int b = model.place[r][s].bend;
      if (b < 0) continue;
      const auto row = static_cast<Eigen::Index>(s);
      const auto fibres = [&](int i) {
        return rod.fibre_distance.row(model.bend[at(b)].edge[i] - model.rod_first_edge[r]);
      };
      const double strain = change.row(row).cwiseProduct(fibres(0).cwiseMin(fibres(1))).norm();
      if (strain <= worst) continue;
      worst = strain;
      curvature = change.row(row).norm();
      distance = strain / curvature;
    }
    if (worst < 1.0) continue;
    throw ConvergenceFailure(
        "natural curvature of rod '" + rod.name + "' differs from its curvature by " + text(curvature) +
            " 1/m, with fibres up to " + text(1e3 * distance) +
            " mm from the axis: the inner fibre would be compressed to nothing. Use a smaller natural_curvature, or "
            "change it over a time, over=",
        time, 0.0, static_cast<int>(r), -1, 0.0);
  }
}

void check_shares(const Model& model, const ContactPairDescription& pair) {
  if (pair.shares.size() == 0) return;
  require((pair.first < 0) != (pair.second < 0), "friction varies between a rod and an obstacle only");
  const auto& rod = model.description.rods[at(std::max(pair.first, pair.second))];
  const auto size = static_cast<Eigen::Index>(rod.nodes.size()) + rod.rest_lengths.size();
  require(pair.shares.size() == size, "friction of rod '" + rod.name + "' needs one number per node and per edge, ",
          size);
  require(pair.shares.allFinite() && pair.shares.minCoeff() >= 0.0, "friction must be finite and not negative");
}

void check_turn(const Model& model, int obstacle, const Vector3& turn) {
  const ObstacleDescription& drawn = model.description.contact.obstacles[at(obstacle)];
  const bool plane = drawn.kind == ObstacleKind::plane;
  const Vector3 axis = plane ? drawn.other : Vector3(drawn.other - drawn.point);
  require(turn.allFinite(), "turn of an obstacle must be finite");
  require(drawn.kind != ObstacleKind::shape || turn.isZero(),
          "obstacle '" + drawn.name + "' cannot turn: tubes and fields can be moved only");
  require(axis.cross(turn).norm() <= 1e-9 * axis.norm() * turn.norm(),
          "obstacle '" + drawn.name + "' can turn about " + (plane ? "its normal" : "its axis") + " only");
}

void check_pose(const Model& model, const SupportMotion& now, int support, const std::optional<Vector3>& position,
                const std::optional<Matrix3>& rotation) {
  require(!position || position->allFinite(), "position must be finite");
  require(
      !rotation || (rotation->allFinite() && (rotation->transpose() * *rotation - Matrix3::Identity()).norm() < 1e-6 &&
                    rotation->determinant() > 0.0),
      "rotation must be a proper rotation matrix");
  const Support& held = model.supports[at(support)];
  if (rotation && held.description.kind == SupportKind::spinning_clamp)
    require((*rotation * held.tangent - now.rotation * held.tangent).norm() < 1e-9,
            "a clamp that may spin keeps its tangent: use hold='edge' to turn the tangent");
}

void check_overlap(const Model& model, const Parameters& parameters, const State& state, const Contact* contact) {
  const SceneDescription& description = model.description;
  if (contact == nullptr) return;
  const ContactReport* deepest = nullptr;
  const std::vector<ContactReport> reports = contact->report(state, parameters);
  const bool bars = description.contact.law == ContactLaw::barrier;  // which is infinite where surfaces touch
  double depth = bars ? 0.0 : kMaxDepth, overlap = 0.0;
  const auto bodies = [&](const ContactKey& key) {
    return std::pair(model.edge_rod[at(key.a)], key.b < 0 ? key.b : model.edge_rod[at(key.b)]);
  };
  for (const ContactReport& r : reports) {
    const auto goes_on = [&](const ContactRecord& record) { return bodies(record.key) == bodies(r.key); };
    if (std::any_of(state.contacts.begin(), state.contacts.end(), goes_on)) continue;
    const double radius = contact->surfaces().scale(r.key);
    const double drawn = bars ? -r.gap : r.drawn_depth();
    if (drawn <= depth * radius && !(bars && r.gap <= 0.0)) continue;
    depth = drawn / radius;
    overlap = drawn;
    deepest = &r;
  }
  if (deepest == nullptr) return;
  const auto name = [&](int edge) {
    const int rod = model.edge_rod[at(edge)];
    return (model.is_surface(edge) ? "" : "edge " + std::to_string(edge - model.rod_first_edge[at(rod)]) + " of ") +
           name_of(model, rod);
  };
  const std::string other = deepest->key.b < 0 ? "'" + description.contact.obstacles[at(-1 - deepest->key.b)].name + "'"
                                               : name(deepest->key.b);
  const bool meet = deepest->key.b >= 0 && nodes_meet(model, state.q, deepest->key.a, deepest->key.b);
  const std::string advice =
      description.contact.overlap == Overlap::separate
          ? std::string(" m at the start and cannot be moved apart") +
                (model.planar() && deepest->key.b >= 0 ? " within their plane: build with planar=False, " : ": ") +
                "draw them apart, or leave the pair out with ignore_contact"
          : std::string(" m at the start: ") + (meet ? "join the nodes that meet there, " : "") +
                "draw them apart, leave the pair out with ignore_contact, or use "
                "enable_contact(overlap='separate')";
  require(false, name(deepest->key.a) + " and " + other + " overlap by " + text(0.0 + overlap) + advice);
}

bool leaves_plane(const Model& model, const SupportMotion& now, int support, const std::optional<Vector3>& position,
                  const std::optional<Matrix3>& rotation) {
  if (!model.planar()) return false;
  const Plane& plane = *model.plane;
  const Vector3& from = model.supports[at(support)].is_hand() ? now.position : plane.origin;  // a hand may be beside it
  return (position && std::abs((*position - from).dot(plane.normal)) > 1e-9 * model.length_scale) ||
         (rotation && (*rotation * now.rotation.transpose() * plane.normal - plane.normal).norm() > 1e-9);
}

bool leaves_plane(const Model& model, LoadKind kind, const Eigen::Ref<const MatrixX3>& values) {
  if (!model.planar()) return false;
  const Vector3& normal = model.plane->normal;
  return std::any_of(values.rowwise().begin(), values.rowwise().end(), [&](const auto& row) {
    const Vector3 value = row;
    const double off = is_axial(kind) ? value.cross(normal).norm() : std::abs(value.dot(normal));
    return off > 1e-8 * value.norm();
  });
}

std::string leaving_plane(const Model& model, const ParameterSetting& setting) {
  if (!model.planar()) return "";
  const auto& [kind, owner, values] = setting;
  const auto name = [&, rod = owner] { return " of rod '" + model.description.rods[at(rod)].name + "'"; };
  if (kind == ParameterKind::natural_curvature) {
    const Vector2 p = model.planar_components[at(owner)];
    for (Eigen::Index i = 0; i < values.rows(); ++i)
      if (std::abs(values(i, 0) * p(1) - values(i, 1) * p(0)) > 1e-8 * values.row(i).norm())
        return "natural curvature" + name();
  } else if (kind == ParameterKind::natural_twist) {
    if ((values.array() != 0.0).any()) return "natural twist" + name();
  } else if (kind == ParameterKind::bend_stiffness) {
    const Vector2 p = model.planar_components[at(owner)];
    const bool isotropic = (values.col(0).array() == values.col(1).array()).all();
    if (!isotropic && p.cwiseAbs().minCoeff() > 1e-9) return "the section" + name() + ", at an angle to it,";
  } else if (kind == ParameterKind::joint_moment || kind == ParameterKind::joint_rest_angle) {
    if (!model.joint_angles[at(owner)].turns() && values(0, 0) != 0.0) return "a revolute joint";
  } else if (kind == ParameterKind::gravity) {
    const Vector3 gravity = values.row(0);
    if (std::abs(gravity.dot(model.plane->normal)) > 1e-8 * gravity.norm()) return "gravity";
  }
  return "";
}

}  // namespace withe
