#include "elastica/sheet.hpp"

#include <algorithm>
#include <cmath>

#include "common/dual.hpp"
#include "elastica/runge_kutta.hpp"

namespace withe {

namespace {

using SheetDual = Dual<5>;  // by theta and m at the start of a segment, R, T, length

double sine(double x) { return std::sin(x); }
double cosine(double x) { return std::cos(x); }
SheetDual sine(const SheetDual& x) { return chain(x, std::sin(x.value), std::cos(x.value)); }
SheetDual cosine(const SheetDual& x) { return chain(x, std::cos(x.value), -std::sin(x.value)); }

/// The equations of the header.
template <class Scalar>
struct SheetSlope {
  double growth;
  Scalar up, forward, length;

  std::array<Scalar, 4> operator()(const Scalar& s, const std::array<Scalar, 4>& y) const {
    const Scalar c = cosine(y[0]), d = sine(y[0]);
    if (growth == 0) return {0.5 * y[1], (up - s) * c - forward * d, c, d};
    const Scalar width = 1.0 + growth * (length - s);
    const Scalar weight = s + growth * s * (length - 0.5 * s);
    return {0.5 * (y[1] / width), (up - weight) * c - forward * d, c, d};
  }
};

template <class Scalar>
std::array<Scalar, 4> across(const SheetSlope<Scalar>& slope, int segment, int steps, std::array<Scalar, 4> y) {
  const Scalar h = slope.length / static_cast<double>(SheetProblem::kSegments * steps);
  for (int i = 0; i < steps; ++i) {
    runge_kutta_step<2>(slope, static_cast<double>(segment * steps + i) * h, h, y);
  }
  return y;
}

}  // namespace

int sheet_steps(const SheetProblem::Path& path) {
  const auto& [up, forward, length] = path.values;
  const double farthest = std::max(up * up, (up - length) * (up - length));
  const double force = std::max(std::sqrt(farthest + forward * forward), 1e-3);
  const double step = std::min(0.4, std::sqrt(2.0 / force) * std::pow(5e-4 / force, 0.125));
  const double steps = std::ceil(length / (SheetProblem::kSegments * step));
  return static_cast<int>(std::clamp(steps, 1.0, 50.0));  // also where Newton's method went astray
}

std::array<double, 4> across_segment(const SheetShape& shape, const SheetProblem::Path& path, int segment) {
  const SheetSlope<double> slope{shape.width_growth, path.values[0], path.values[1], path.values[2]};
  return across<double>(slope, segment, sheet_steps(path), path.nodes[static_cast<std::size_t>(segment)]);
}

void SheetProblem::linearise(const Path& path, System& system) const {
  system.links.resize(kSegments);
  const SheetSlope<SheetDual> slope{shape.width_growth, SheetDual::unknown(path.values[0], 2),
                                    SheetDual::unknown(path.values[1], 3), SheetDual::unknown(path.values[2], 4)};
  const int steps = sheet_steps(path);
  for (int k = 0; k < kSegments; ++k) {
    const auto& y = path.nodes[static_cast<std::size_t>(k)];
    const auto end =
        across<SheetDual>(slope, k, steps, {SheetDual::unknown(y[0], 0), SheetDual::unknown(y[1], 1), y[2], y[3]});
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
      system.end_by_parameters[1][2] = friction;
      system.end_gap[1] = path.values[1] - friction * (path.values[0] + sheet_length - path.values[2]);
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
  const double width = 1.0 + slope.growth * (slope.length - s);
  return {by_moment + slope.growth * y[1] / width, curvature, y[3] == 0 ? 0.0 : climb};  // 2 b theta'', theta', Z'
}

/// State where a sign passes zero within a step, by false position with the value of an end that stays halved [Dowell
/// and Jarratt 1971]. What is sought there is greatest or least, so an error of 1e-5 of the step is one of 1e-10 in it.
std::array<double, 4> state_at_zero(const SheetSlope<double>& slope, double s, double h, const std::array<double, 4>& y,
                                    std::size_t which, double at_low, double at_high) {
  double low = 0, high = h, last = high;
  std::array<double, 4> state = y;
  int side = 0;
  for (int i = 0; i < 30; ++i) {
    const double place = (low * at_high - high * at_low) / (at_high - at_low);
    state = y;
    runge_kutta_step<2>(slope, s, place, state);
    if (std::abs(place - last) < 1e-5 * h) break;
    last = place;
    const double value = signs_at(slope, s + place, state)[which];
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
  return state;
}

}  // namespace

SheetExtremes sheet_extremes(const SheetShape& shape, const SheetProblem::Path& path) {
  const double length = path.values[2];
  const SheetSlope<double> slope{shape.width_growth, path.values[0], path.values[1], length};
  const int steps = sheet_steps(path);
  const double h = length / (SheetProblem::kSegments * steps);
  SheetExtremes found;
  const auto see = [&](double s, const std::array<double, 4>& y) {
    const double curvature = 0.5 * y[1] / (1.0 + shape.width_growth * (length - s));
    found.largest_curvature = std::max(found.largest_curvature, std::abs(curvature));
    found.smallest_angle = std::min(found.smallest_angle, y[0]);
    found.largest_angle = std::max(found.largest_angle, y[0]);
    found.lowest = std::min(found.lowest, y[3]);
  };
  for (int k = 0; k < SheetProblem::kSegments; ++k) {
    std::array<double, 4> y = path.nodes[static_cast<std::size_t>(k)];
    Signs before = signs_at(slope, k * steps * h, y);
    for (int i = 0; i < steps; ++i) {
      const double s = (k * steps + i) * h;
      const std::array<double, 4> start = y;
      runge_kutta_step<2>(slope, s, h, y);
      see(s + h, y);
      const Signs after = signs_at(slope, s + h, y);
      for (std::size_t j = 0; j < after.size(); ++j)
        if (before[j] * after[j] < 0) see(s, state_at_zero(slope, s, h, start, j, before[j], after[j]));
      before = after;
    }
  }
  return found;
}

}  // namespace withe
