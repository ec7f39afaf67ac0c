#include "elastica/rod_straight.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "common/hypotenuse.hpp"
#include "elastica/rod_grasp.hpp"
#include "elastica/runge_kutta.hpp"

namespace withe {

namespace {

using Path = HeldProblem::Path;
constexpr double kFoldedForce = 4.913426;  ///< force of the floor on a long folded rod that does not stretch [w Lgb]
constexpr double kFoldedSolved = 9.0;      ///< length at which that is nearly so
constexpr double kBelowFloor = 1e-6, kLongestMove = 0.4, kLongestElement = 0.12;

std::vector<double> scaled(const std::vector<double>& cuts, double factor) {
  std::vector<double> result = cuts;
  for (double& s : result) s *= factor;
  return result;
}

/// A folded rod of kFoldedSolved: thrown from the floor until it hangs upright, and upright from there on.
GraspProblem::Path thrown(const std::vector<double>& cuts) {
  GraspProblem::Path path;
  path.values = {0.0, kFoldedForce};
  std::array<double, 2> y{};  // angle and its slope
  const auto slope = [](double s, const std::array<double, 2>& at) {
    return std::array<double, 2>{at[1], 0.5 * (kFoldedForce - s) * std::cos(at[0])};
  };
  bool turned = false, upright = false;
  for (std::size_t k = 0; k < cuts.size(); ++k) {
    path.nodes.push_back({std::cos(y[0]), 0, std::sin(y[0]), 0, -2 * y[1], 0});
    for (int i = 0; i < 6 && k + 1 < cuts.size() && !upright; ++i) {
      const double h = (cuts[k + 1] - cuts[k]) / 6;
      runge_kutta_step<2>(slope, cuts[k] + i * h, h, y);
      turned = turned || y[1] < 0;
      upright = turned && y[0] < 1.6;
    }
    if (upright) y = {1.5708, 0.0};
  }
  return path;
}

/// With the positions at the cuts.
Path with_positions(const GraspProblem& problem, const GraspProblem::Path& path) {
  const RodShape shape = rod_shape(problem, path, 1);
  Path found;
  found.values = {0.0, path.values[1]};
  for (std::size_t k = 0; k < shape.points.size(); ++k) {
    const auto& y = path.nodes[k];
    const RodVector& r = shape.points[k].position;
    found.nodes.push_back({y[0], y[1], y[2], y[3], y[4], y[5], r[0], r[1], r[2]});
  }
  return found;
}

}  // namespace

StraightRod::StraightRod(double suspended, double stretch_stiffness) {
  problem_.stretch_stiffness = stretch_stiffness;
  const double first = std::max(suspended, kFoldedSolved);
  problem_.cuts = scaled(rod_cuts(first), suspended / first);
  static const GraspTable table;
  GraspTable::Data data;
  table.solve({suspended, 0.0, stretch_stiffness}, problem_.cuts, data);
  gentle_ = with_positions(data.problem, data.path);
  // The folded one at another length, then in small steps to this one; a long one has the same beginning.
  GraspProblem& problem = data.problem;
  problem.cuts = rod_cuts(first);
  GraspProblem::Path path = thrown(problem.cuts), trial;
  if (!data.solver.solve(problem, path, {.iterations = 60}).converged) return;
  const int parts = static_cast<int>(std::ceil((first - suspended) / 0.25));
  for (int i = 1; i <= parts; ++i) {
    const double from = problem.cuts.back(), to = first + (suspended - first) * i / parts;
    if (!follow(data.solver, problem, 0.05, path, trial, [&](double share, GraspProblem::Path& /*at*/) {
          problem.cuts = scaled(problem_.cuts, (from + share * (to - from)) / suspended);
        }))
      return;
  }
  problem.cuts = problem_.cuts;
  const Path folded = with_positions(problem, path);
  if (allowed(problem_, folded)) folded_ = folded;
}

RodShape StraightRod::shape(const Path& path) const {
  const double segment = problem_.cuts[1];
  HeldProblem problem = problem_;
  problem.goal = {path.nodes.back()[6], path.nodes.back()[8]};
  return rod_shape(problem, path, static_cast<int>(std::ceil(segment / kLongestElement)));
}

bool StraightRod::allowed(const HeldProblem& problem, const Path& path) const {
  return path.values[1] >= 0 && rod_shape(problem, path, 5).lowest > -kBelowFloor;
}

bool StraightRod::follow_to(double x, double z, Path& path, HeldProblem& problem) const {
  ShootingSolver<HeldProblem> solver;
  Path trial;
  const double from_x = path.nodes.back()[6], from_z = path.nodes.back()[8];
  const double way = hypotenuse(x - from_x, z - from_z);
  const int parts = std::max(1, static_cast<int>(std::ceil(way / kLongestMove)));
  for (int i = 0; i < parts; ++i) {
    if (!follow(solver, problem, 0.3, path, trial, [&](double share, Path& /*at*/) {
          const double done = (i + share) / parts;
          problem.goal = {from_x + done * (x - from_x), from_z + done * (z - from_z)};
        }))
      return false;
  }
  return true;
}

std::optional<RodShape> StraightRod::at_position(double x, double z) const {
  const auto way = [&](const Path& path) { return hypotenuse(x - path.nodes.back()[6], z - path.nodes.back()[8]); };
  Path path = folded_ && way(*folded_) < way(gentle_) ? *folded_ : gentle_;
  HeldProblem problem = problem_;
  if (!follow_to(x, z, path, problem) || !allowed(problem, path)) return std::nullopt;
  return shape(path);
}

/// Allowed distance along a ray, from an allowed position.
double StraightRod::extent(HeldProblem problem, Path path, double angle, double outwards) const {
  const double c = std::cos(angle), d = std::sin(angle), length = problem_.cuts.back();
  double inside = hypotenuse(path.nodes.back()[6], path.nodes.back()[8]);
  double step = 0.16 * length;
  while (step > 5e-4 * length) {
    const double next = inside + outwards * step;
    Path moved = path;
    HeldProblem trial = problem;
    if (next > 0 && follow_to(next * c, next * d, moved, trial) && allowed(trial, moved)) {
      path = moved;
      problem = trial;
      inside = next;
    } else {
      step /= 2;
    }
  }
  return inside;
}

std::vector<std::array<double, 4>> StraightRod::outline(double angle_step) const {
  std::vector<std::array<double, 4>> rows[2];
  const double start = std::atan2(gentle_.nodes.back()[8], gentle_.nodes.back()[6]);
  for (int side = 0; side < 2; ++side) {
    Path path = gentle_;
    HeldProblem problem = problem_;
    double angle = start;
    while (true) {
      const double near = extent(problem, path, angle, -1.0), far = extent(problem, path, angle, 1.0);
      rows[side].push_back(
          {near * std::cos(angle), near * std::sin(angle), far * std::cos(angle), far * std::sin(angle)});
      const double next = angle + (side == 0 ? -angle_step : angle_step);
      const auto enter = [&](double share) {
        const double at = near + share * (far - near);
        Path moved = path;
        HeldProblem trial = problem;
        if (!follow_to(at * std::cos(angle), at * std::sin(angle), moved, trial)) return false;
        if (!follow_to(at * std::cos(next), at * std::sin(next), moved, trial) || !allowed(trial, moved)) return false;
        path = moved;
        problem = trial;
        return true;
      };
      const double shares[] = {0.5, 0.8, 0.2, 0.95, 0.05};
      if (next <= 0 || std::none_of(std::begin(shares), std::end(shares), enter)) break;
      angle = next;
    }
  }
  std::vector<std::array<double, 4>> all(rows[0].rbegin(), rows[0].rend());
  all.insert(all.end(), rows[1].begin() + 1, rows[1].end());
  return all;
}

}  // namespace withe
