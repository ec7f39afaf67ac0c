/// Sheets that hang from a jaw, for withe.folding. Arrays are checked there. This file checks only errors that would
/// crash.

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <iterator>
#include <limits>

#include "bindings.hpp"
#include "common/check.hpp"
#include "elastica/sheet_manifold.hpp"
#include "elastica/sheet_motion.hpp"

namespace withe::bindings {

namespace {

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Solve = SheetSolution (SheetManifold::*)(double, double, double, SheetManifold::Data&) const;

constexpr py::ssize_t kColumns = 10;

void put(const SheetSolution& found, double* row) {
  const double numbers[] = {found.x,
                            found.z,
                            found.angle,
                            found.suspended,
                            found.normal_force,
                            found.tangential_force,
                            found.max_curvature,
                            found.valid ? 1.0 : 0.0,
                            found.stable ? 1.0 : 0.0,
                            found.tip_moment};
  std::copy(std::begin(numbers), std::end(numbers), row);
}

/// One row a pose: x, z, angle, suspended, normal force, tangential force, greatest curvature, valid, stable, moment.
Numbers solve_all(const SheetManifold& manifold, Solve solve, const Numbers& first, const Numbers& second,
                  double tip_moment) {
  require(first.ndim() == 1 && second.ndim() == 1 && first.size() == second.size(),
          "both arrays must have shape (poses,)");
  Numbers rows({first.size(), kColumns});
  const double *a = first.data(), *b = second.data();
  double* row = rows.mutable_data();
  const py::gil_scoped_release unlocked;
  SheetManifold::Data data;
  for (py::ssize_t i = 0; i < first.size(); ++i, row += kColumns) {
    const SheetSolution found = (manifold.*solve)(a[i], b[i], tip_moment, data);
    put(found, row);
  }
  return rows;
}

/// Rows as above of equilibria named by normal force, tangential force and suspended length.
Numbers sheets_at_forces(const Numbers& forces, const SheetWidth& width) {
  require(forces.ndim() == 2 && forces.shape(1) == 3, "forces must have shape (sheets, 3)");
  Numbers rows({forces.shape(0), kColumns});
  const double* in = forces.data();
  double* row = rows.mutable_data();
  const py::gil_scoped_release unlocked;
  SheetMotionData data;
  const SheetShape shape{width, 0.0};
  for (py::ssize_t i = 0; i < forces.shape(0); ++i, in += 3, row += kColumns) {
    set_sheet_forces(shape, {in[0], in[1], in[2]}, data);
    put(describe_sheet(shape, data.path), row);
  }
  return rows;
}

/// Rows as above of sheets held at poses (x, z, angle), each followed from forces of its own.
Numbers sheets_at_poses(const Numbers& poses, const Numbers& forces, const SheetWidth& width) {
  require(poses.ndim() == 2 && poses.shape(1) == 3 && forces.ndim() == 2 && forces.shape(1) == 3 &&
              forces.shape(0) == poses.shape(0),
          "poses and forces must have shape (sheets, 3)");
  Numbers rows({poses.shape(0), kColumns});
  const double *pose = poses.data(), *in = forces.data();
  double* row = rows.mutable_data();
  const py::gil_scoped_release unlocked;
  SheetMotionData data;
  const SheetShape shape{width, 0.0};
  for (py::ssize_t i = 0; i < poses.shape(0); ++i, pose += 3, in += 3, row += kColumns) {
    set_sheet_forces(shape, {in[0], in[1], in[2]}, data);
    const bool there = move_sheet({pose[0], pose[1], pose[2]}, data);
    put(there ? describe_sheet(shape, data.path) : SheetSolution{}, row);
  }
  return rows;
}

/// Rows as above, and the slide, of a sheet that is moved from pose to pose and slides by Coulomb's law; after a pose
/// that it has no way to, rows are of no sheet.
py::tuple dragged_sheet(const Numbers& poses, const Numbers& forces, double friction, double sheet_length,
                        const SheetWidth& width) {
  require(poses.ndim() == 2 && poses.shape(1) == 3, "poses must have shape (poses, 3)");
  require(forces.ndim() == 1 && forces.size() == 3, "forces must have shape (3,)");
  Numbers rows({poses.shape(0), kColumns}), slides(poses.shape(0));
  const double *pose = poses.data(), *in = forces.data();
  double *row = rows.mutable_data(), *out = slides.mutable_data();
  {
    const py::gil_scoped_release unlocked;
    SheetMotionData data;
    const SheetShape shape{width, 0.0};
    set_sheet_forces(shape, {in[0], in[1], in[2]}, data);
    double slide = 0;
    bool there = true;
    for (py::ssize_t i = 0; i < poses.shape(0); ++i, pose += 3, row += kColumns) {
      there = there && drag_sheet({pose[0], pose[1], pose[2]}, {friction, sheet_length}, slide, data);
      put(there ? describe_sheet(shape, data.path) : SheetSolution{}, row);
      out[i] = slide;
    }
  }
  return py::make_tuple(rows, slides);
}

/// Slide of each of many sheets at which friction holds it, for a fixed pose and given forces. NaN where no equilibrium
/// is within reach.
Numbers slides_to_rest(const Numbers& forces, double friction, double sheet_length, const SheetWidth& width) {
  require(forces.ndim() == 2 && forces.shape(1) == 3, "forces must have shape (sheets, 3)");
  Numbers slides(forces.shape(0));
  const double* in = forces.data();
  double* out = slides.mutable_data();
  const py::gil_scoped_release unlocked;
  SheetMotionData data;
  const SheetShape shape{width, 0.0};
  for (py::ssize_t i = 0; i < forces.shape(0); ++i, in += 3) {
    set_sheet_forces(shape, {in[0], in[1], in[2]}, data);
    const SheetPose pose{tip_back(data.path), tip_up(data.path), tip_angle(data.path)};
    double slide = 0;
    const bool there = drag_sheet(pose, {friction, sheet_length}, slide, data);
    out[i] = there ? slide : std::numeric_limits<double>::quiet_NaN();
  }
  return slides;
}

}  // namespace

void register_elastica(py::module_& module) {
  py::class_<SheetWidth>(module, "SheetWidth", "Width of a sheet over the distance from its tip, in straight pieces.")
      .def(py::init<>(), "1 everywhere.")
      .def(py::init<const std::vector<double>&, const std::vector<double>&>(), py::arg("places"), py::arg("widths"))
      .def("width_at", &SheetWidth::width_at, py::arg("place"))
      .def("weight_at", &SheetWidth::weight_at, py::arg("place"),
           "Return the weight of the part from the tip to a place.");
  py::class_<SheetManifold>(module, "SheetManifold", "All poses in which a sheet can be held, tabulated once.")
      .def(py::init<const SheetWidth&>(), py::arg("width"), py::call_guard<py::gil_scoped_release>())
      .def(
          "at_position",
          [](const SheetManifold& self, const Numbers& x, const Numbers& z, double tip_moment) {
            return solve_all(self, &SheetManifold::at_position, x, z, tip_moment);
          },
          py::arg("x"), py::arg("z"), py::arg("tip_moment"), "One row a pose.")
      .def(
          "at_length_and_angle",
          [](const SheetManifold& self, const Numbers& length, const Numbers& angle, double tip_moment) {
            return solve_all(self, &SheetManifold::at_length_and_angle, length, angle, tip_moment);
          },
          py::arg("length"), py::arg("angle"), py::arg("tip_moment"), "One row a pose.")
      .def_readonly_static("shortest", &SheetManifold::kShortest)
      .def_readonly_static("longest", &SheetManifold::kLongest)
      .def_readonly_static("greatest_pull", &SheetManifold::kGreatestPull);
  module.def("sheets_at_forces", &sheets_at_forces, py::arg("forces"), py::arg("width"),
             "Sheets of given floor forces and suspended length, one row a sheet.");
  module.def("sheets_at_poses", &sheets_at_poses, py::arg("poses"), py::arg("forces"), py::arg("width"),
             "Sheets held at poses, each followed from forces of its own, one row a sheet.");
  module.def("dragged_sheet", &dragged_sheet, py::arg("poses"), py::arg("forces"), py::arg("friction"),
             py::arg("sheet_length"), py::arg("width"),
             "A sheet moved from pose to pose, sliding by Coulomb's law: one row a pose, and how far it has slid.");
  module.def("slides_to_rest", &slides_to_rest, py::arg("forces"), py::arg("friction"), py::arg("sheet_length"),
             py::arg("width"), "Return the distances that sheets with resting jaws slide until friction holds them.");
}

}  // namespace withe::bindings
