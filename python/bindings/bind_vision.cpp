/// Tracing of cables in images, for withe.perception. Arrays are checked there. This file checks only errors that would
/// crash.

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bindings.hpp"
#include "common/check.hpp"
#include "vision/color_image.hpp"
#include "vision/crossing_order.hpp"
#include "vision/ground_mask.hpp"
#include "vision/labels.hpp"
#include "vision/mbest.hpp"
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

const char* reason_of(Doubt doubt) {
  switch (doubt) {
    case Doubt::similar_energies:
      return "similar energies";
    case Doubt::parallel_strands:
      return "parallel strands";
    case Doubt::different_colors:
      return "different colors";
    case Doubt::ends_on_itself:
      return "ends on itself";
  }
  return "unknown";
}

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
    const char* reason = reason_of(doubt.reason);
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

/// A picture that NumPy owns.
ColorImage to_image(const Bytes& image) {
  require(image.ndim() == 3 && image.shape(2) == 3, "image must have shape (height, width, 3)");
  return {image.data(), static_cast<int>(image.shape(0)), static_cast<int>(image.shape(1)), image.strides(0)};
}

py::dict trace_lines(const Bytes& mask, const std::optional<Bytes>& image, const std::string& method) {
  const bool published = method == "mbest";
  require(published || method == "withe", "method must be 'withe' or 'mbest', got '" + method + "'");
  const BitImage bits = to_bits(mask);
  ColorImage picture;
  if (image) {
    picture = to_image(*image);
    require(picture.height == bits.height() && picture.width == bits.width(), "image and mask must have equal sizes");
  }
  // numpy.zeros leaves it to the system to clear pages when they are first used.
  auto labels = py::module_::import("numpy")
                    .attr("zeros")(py::make_tuple(bits.height(), bits.width()), "int32")
                    .cast<py::array_t<std::int32_t>>();
  std::int32_t* pixels = labels.mutable_data();
  Tracing tracing;
  double labelled = 1.0;
  {
    const py::gil_scoped_release release;
    if (published) {
      tracing = trace_mbest(bits);
      if (image) decide_order_mbest(picture, tracing);
      paint_discs(bits, tracing, pixels);
    } else {
      tracing = withe::trace_lines(bits, {}, image ? &picture : nullptr);
      Stopwatch watch(tracing.timings);
      if (image) decide_order(picture, tracing);
      watch.lap("order");
      paint_labels(bits, tracing, pixels);
      watch.lap("labels");
    }
    labelled = labelled_share(bits, pixels);
  }
  py::dict result = to_python(tracing, labels);
  result["cover"] = static_cast<double>(bits.count()) / std::max(1.0, double(bits.height()) * double(bits.width()));
  result["labelled"] = labelled;
  return result;
}

Bytes hsv_mask(const Bytes& image, const std::vector<std::pair<std::array<int, 3>, std::array<int, 3>>>& ranges) {
  const ColorImage picture = to_image(image);
  std::vector<HsvRange> list;
  for (const auto& [low, high] : ranges) list.push_back({low, high});
  Bytes mask({picture.height, picture.width});
  withe::hsv_mask(picture, list, mask.mutable_data());
  return mask;
}

Bytes foreground_mask(const Bytes& image, int contrast) {
  const ColorImage picture = to_image(image);
  Bytes mask({picture.height, picture.width});
  if (picture.height > 0 && picture.width > 0) withe::foreground_mask(picture, contrast, mask.mutable_data());
  return mask;
}

Bytes ground_mask(const Bytes& image, int contrast) {
  const ColorImage picture = to_image(image);
  Bytes mask({picture.height, picture.width});
  std::uint8_t* pixels = mask.mutable_data();
  const py::gil_scoped_release release;
  withe::ground_mask(picture, contrast, pixels);
  return mask;
}

}  // namespace

void register_vision(py::module_& module) {
  module.def(
      "thin", [](const Bytes& mask) { return to_array(withe::thin(to_bits(mask))); }, py::arg("mask"),
      "Skeleton of a mask by Zhang and Suen's rule as scikit-image has it.");
  module.def(
      "close_and_open", [](const Bytes& mask) { return to_array(dilate(erode(erode(dilate(to_bits(mask)))))); },
      py::arg("mask"), "Closing, then opening, by a square of 3 x 3 pixels.");
  module.def("hsv_mask", &hsv_mask, py::arg("image"), py::arg("ranges"), "Pixels whose colour is in a range.");
  module.def("foreground_mask", &foreground_mask, py::arg("image"), py::arg("contrast"),
             "Pixels whose colour is far from that of the border.");
  module.def("ground_mask", &ground_mask, py::arg("image"), py::arg("contrast"),
             "Pixels that differ from the ground beneath by more than a shadow can.");
  module.def(
      "has_dark_ground",
      [](const Bytes& image, int contrast) { return withe::has_dark_ground(to_image(image), contrast); },
      py::arg("image"), py::arg("contrast"), "True if shadows on the ground are fainter than the contrast.");
  module.def("trace_lines", &trace_lines, py::arg("mask"), py::arg("image") = py::none(), py::arg("method") = "withe",
             "Every line in a mask, in order, and labels.");
}

}  // namespace withe::bindings
