/// Tracing of cables in images, for withe.perception. Arrays are checked there; here only what would crash.

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cstdint>
#include <string>

#include "bindings.hpp"
#include "common/check.hpp"
#include "vision/labels.hpp"
#include "vision/thinning.hpp"
#include "vision/tracing.hpp"

namespace withe::bindings {

namespace {

using Bytes = py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast>;

BitImage to_bits(const Bytes& mask) {
  require(mask.ndim() == 2 && mask.shape(0) > 0 && mask.shape(1) > 0,
          "mask must have shape (height, width) and at least one pixel");
  require(mask.shape(0) < (1 << 16) && mask.shape(1) < (1 << 16), "mask must be smaller than 65536 x 65536");
  return pack(mask.data(), static_cast<int>(mask.shape(0)), static_cast<int>(mask.shape(1)), mask.strides(0));
}

Bytes to_array(const BitImage& image) {
  Bytes result({image.height(), image.width()});
  unpack(image, result.mutable_data());
  return result;
}

py::array_t<double> points_array(const MatrixX2& points) {
  py::array_t<double> result({points.rows(), Eigen::Index{2}});
  std::copy(points.data(), points.data() + points.size(), result.mutable_data());
  return result;
}

py::tuple row_tuple(const CableRow& row) { return py::make_tuple(row.cable, row.row); }

/// Plain Python objects: the Python layer makes its own of them.
py::dict to_python(const Tracing& tracing, const py::array_t<std::int32_t>& labels) {
  py::list centrelines, widths, closed, crossings, joints, doubts;
  for (const Cable& cable : tracing.cables) {
    centrelines.append(points_array(cable.centreline));
    widths.append(py::array_t<double>(static_cast<py::ssize_t>(cable.widths.size()), cable.widths.data()));
    closed.append(cable.closed);
  }
  for (const Crossing& crossing : tracing.crossings) {
    crossings.append(py::make_tuple(crossing.point.x(), crossing.point.y(), row_tuple(crossing.over),
                                    row_tuple(crossing.under), crossing.confidence));
  }
  for (const Joint& joint : tracing.joints) {
    joints.append(py::make_tuple(joint.point.x(), joint.point.y(), row_tuple(joint.end), row_tuple(joint.through)));
  }
  for (const DoubtfulZone& doubt : tracing.doubts) {
    const char* reason = doubt.reason == Doubt::similar_energies ? "similar energies" : "parallel strands";
    doubts.append(py::make_tuple(doubt.point.x(), doubt.point.y(), reason));
  }
  py::dict timings;
  for (const Timing& timing : tracing.timings) timings[timing.step.c_str()] = timing.seconds;
  py::dict result;
  result["centrelines"] = centrelines;
  result["widths"] = widths;
  result["closed"] = closed;
  result["crossings"] = crossings;
  result["joints"] = joints;
  result["ambiguous"] = doubts;
  result["timings"] = timings;
  result["labels"] = labels;
  return result;
}

py::dict trace_lines(const Bytes& mask) {
  const BitImage bits = to_bits(mask);
  py::array_t<std::int32_t> labels({bits.height(), bits.width()});
  std::fill(labels.mutable_data(), labels.mutable_data() + labels.size(), 0);
  std::int32_t* pixels = labels.mutable_data();
  Tracing tracing;
  {
    const py::gil_scoped_release release;
    tracing = withe::trace_lines(bits, {});
    paint_labels(bits, tracing, pixels);
  }
  return to_python(tracing, labels);
}

}  // namespace

void register_vision(py::module_& module) {
  module.def(
      "thin", [](const Bytes& mask) { return to_array(withe::thin(to_bits(mask))); }, py::arg("mask"),
      "Skeleton of a mask by Zhang and Suen's rule as scikit-image has it.");
  module.def("trace_lines", &trace_lines, py::arg("mask"), "Every line in a mask, in order, and labels.");
}

}  // namespace withe::bindings
