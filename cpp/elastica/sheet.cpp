#include "elastica/sheet.hpp"

#include <algorithm>
#include <cmath>

#include "common/hypotenuse.hpp"
#include "elastica/runge_kutta.hpp"
#include "elastica/sheet_slope.hpp"

namespace withe {

namespace {

double longest_step(double force, double width) {
  const double scale = std::sqrt(2.0 * width / force) * std::sqrt(std::sqrt(std::sqrt(5e-4 / force)));
  return std::min(0.4, scale);
}

/// Slopes of an uneven sheet, at the distance t from its tip.
double longest_step_at(const SheetWidth& width, const SheetProblem::Path& path, double t) {
  const auto& [up, forward, length] = path.values;
  const double down = width.weight_at(length) - width.weight_at(t);
  const auto& piece = width.pieces()[width.piece_before(t)];
  const double b = std::max(piece.width_at(t), 1e-6);
  const double step = longest_step(std::max(hypotenuse(up - down, forward), 1e-3), b);
  return piece.slope == 0 ? step : std::min(step, 0.3 * b / std::abs(piece.slope));
}

/// Number of Runge-Kutta steps across each segment. A step h is at most 0.4 Lgb, and so short that the error of the
/// first integral is below some 1e-9 w Lgb^2. At a force F this error is about 1e-5 F (h / sqrt(EI / F))^8. Where the
/// width changes by itself within r, 1 / b has a pole at that distance, and the error is about 1e-5 (h / r)^8.
std::array<int, SheetProblem::kSegments> steps_of(const SheetWidth& width, const SheetProblem::Path& path) {
  const auto& [up, forward, length] = path.values;
  const double part = length / SheetProblem::kSegments;
  const auto count = [part](double step) {
    return static_cast<int>(std::clamp(std::ceil(part / step), 1.0, 50.0));  // also where Newton's method went astray
  };
  std::array<int, SheetProblem::kSegments> steps{};
  if (width.even()) {
    const double farthest = std::max(up * up, (up - length) * (up - length));
    steps.fill(count(longest_step(std::max(std::sqrt(farthest + forward * forward), 1e-3), 1.0)));
    return steps;
  }
  double t = length, before = longest_step_at(width, path, t);
  for (int& each : steps) {
    t -= part;
    const double after = longest_step_at(width, path, t);
    each = count(std::min(before, after));
    before = after;
  }
  return steps;
}

using Segments = std::array<BySegment, SheetProblem::kStates>;

/// Steps of a sheet of uniform width end at equal shares of the length. Steps of other sheets also end at the ends of
/// pieces of the width. The kernels take the same number of steps in all segments. A segment with fewer steps ends with
/// steps of zero length.
class SheetSchedule {
 public:
  SheetSchedule(const SheetWidth& width, const SheetProblem::Path& path) : width_(width), length_(path.values[2]) {
    const auto steps = steps_of(width, path);
    for (int k = 0; k < SheetProblem::kSegments; ++k) {
      width.even() ? add_even(k, steps[at(k)]) : add(k, steps[at(k)]);
      for (std::size_t j = 0; j < start_.size(); ++j) start_[j][k] = path.nodes[at(k)][j];
    }
    segments_ = {path.values[0], path.values[1], length_,       0.0,          0.0,
                 width.even(),   count(),        steps_.data(), start_.data()};
    if (width.even()) return;
    segments_.weight = width.weight_at(length_);
    segments_.weight_by_length = width.width_at(length_);
  }
  SheetSchedule(const SheetSchedule&) = delete;
  SheetSchedule& operator=(const SheetSchedule&) = delete;

  const SheetSegments& segments() const { return segments_; }
  int count() const { return static_cast<int>(steps_.size()); }
  int count(int segment) const { return counts_[at(segment)]; }
  double start(int segment, int i) const {
    const SheetStep& step = steps_[at(i)];
    return step.s[segment] + step.s_by_length[segment] * length_;
  }
  double step(int segment, int i) const {
    const SheetStep& step = steps_[at(i)];
    return step.h[segment] + step.h_by_length[segment] * length_;
  }
  SheetSlope<double, double> slope(int segment, int i) const {
    const SheetStep& step = steps_[at(i)];
    return {segments_.up,
            segments_.forward,
            length_,
            segments_.even,
            {step.begin[segment], step.width[segment], step.slope[segment], step.weight[segment]},
            segments_.weight};
  }

 private:
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }

  SheetStep& next_step(int segment) {
    const auto i = at(counts_[at(segment)]++);
    if (i == steps_.size()) {
      steps_.push_back({});
      std::fill_n(steps_.back().width, SheetProblem::kSegments, 1.0);
    }
    return steps_[i];
  }
  void add_even(int segment, int steps) {
    const double share = 1.0 / (SheetProblem::kSegments * steps);
    for (int i = 0; i < steps; ++i) {
      SheetStep& step = next_step(segment);
      step.s_by_length[segment] = (segment * steps + i) * share;
      step.h_by_length[segment] = share;
    }
  }
  void add(int segment, int steps) {
    constexpr double kPart = 1.0 / SheetProblem::kSegments;
    double from = 0, from_by_length = kPart * segment;
    const double end = kPart * (segment + 1);
    std::size_t i = width_.piece_before(length_ - from_by_length * length_);
    for (bool last = false; !last; --i) {
      const SheetWidth::Piece& piece = width_.pieces()[i];
      last = i == 0 || piece.begin <= length_ - end * length_;
      const double to = last ? 0.0 : -piece.begin, to_by_length = last ? end : 1.0;
      const double way = to - from + (to_by_length - from_by_length) * length_;
      const double part = std::ceil(steps * std::abs(way) / (kPart * length_) - 1e-9);
      const double count = std::clamp(part, 1.0, static_cast<double>(steps));
      const double h = (to - from) / count, h_by_length = (to_by_length - from_by_length) / count;
      for (double j = 0; j < count; ++j) {
        SheetStep& step = next_step(segment);
        step.s[segment] = from + j * h;
        step.s_by_length[segment] = from_by_length + j * h_by_length;
        step.h[segment] = h;
        step.h_by_length[segment] = h_by_length;
        step.begin[segment] = piece.begin;
        step.width[segment] = piece.width;
        step.slope[segment] = piece.slope;
        step.weight[segment] = piece.weight;
      }
      from = to;
      from_by_length = to_by_length;
    }
  }

  const SheetWidth& width_;
  double length_;
  std::vector<SheetStep> steps_;
  std::array<int, SheetProblem::kSegments> counts_{};
  Segments start_{};
  SheetSegments segments_{};
};

/// States after each step, four rows a step.
std::vector<Segments> advanced(const SheetSchedule& schedule) {
  std::vector<Segments> states(static_cast<std::size_t>(schedule.count()));
  sheet_kernels().advance(schedule.segments(), states.data()->data());
  return states;
}

}  // namespace

void set_nodes(const SheetShape& shape, SheetProblem::Path& path) {
  path.nodes.assign(SheetProblem::kSegments + 1, {});
  const SheetSchedule schedule(shape.width, path);
  for (int k = 0; k < SheetProblem::kSegments; ++k) {
    const auto segment = static_cast<std::size_t>(k);
    std::array<double, 4> y = path.nodes[segment];
    for (int i = 0; i < schedule.count(k); ++i)
      runge_kutta_step<2>(schedule.slope(k, i), schedule.start(k, i), schedule.step(k, i), y);
    path.nodes[segment + 1] = y;
  }
}

void SheetProblem::linearise(const Path& path, System& system) const {
  const SheetSchedule schedule(shape.width, path);
  BySegment ends[kStates][1 + kSheetUnknowns];
  sheet_kernels().linearise(schedule.segments(), ends);
  system.links.resize(kSegments);
  for (int k = 0; k < kSegments; ++k) {
    System::Link& link = system.links[static_cast<std::size_t>(k)];
    for (int i = 0; i < kStates; ++i) {
      link.by_state[i][0] = ends[i][1][k];
      link.by_state[i][1] = ends[i][2][k];
      link.by_state[i][2] = i == 2 ? 1.0 : 0.0;
      link.by_state[i][3] = i == 3 ? 1.0 : 0.0;
      for (int j = 0; j < kParameters; ++j) link.by_parameters[i][j] = ends[i][3 + j][k];
      link.gap[i] = ends[i][0][k] - path.nodes[static_cast<std::size_t>(k) + 1][static_cast<std::size_t>(i)];
    }
  }
  put_end(path, system);
}

void SheetProblem::put_gaps(const Path& path, System& system) const {
  const Segments ends = advanced(SheetSchedule(shape.width, path)).back();
  for (std::size_t k = 0; k < kSegments; ++k)
    for (std::size_t i = 0; i < kStates; ++i) system.links[k].gap[i] = ends[i][k] - path.nodes[k + 1][i];
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

/// Function with a zero at an extreme, and its slope along s.
struct Sign {
  double value, slope;
};

/// Values for extremes of the slope of the curvature, 2 b theta''; of the curvature; and of the climb Z'.
std::array<Sign, 3> signs_at(const SheetSlope<double, double>& slope, double s, const std::array<double, 4>& y) {
  const auto [curvature, by_moment, along, climb] = slope(s, y);
  double width = 1, widening = 0, before = s;
  if (!slope.even) {
    const double t = slope.length - s;
    width = slope.piece.width_at(t);
    widening = slope.piece.slope;
    before = slope.weight - slope.piece.weight_at(t);
  }
  const double bends = by_moment + 2.0 * widening * curvature, by_s = bends / (2.0 * width);
  const double turned = (slope.up - before) * climb + slope.forward * along;
  return {Sign{bends, -width * along - turned * curvature + 2.0 * widening * by_s}, Sign{curvature, by_s},
          Sign{y[3] == 0 ? 0.0 : climb, along * curvature}};
}

/// Zero of the cubic with such values and slopes at both ends of a step of 1, by false position with the value
/// of an end that stays halved [Dowell and Jarratt 1971].
double zero_between(const Sign& from, const Sign& to, double step) {
  double low = 0, high = 1, at_low = from.value, at_high = to.value, place = 0;
  int side = 0;
  for (int i = 0; i < 30; ++i) {
    const double last = place;
    place = (low * at_high - high * at_low) / (at_high - at_low);
    if (i > 0 && std::abs(place - last) < 1e-6) break;
    const double u = place, v = 1 - place;
    const double value = from.value * v * v * (1 + 2 * u) + to.value * u * u * (1 + 2 * v) +
                         step * u * v * (from.slope * v - to.slope * u);
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
  return place;
}

/// Moves to the zero of a sign within a step from s to s + h: by a cubic, and then by a step of Newton's method. The
/// requested quantity has an extremum there, so that an error of 1e-5 of the step changes it by only 1e-10.
void move_to_extreme(const SheetSlope<double, double>& slope, double& s, double h, std::array<double, 4>& y,
                     std::size_t which, const Sign& from, const Sign& to) {
  const double place = h * zero_between(from, to, h);
  runge_kutta_step<2>(slope, s, place, y);
  s += place;
  const Sign sign = signs_at(slope, s, y)[which];
  const double rest = sign.slope == 0 ? 0.0 : std::clamp(-sign.value / sign.slope, -place, h - place);
  auto middle = y;  // the midpoint rule: the rest is short
  const auto at_start = slope(s, y);
  for (std::size_t i = 0; i < y.size(); ++i) middle[i] += 0.5 * rest * at_start[i];
  const auto halfway = slope(s + 0.5 * rest, middle);
  for (std::size_t i = 0; i < y.size(); ++i) y[i] += rest * halfway[i];
  s += rest;
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
  const SheetSchedule schedule(shape.width, path);
  const std::vector<Segments> states = advanced(schedule);
  for (int k = 0; k < SheetProblem::kSegments; ++k) {
    std::array<double, 4> start = path.nodes[static_cast<std::size_t>(k)];
    for (int i = 0; i < schedule.count(k); ++i) {
      const auto slope = schedule.slope(k, i);
      const double s = schedule.start(k, i), h = schedule.step(k, i);
      std::array<double, 4> end{};
      for (std::size_t j = 0; j < end.size(); ++j) end[j] = states[static_cast<std::size_t>(i)][j][k];
      const auto before = signs_at(slope, s, start), after = signs_at(slope, s + h, end);
      see(after[1].value, end);
      for (std::size_t j = 0; j < after.size(); ++j) {
        if (before[j].value * after[j].value >= 0) continue;
        double at = s;
        std::array<double, 4> extreme = start;
        move_to_extreme(slope, at, h, extreme, j, before[j], after[j]);
        see(slope(at, extreme)[0], extreme);
      }
      start = end;
    }
  }
  return found;
}

}  // namespace withe
