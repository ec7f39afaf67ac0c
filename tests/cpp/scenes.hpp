#pragma once
/// Small scenes to test with: rods drawn through points, with numbers of order one, so that no term hides behind
/// another. Points that coincide become one shared node.

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "geometry/rotation.hpp"
#include "model/description.hpp"

namespace withe::testing {

constexpr double kPi = std::numbers::pi;

/// The smallest rotation that turns direction `from` into `to`. (Eigen's own needs its SVD, which compiles for
/// seconds.)
inline Matrix3 smallest_rotation(const Vector3& from, const Vector3& to) {
  const Vector3 normal = from.cross(to);
  return rotation_exp(std::atan2(normal.norm(), from.dot(to)) * normal.normalized());
}

/// Properties of a rod, constant along its length.
struct RodMaterial {
  double stretch = 30.0;                  ///< EA [N]
  double bend1 = 1.0, bend2 = 0.7;        ///< EI1, EI2 [N m^2]
  double twist = 0.8;                     ///< GJ [N m^2]
  double density = 1.3, rotary = 0.0;     ///< [kg/m], [kg m]
  double viscous_time = 0.0, drag = 0.0;  ///< [s], [Pa s]
  Vector2 curvature = Vector2::Zero();    ///< natural [1/m]
  double natural_twist = 0.0;             ///< [rad/m]
};

/// A description that grows rod by rod.
class SceneBuilder {
 public:
  SceneDescription scene;

  SceneBuilder() { scene.gravity.setZero(); }

  int add_rod(const MatrixX3& points, const RodMaterial& material = {}, bool closed = false,
              const Vector3& normal = Vector3(0.3, -0.5, 0.8)) {
    RodDescription rod;
    rod.name = "rod " + std::to_string(scene.rods.size());
    rod.closed = closed;
    for (Eigen::Index i = 0; i < points.rows(); ++i) rod.nodes.push_back(node_at(points.row(i)));
    const Eigen::Index edges = points.rows() - (closed ? 0 : 1), stencils = closed ? edges : edges - 1;
    rod.rest_lengths.resize(edges);
    rod.directors.resize(edges, 3);
    Vector3 director = normal, before = Vector3::Zero();
    for (Eigen::Index e = 0; e < edges; ++e) {
      const Vector3 edge = (points.row((e + 1) % points.rows()) - points.row(e)).transpose();
      const Vector3 t = edge.normalized();
      rod.rest_lengths(e) = edge.norm();
      if (e > 0) director = smallest_rotation(before, t) * director;
      director = (director - t * t.dot(director)).normalized();
      rod.directors.row(e) = director;
      before = t;
    }
    rod.stretch_stiffness.setConstant(edges, material.stretch);
    rod.bend_stiffness.resize(edges, 2);
    rod.bend_stiffness.col(0).setConstant(material.bend1);
    rod.bend_stiffness.col(1).setConstant(material.bend2);
    rod.twist_stiffness.setConstant(edges, material.twist);
    rod.line_density.setConstant(edges, material.density);
    rod.rotary_inertia.setConstant(edges, material.rotary);
    rod.viscous_time.setConstant(edges, material.viscous_time);
    rod.drag.setConstant(edges, material.drag);
    rod.natural_curvature.resize(stencils, 2);
    for (Eigen::Index s = 0; s < stencils; ++s) rod.natural_curvature.row(s) = material.curvature;
    rod.natural_twist.setConstant(stencils, material.natural_twist);
    scene.rods.push_back(rod);
    return static_cast<int>(scene.rods.size()) - 1;
  }

  /// Rigidly joins rods that share a node.
  SceneBuilder& join(std::vector<RodPass> passes, JointForm form = JointForm::frame) {
    scene.joints.push_back({.clusters = {std::move(passes)}, .bodies = {}, .links = {}, .form = form});
    return *this;
  }
  SceneBuilder& join_revolute(std::vector<RodPass> fixed, RodPass turning, const Vector3& axis) {
    scene.joints.push_back({.clusters = {std::move(fixed), {turning}},
                            .bodies = {},
                            .links = {{0, 1, axis.normalized()}},
                            .form = JointForm::frame});
    return *this;
  }
  int support(SupportKind kind, RodPass pass, const Matrix3& free = Matrix3::Zero()) {
    SupportDescription& added = scene.supports.emplace_back();
    added.kind = kind;
    added.pass = pass;
    added.free = free;
    return static_cast<int>(scene.supports.size()) - 1;
  }
  int load(LoadKind kind, RodPass pass, const Vector3& value, bool follower = false) {
    scene.loads.push_back({kind, pass, value.transpose(), follower, false});
    return static_cast<int>(scene.loads.size()) - 1;
  }
  int last_node(int rod) const { return static_cast<int>(scene.rods[static_cast<std::size_t>(rod)].nodes.size()) - 1; }

 private:
  int node_at(const Vector3& point) {
    for (Eigen::Index i = 0; i < scene.positions.rows(); ++i)
      if ((scene.positions.row(i).transpose() - point).norm() < 1e-9) return static_cast<int>(i);
    scene.positions.conservativeResize(scene.positions.rows() + 1, 3);
    scene.positions.bottomRows<1>() = point.transpose();
    scene.added_mass.setZero(scene.positions.rows());
    return static_cast<int>(scene.positions.rows()) - 1;
  }
};

inline MatrixX3 line(const Vector3& start, const Vector3& end, int nodes) {
  MatrixX3 points(nodes, 3);
  for (int i = 0; i < nodes; ++i) points.row(i) = start + (end - start) * (static_cast<double>(i) / (nodes - 1));
  return points;
}

inline MatrixX3 helix(int nodes, double radius = 0.8, double pitch = 1.5, double turns = 1.2) {
  MatrixX3 points(nodes, 3);
  for (int i = 0; i < nodes; ++i) {
    const double a = 2.0 * kPi * turns * i / (nodes - 1);
    points.row(i) << radius * std::cos(a), radius * std::sin(a), pitch * a / (2.0 * kPi);
  }
  return points;
}

/// A quarter of a circle in the xz plane.
inline MatrixX3 arc(int nodes, double radius = 1.5) {
  MatrixX3 points(nodes, 3);
  for (int i = 0; i < nodes; ++i) {
    const double a = 0.5 * kPi * i / (nodes - 1);
    points.row(i) << radius * std::sin(a), 0.0, radius * std::cos(a);
  }
  return points;
}

/// Edges of length one in the xz plane whose neighbours turn by `turn` in alternating directions. Each pair turns about
/// a slightly tilted axis, so that the chain is not planar, unless `planar` is true.
inline MatrixX3 zigzag(int nodes, double turn, bool planar = false) {
  MatrixX3 points(nodes, 3);
  Vector3 x = Vector3::Zero(), t(1.0, 0.0, 0.0), axis(0.0, 1.0, 0.0);
  for (int i = 0; i < nodes; ++i) {
    points.row(i) = x;
    x += t;
    const double sign = i % 2 ? -1.0 : 1.0;
    if (!planar) axis = (axis + 0.1 * t.cross(axis)).normalized();
    t = (Eigen::AngleAxisd(sign * turn, axis) * t).normalized();
  }
  return points;
}

/// A ring of `nodes` in space, bent out of its plane.
inline MatrixX3 ring(int nodes, double radius = 1.0, double wave = 0.0) {
  MatrixX3 points(nodes, 3);
  for (int i = 0; i < nodes; ++i) {
    const double a = 2.0 * kPi * i / nodes;
    points.row(i) << radius * std::cos(a), radius * std::sin(a), wave * std::sin(2.0 * a);
  }
  return points;
}

/// A T: a bar through the joint and a stem from it; the bar in two rods or one, the stem drawn towards or away.
inline SceneBuilder tee(JointForm form, bool planar, const RodMaterial& material = {}) {
  SceneBuilder builder;
  const double out = planar ? 0.0 : 0.4;
  const Vector3 o(0.1, 0.0, 0.2), normal(0.0, 1.0, 0.0);
  const Vector3 hint = planar ? normal : Vector3(0.3, -0.5, 0.8);
  MatrixX3 bar(5, 3);
  bar << -2.0, out, 0.1, -0.9, 0.5 * out, 0.0, o.transpose(), 1.1, -out, 0.3, 2.0, 0.0, 0.2;
  builder.add_rod(bar, material, false, hint);
  builder.add_rod(line(Vector3(0.4, 2.0 * out, -2.0), o, 3), material, false, hint);  // arrives
  builder.add_rod(line(o, Vector3(-0.2, -out, 1.6), 3), material, false, hint);       // leaves
  builder.join({{0, 2}, {1, 2}, {2, 0}}, form);
  return builder;
}

/// Normal numbers from a fixed seed.
class RandomNumbers {
 public:
  explicit RandomNumbers(unsigned seed) : engine_(seed) {}
  double normal() { return normal_(engine_); }
  Vector3 vector() { return {normal(), normal(), normal()}; }
  VectorX vector(Eigen::Index n) {
    VectorX v(n);
    for (Eigen::Index i = 0; i < n; ++i) v(i) = normal();
    return v;
  }
  Matrix3 rotation() {
    return Eigen::Quaterniond(normal(), normal(), normal(), normal()).normalized().toRotationMatrix();
  }

 private:
  std::mt19937 engine_;
  std::normal_distribution<double> normal_;
};

}  // namespace withe::testing
