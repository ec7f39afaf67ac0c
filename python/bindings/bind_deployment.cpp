/// Rods in space that hang from a gripper, for withe.deployment. Arrays are checked there. This file checks only errors
/// that would crash.

#include <pybind11/numpy.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include "bindings.hpp"
#include "common/check.hpp"
#include "elastica/rod_grasp.hpp"
#include "elastica/rod_stability.hpp"
#include "elastica/rod_straight.hpp"

namespace withe::bindings {

namespace {

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// One row a grasp: position, quaternion (w, x, y, z), floor's force, residual, solved, stable.
Numbers grasps(const GraspTable& table, const Numbers& questions, double twist_stiffness) {
  require(questions.ndim() == 2 && questions.shape(1) == 6, "questions must have shape (grasps, 6)");
  Numbers rows({questions.shape(0), py::ssize_t{13}});
  const double* asked = questions.data();
  double* row = rows.mutable_data();
  const py::gil_scoped_release unlocked;
  GraspTable::Data data;
  for (py::ssize_t i = 0; i < questions.shape(0); ++i, asked += 6, row += 13) {
    const GraspQuestion question{asked[0], asked[1], asked[2], asked[3], asked[4], asked[5], twist_stiffness};
    const RodGrasp found = table.grasp(question, data);
    double* to = std::copy(found.tip.position.begin(), found.tip.position.end(), row);
    to = std::copy(found.tip.rotation.begin(), found.tip.rotation.end(), to);
    to = std::copy(found.floor_force.begin(), found.floor_force.end(), to);
    const double rest[] = {found.residual, found.solved ? 1.0 : 0.0, found.stable ? 1.0 : 0.0};
    std::copy(std::begin(rest), std::end(rest), to);
  }
  return rows;
}

/// Points of a solved rod, one row each: s, position, quaternion (w, x, y, z).
Numbers points_of(const RodShape& shape) {
  Numbers rows({static_cast<py::ssize_t>(shape.points.size()), py::ssize_t{8}});
  double* to = rows.mutable_data();
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    *to++ = shape.places[i];
    to = std::copy(shape.points[i].position.begin(), shape.points[i].position.end(), to);
    to = std::copy(shape.points[i].rotation.begin(), shape.points[i].rotation.end(), to);
  }
  return rows;
}

Numbers grasp_points(const GraspTable& table, double suspended, double curvature, double stretch_stiffness,
                     double axial_force) {
  GraspTable::Data data;
  require(table.solve({.suspended = suspended,
                       .curvature = curvature,
                       .stretch_stiffness = stretch_stiffness,
                       .axial_force = axial_force},
                      data),
          "no grasp found");
  return points_of(rod_shape(data.problem, data.path, 6));
}

/// x, z, the tangent's angle, floor's force along x and z, residual, found, stable.
std::array<double, 8> described(const RodShape& shape, double twist_stiffness) {
  const RodPoint& tip = shape.points.back();
  return {tip.position[0],
          tip.position[2],
          2.0 * std::atan2(-tip.rotation[2], tip.rotation[0]),
          shape.floor_force[0],
          shape.floor_force[2],
          shape.residual,
          1.0,
          rod_is_stable(shape, twist_stiffness) ? 1.0 : 0.0};
}

Numbers straight_poses(const StraightRod& rod, const Numbers& positions, double twist_stiffness) {
  require(positions.ndim() == 2 && positions.shape(1) == 2, "positions must have shape (poses, 2)");
  Numbers rows({positions.shape(0), py::ssize_t{8}});
  const double* asked = positions.data();
  double* row = rows.mutable_data();
  const py::gil_scoped_release unlocked;
  for (py::ssize_t i = 0; i < positions.shape(0); ++i, asked += 2, row += 8) {
    const auto shape = rod.at_position(asked[0], asked[1]);
    const auto numbers = shape ? described(*shape, twist_stiffness) : std::array<double, 8>{};
    std::copy(numbers.begin(), numbers.end(), row);
  }
  return rows;
}

Numbers straight_optima(const StraightRod& rod, double twist_stiffness) {
  const auto& folded = rod.folded();
  const auto first = described(rod.shape(rod.gentle()), twist_stiffness);
  const auto second = folded ? described(rod.shape(*folded), twist_stiffness) : std::array<double, 8>{};
  Numbers rows({py::ssize_t{2}, py::ssize_t{8}});
  std::copy(second.begin(), second.end(), std::copy(first.begin(), first.end(), rows.mutable_data()));
  return rows;
}

Numbers straight_points(const StraightRod& rod, double x, double z) {
  const auto shape = rod.at_position(x, z);
  require(shape.has_value(), "no pose there");
  return points_of(*shape);
}

Numbers straight_outline(const StraightRod& rod, double angle_step) {
  std::vector<std::array<double, 4>> rays;
  {
    const py::gil_scoped_release unlocked;
    rays = rod.outline(angle_step);
  }
  Numbers rows({static_cast<py::ssize_t>(rays.size()), py::ssize_t{4}});
  double* to = rows.mutable_data();
  for (const auto& ray : rays) to = std::copy(ray.begin(), ray.end(), to);
  return rows;
}

}  // namespace

void register_deployment(py::module_& module) {
  py::class_<GraspTable>(module, "GraspTable", "Grasps that lay a rod, tabulated once.")
      .def(py::init<>())
      .def(
          "grasps", &grasps, py::arg("questions"), py::arg("twist_stiffness"),
          "One row a grasp, for rows of suspended length, curvature, stretching stiffness, axial force, base angle and "
          "lever of the floor's force.")
      .def("points", &grasp_points, py::arg("suspended"), py::arg("curvature"), py::arg("stretch_stiffness"),
           py::arg("axial_force"), "The rod's points: s, position, quaternion.")
      .def_readonly_static("shortest", &GraspTable::kShortest)
      .def_readonly_static("longest", &GraspTable::kLongest)
      .def_readonly_static("greatest_curvature", &GraspTable::kGreatestCurvature);
  py::class_<StraightRod>(module, "StraightRod", "Poses in which a straight line is laid, for one suspended length.")
      .def(py::init<double, double>(), py::arg("suspended"), py::arg("stretch_stiffness"))
      .def("poses", &straight_poses, py::arg("positions"), py::arg("twist_stiffness"), "One row a position.")
      .def("optima", &straight_optima, py::arg("twist_stiffness"), "The gentle pose and the folded one.")
      .def("points", &straight_points, py::arg("x"), py::arg("z"), "The rod's points: s, position, quaternion.")
      .def("outline", &straight_outline, py::arg("angle_step"), "Nearest and farthest position on each ray.")
      .def_readonly_static("shortest", &StraightRod::kShortest)
      .def_readonly_static("longest", &StraightRod::kLongest);
}

}  // namespace withe::bindings
