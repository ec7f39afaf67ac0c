/// Sheets that hang from a jaw, for withe.folding. Arrays are checked there; here only what would crash.

#include <pybind11/numpy.h>

#include <algorithm>
#include <iterator>

#include "bindings.hpp"
#include "common/check.hpp"
#include "elastica/sheet_manifold.hpp"

namespace withe::bindings {

namespace {

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Solve = SheetSolution (SheetManifold::*)(double, double, const SheetShape&, SheetManifold::Data&) const;

/// One row a pose: x, z, angle, suspended, normal force, tangential force, greatest curvature, valid, stable.
Numbers solve_all(const SheetManifold& manifold, Solve solve, const Numbers& first, const Numbers& second,
                  double width_growth, double tip_moment) {
  require(first.ndim() == 1 && second.ndim() == 1 && first.size() == second.size(),
          "both arrays must have shape (poses,)");
  Numbers rows({first.size(), py::ssize_t{9}});
  const double *a = first.data(), *b = second.data();
  double* row = rows.mutable_data();
  const py::gil_scoped_release unlocked;
  SheetManifold::Data data;
  for (py::ssize_t i = 0; i < first.size(); ++i, row += 9) {
    const SheetSolution found = (manifold.*solve)(a[i], b[i], {width_growth, tip_moment}, data);
    const double numbers[] = {found.x,
                              found.z,
                              found.angle,
                              found.suspended,
                              found.normal_force,
                              found.tangential_force,
                              found.max_curvature,
                              found.valid ? 1.0 : 0.0,
                              found.stable ? 1.0 : 0.0};
    std::copy(std::begin(numbers), std::end(numbers), row);
  }
  return rows;
}

}  // namespace

void register_elastica(py::module_& module) {
  py::class_<SheetManifold>(module, "SheetManifold", "All poses in which a sheet can be held, tabulated once.")
      .def(py::init<>())
      .def(
          "at_position",
          [](const SheetManifold& self, const Numbers& x, const Numbers& z, double width_growth, double tip_moment) {
            return solve_all(self, &SheetManifold::at_position, x, z, width_growth, tip_moment);
          },
          py::arg("x"), py::arg("z"), py::arg("width_growth"), py::arg("tip_moment"), "One row a pose.")
      .def(
          "at_length_and_angle",
          [](const SheetManifold& self, const Numbers& length, const Numbers& angle, double width_growth,
             double tip_moment) {
            return solve_all(self, &SheetManifold::at_length_and_angle, length, angle, width_growth, tip_moment);
          },
          py::arg("length"), py::arg("angle"), py::arg("width_growth"), py::arg("tip_moment"), "One row a pose.");
}

}  // namespace withe::bindings
