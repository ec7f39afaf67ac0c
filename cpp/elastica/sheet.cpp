#include "elastica/sheet.hpp"

#include <algorithm>
#include <cmath>

#include "common/dual.hpp"
#include "common/hypotenuse.hpp"
#include "elastica/runge_kutta.hpp"

namespace withe {

namespace {

using SheetDual = Dual<5>;  // by theta and m at the start of a segment, R, T, length

double sine(double x) { return std::sin(x); }
double cosine(double x) { return std::cos(x); }
SheetDual sine(const SheetDual& x) { return chain(x, std::sin(x.value), std::cos(x.value)); }
SheetDual cosine(const SheetDual& x) { return chain(x, std::cos(x.value), -std::sin(x.value)); }

double value_of(double x) { return x; }
double value_of(const SheetDual& x) { return x.value; }

/// The equations of the header, where the width is one straight piece.
template <class Scalar>
struct SheetSlope {
  Scalar up, forward, length;
  const SheetWidth::Piece* piece = nullptr;  ///< none of an even sheet
  Scalar weight{};                           ///< of all that is lifted, of an uneven one

  std::array<Scalar, 4> operator()(const Scalar& s, const std::array<Scalar, 4>& y) const {
    const Scalar c = cosine(y[0]), d = sine(y[0]);
    if (piece == nullptr) return {0.5 * y[1], (up - s) * c - forward * d, c, d};
    const Scalar t = length - s, before = weight - piece->weight_at(t);
    return {0.5 * (y[1] / piece->width_at(t)), (up - before) * c - forward * d, c, d};
  }
};

/// Calls see(slope, s, h) for every step from s to s + h across a segment. Steps end where pieces of the width do.
template <class Scalar, class See>
void step_across(const SheetWidth& width, const std::array<Scalar, 3>& values, int segment, int steps, const See& see) {
  SheetSlope<Scalar> slope{values[0], values[1], values[2]};
  const Scalar& length = values[2];
  if (width.even()) {
    const Scalar h = length / static_cast<double>(SheetProblem::kSegments * steps);
    for (int i = 0; i < steps; ++i) see(slope, static_cast<double>(segment * steps + i) * h, h);
    return;
  }
  const double whole = value_of(length) / SheetProblem::kSegments;
  Scalar from = (static_cast<double>(segment) / SheetProblem::kSegments) * length;
  const Scalar end = (static_cast<double>(segment + 1) / SheetProblem::kSegments) * length;
  std::size_t piece = width.piece_before(value_of(length - from));
  slope.weight = width.pieces()[width.piece_before(value_of(length))].weight_at(length);
  for (bool last = false; !last;) {
    slope.piece = &width.pieces()[piece];
    last = piece == 0 || slope.piece->begin <= value_of(length - end);
    const Scalar to = last ? end : length - slope.piece->begin;
    const double part = std::ceil(steps * std::abs(value_of(to - from) / whole) - 1e-9);
    const double count = std::clamp(part, 1.0, static_cast<double>(steps));
    const Scalar h = (to - from) / count;
    for (double i = 0; i < count; ++i) see(slope, from + i * h, h);
    from = to;
    --piece;
  }
}

template <class Scalar>
std::array<Scalar, 4> across(const SheetWidth& width, const std::array<Scalar, 3>& values, int segment, int steps,
                             std::array<Scalar, 4> y) {
  step_across(width, values, segment, steps, [&y](const SheetSlope<Scalar>& slope, const Scalar& s, const Scalar& h) {
    runge_kutta_step<2>(slope, s, h, y);
  });
  return y;
}

}  // namespace

namespace {

double longest_step(double force, double width) {
  const double scale = std::sqrt(2.0 * width / force) * std::pow(5e-4 / force, 0.125);
  return std::min(0.4, scale);
}

/// Of an uneven sheet, at the distance t from its tip.
double longest_step_at(const SheetWidth& width, const SheetProblem::Path& path, double t) {
  const auto& [up, forward, length] = path.values;
  const double down = width.weight_at(length) - width.weight_at(t);
  const auto& piece = width.pieces()[width.piece_before(t)];
  const double b = std::max(piece.width_at(t), 1e-6);
  const double step = longest_step(std::max(hypotenuse(up - down, forward), 1e-3), b);
  return piece.slope == 0 ? step : std::min(step, 0.3 * b / std::abs(piece.slope));
}

}  // namespace

int sheet_steps(const SheetWidth& width, const SheetProblem::Path& path, int segment) {
  const auto& [up, forward, length] = path.values;
  double step = 0;
  if (width.even()) {
    const double farthest = std::max(up * up, (up - length) * (up - length));
    step = longest_step(std::max(std::sqrt(farthest + forward * forward), 1e-3), 1.0);
  } else {
    const double part = length / SheetProblem::kSegments, t = length - part * segment;
    step = std::min(longest_step_at(width, path, t), longest_step_at(width, path, t - part));
  }
  const double steps = std::ceil(length / (SheetProblem::kSegments * step));
  return static_cast<int>(std::clamp(steps, 1.0, 50.0));  // also where Newton's method went astray
}

std::array<double, 4> across_segment(const SheetShape& shape, const SheetProblem::Path& path, int segment) {
  const auto& start = path.nodes[static_cast<std::size_t>(segment)];
  return across<double>(shape.width, path.values, segment, sheet_steps(shape.width, path, segment), start);
}

void SheetProblem::linearise(const Path& path, System& system) const {
  system.links.resize(kSegments);
  const std::array<SheetDual, 3> values{SheetDual::unknown(path.values[0], 2), SheetDual::unknown(path.values[1], 3),
                                        SheetDual::unknown(path.values[2], 4)};
  for (int k = 0; k < kSegments; ++k) {
    const auto& y = path.nodes[static_cast<std::size_t>(k)];
    const std::array<SheetDual, 4> start{SheetDual::unknown(y[0], 0), SheetDual::unknown(y[1], 1), y[2], y[3]};
    const auto end = across<SheetDual>(shape.width, values, k, sheet_steps(shape.width, path, k), start);
    System::Link& link = system.links[static_cast<std::size_t>(k)];
    for (std::size_t i = 0; i < kStates; ++i) {
      link.by_state[i][0] = end[i].slope[0];
      link.by_state[i][1] = end[i].slope[1];
      link.by_state[i][2] = i == 2 ? 1.0 : 0.0;
      link.by_state[i][3] = i == 3 ? 1.0 : 0.0;
      for (int j = 0; j < kParameters; ++j) link.by_parameters[i][j] = end[i].slope[2 + j];
      link.gap[i] = end[i].value - path.nodes[static_cast<std::size_t>(k) + 1][i];
    }
  }
  put_end(path, system);
}

void SheetProblem::put_gaps(const Path& path, System& system) const {
  for (int k = 0; k < kSegments; ++k) {
    const auto end = across_segment(shape, path, k);
    for (std::size_t i = 0; i < kStates; ++i)
      system.links[static_cast<std::size_t>(k)].gap[i] = end[i] - path.nodes[static_cast<std::size_t>(k) + 1][i];
  }
  put_end(path, system);
}

double lying_weight(const SheetWidth& width, const SheetProblem::Path& path, double sheet_length) {
  return width.weight_at(sheet_length) - width.weight_at(path.values[2]);
}

void SheetProblem::put_end(const Path& path, System& system) const {
  for (int i = 0; i < kParameters; ++i) {
    std::fill_n(system.end_by_state[i], kStates, 0.0);
    std::fill_n(system.end_by_parameters[i], kParameters, 0.0);
  }
  const double x = tip_back(path), z = tip_up(path);
  const bool free_moment = target == TipTarget::pose || target == TipTarget::sliding;
  system.end_by_state[0][free_moment ? 0 : 1] = 1.0;
  system.end_gap[0] = free_moment ? tip_angle(path) - goal[2] : path.nodes.back()[1] - shape.tip_moment;
  if (target == TipTarget::position || free_moment) {
    system.end_by_state[2][3] = 1.0;
    system.end_gap[2] = z - goal[1];
    if (target == TipTarget::sliding) {
      system.end_by_parameters[1][0] = -friction;
      system.end_by_parameters[1][1] = 1.0;
      system.end_by_parameters[1][2] = friction * shape.width.width_at(path.values[2]);
      system.end_gap[1] = path.values[1] - friction * (path.values[0] + lying_weight(shape.width, path, sheet_length));
    } else {
      system.end_by_state[1][2] = -1.0;
      system.end_by_parameters[1][2] = 1.0;
      system.end_gap[1] = x - goal[0];
    }
    return;
  }
  system.end_by_parameters[1][2] = 1.0;
  system.end_gap[1] = path.values[2] - goal[0];
  if (target == TipTarget::length_and_angle) {
    system.end_by_state[2][0] = 1.0;
    system.end_gap[2] = tip_angle(path) - goal[1];
  } else {
    const double c = std::cos(goal[1]), d = std::sin(goal[1]);
    system.end_by_state[2][2] = -c;
    system.end_by_state[2][3] = -d;
    system.end_by_parameters[2][2] = c;
    system.end_gap[2] = c * x - d * z;
  }
}

namespace {

/// What has a zero where something is greatest or least: the slope of the curvature, the curvature, the climb.
using Signs = std::array<double, 3>;

Signs signs_at(const SheetSlope<double>& slope, double s, const std::array<double, 4>& y) {
  const auto [curvature, by_moment, along, climb] = slope(s, y);
  const double widening = slope.piece == nullptr ? 0.0 : slope.piece->slope;
  return {by_moment + 2.0 * widening * curvature, curvature, y[3] == 0 ? 0.0 : climb};  // 2 b theta'', theta', Z'
}

struct Extreme {
  std::array<double, 4> state;
  double curvature;
};

/// Where a sign passes zero within a step, by false position with the value of an end that stays halved [Dowell and
/// Jarratt 1971]. What is sought there is greatest or least, so an error of 1e-5 of the step is one of 1e-10 in it.
Extreme extreme_between(const SheetSlope<double>& slope, double s, double h, const std::array<double, 4>& y,
                        std::size_t which, double at_low, double at_high) {
  double low = 0, high = h, last = high;
  Extreme found{};
  int side = 0;
  for (int i = 0; i < 30; ++i) {
    const double place = (low * at_high - high * at_low) / (at_high - at_low);
    found.state = y;
    runge_kutta_step<2>(slope, s, place, found.state);
    const Signs signs = signs_at(slope, s + place, found.state);
    found.curvature = signs[1];
    if (std::abs(place - last) < 1e-5 * h) break;
    last = place;
    const double value = signs[which];
    if (value == 0) break;
    if ((value < 0) == (at_low < 0)) {
      low = place;
      at_low = value;
      if (side == 1) at_high /= 2;
      side = 1;
    } else {
      high = place;
      at_high = value;
      if (side == -1) at_low /= 2;
      side = -1;
    }
  }
  return found;
}

}  // namespace

SheetExtremes sheet_extremes(const SheetShape& shape, const SheetProblem::Path& path) {
  SheetExtremes found;
  const auto see = [&](double curvature, const std::array<double, 4>& y) {
    found.largest_curvature = std::max(found.largest_curvature, std::abs(curvature));
    found.smallest_angle = std::min(found.smallest_angle, y[0]);
    found.largest_angle = std::max(found.largest_angle, y[0]);
    found.lowest = std::min(found.lowest, y[3]);
  };
  for (int k = 0; k < SheetProblem::kSegments; ++k) {
    std::array<double, 4> y = path.nodes[static_cast<std::size_t>(k)];
    const int steps = sheet_steps(shape.width, path, k);
    step_across(shape.width, path.values, k, steps, [&](const SheetSlope<double>& slope, double s, double h) {
      const std::array<double, 4> start = y;
      const Signs before = signs_at(slope, s, y);
      runge_kutta_step<2>(slope, s, h, y);
      const Signs after = signs_at(slope, s + h, y);
      see(after[1], y);
      for (std::size_t j = 0; j < after.size(); ++j) {
        if (before[j] * after[j] >= 0) continue;
        const Extreme extreme = extreme_between(slope, s, h, start, j, before[j], after[j]);
        see(extreme.curvature, extreme.state);
      }
    });
  }
  return found;
}

}  // namespace withe
