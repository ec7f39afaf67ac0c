/// Rods in space that hang from a gripper, for withe.deployment. Arrays are checked there; here only what would crash.

#include <pybind11/numpy.h>

#include <algorithm>
#include <iterator>

#include "bindings.hpp"
#include "common/check.hpp"
#include "elastica/rod_grasp.hpp"

namespace withe::bindings {

namespace {

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// One row a grasp: position, quaternion (w, x, y, z), floor's force, residual, solved, stable.
Numbers grasps(const GraspTable& table, const Numbers& questions, double twist_stiffness) {
  require(questions.ndim() == 2 && questions.shape(1) == 5, "questions must have shape (grasps, 5)");
  Numbers rows({questions.shape(0), py::ssize_t{13}});
  const double* asked = questions.data();
  double* row = rows.mutable_data();
  const py::gil_scoped_release unlocked;
  GraspTable::Data data;
  for (py::ssize_t i = 0; i < questions.shape(0); ++i, asked += 5, row += 13) {
    const RodGrasp found = table.grasp({asked[0], asked[1], asked[2], asked[3], asked[4]}, twist_stiffness, data);
    double* to = std::copy(found.tip.position.begin(), found.tip.position.end(), row);
    to = std::copy(found.tip.rotation.begin(), found.tip.rotation.end(), to);
    to = std::copy(found.floor_force.begin(), found.floor_force.end(), to);
    const double rest[] = {found.residual, found.solved ? 1.0 : 0.0, found.stable ? 1.0 : 0.0};
    std::copy(std::begin(rest), std::end(rest), to);
  }
  return rows;
}

}  // namespace

void register_deployment(py::module_& module) {
  py::class_<GraspTable>(module, "GraspTable", "Grasps that lay a rod, tabulated once.")
      .def(py::init<>())
      .def(
          "grasps", &grasps, py::arg("questions"), py::arg("twist_stiffness"),
          "One row a grasp, for rows of suspended length, curvature, stretching stiffness, axial force and base angle.")
      .def_readonly_static("shortest", &GraspTable::kShortest)
      .def_readonly_static("longest", &GraspTable::kLongest)
      .def_readonly_static("greatest_curvature", &GraspTable::kGreatestCurvature);
}

}  // namespace withe::bindings
