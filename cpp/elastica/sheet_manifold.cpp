#include "elastica/sheet_manifold.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace withe {

namespace {

using Path = SheetProblem::Path;
constexpr std::size_t kColumns = 72, kShortRows = 12, kLongRows = 48;
constexpr double kFirstLongRow = 0.9, kLastRow = 6.9;

/// A strip lifted a little by its tip, without tangential force: theta = (length s^2 / 2 - s^3 / 3) / 4.
Path gentle_lift(double length) {
  Path path;
  path.values = {length / 2, 0.0, length};
  for (int k = 0; k <= SheetProblem::kSegments; ++k) {
    const double s = length * k / SheetProblem::kSegments;
    path.nodes.push_back({s * s * (length / 8 - s / 12), s * (length - s) / 2, s, s * s * s * (length / 24 - s / 48)});
  }
  return path;
}

bool follow_goal(ShootingSolver<SheetProblem>& solver, SheetProblem& problem, const std::array<double, 3>& goal,
                 Path& path) {
  const std::array<double, 3> start = problem.goal;
  Path trial;
  return follow(solver, problem, 1e-3, path, trial, [&](double share, Path& guess) {
    for (std::size_t i = 0; i < 3; ++i) problem.goal[i] = start[i] + share * (goal[i] - start[i]);
    guess.values[2] = problem.goal[0];  // a guess has the segments of the old length
  });
}

bool bearable(const Path& path) { return path.values[1] > -SheetManifold::kGreatestPull && path.values[0] > 0; }

/// Numbers that stay smooth towards short lengths, where gravity does nothing.
void add_scaled(double share, const Path& from, Path& sum) {
  const double length = from.values[2];
  for (std::size_t k = 0; k < from.nodes.size(); ++k) {
    const auto& y = from.nodes[k];
    auto& to = sum.nodes[k];
    to[0] += share * y[0];
    to[1] += share * y[1] * length;
    to[2] += share * y[2] / length;
    to[3] += share * y[3] / length;
  }
  sum.values[0] += share * from.values[0] * length * length;
  sum.values[1] += share * from.values[1] * length * length;
  sum.values[2] += share * length;
}

}  // namespace

SheetManifold::SheetManifold() {
  for (std::size_t i = 0; i < kShortRows; ++i)
    lengths_.push_back(kShortestRow * std::pow(kFirstLongRow / kShortestRow, static_cast<double>(i) / kShortRows));
  for (std::size_t i = 0; i <= kLongRows; ++i)
    lengths_.push_back(kFirstLongRow + (kLastRow - kFirstLongRow) * static_cast<double>(i) / kLongRows);
  // Finer towards the taut side: x / z is about a third of the angle at the tip.
  for (std::size_t j = 0; j <= kColumns; ++j)
    directions_.push_back(0.5 * std::numbers::pi * std::pow(static_cast<double>(j + 1) / (kColumns + 1), 2));
  nodes_.resize(lengths_.size() * directions_.size());
  first_row_.assign(directions_.size(), 1);
  last_row_.assign(directions_.size(), 0);
  ShootingSolver<SheetProblem> solver;
  const std::size_t middle = kShortRows + 1;
  fill_row(middle, solver);
  for (std::size_t j = 0; j < directions_.size(); ++j) fill_column(j, middle, solver);
}

void SheetManifold::fill_row(std::size_t row, ShootingSolver<SheetProblem>& solver) {
  SheetProblem problem;
  const double length = lengths_[row];
  Path path = gentle_lift(length);
  problem.target = TipTarget::length_and_angle;
  problem.goal = {length, tip_angle(path)};
  if (!solver.solve(problem, path).converged) return;
  const Path middle = path;
  problem.target = TipTarget::length_and_direction;
  problem.goal = {length, std::atan2(tip_back(path), tip_up(path))};
  const auto goal = problem.goal;
  const auto first = static_cast<std::size_t>(std::lower_bound(directions_.begin(), directions_.end() - 1, goal[1]) -
                                              directions_.begin());
  const auto fill = [&](std::size_t j, Path& now) {
    if (!follow_goal(solver, problem, {length, directions_[j]}, now) || !bearable(now)) return false;
    nodes_[row * directions_.size() + j] = now;
    return true;
  };
  for (std::size_t j = first; j < directions_.size() && fill(j, path); ++j) {
  }
  path = middle;
  problem.goal = goal;
  for (std::size_t j = first; j-- > 0 && fill(j, path);) {
  }
}

void SheetManifold::fill_column(std::size_t column, std::size_t start_row, ShootingSolver<SheetProblem>& solver) {
  if (node(start_row, column).nodes.empty()) return;
  SheetProblem problem;
  problem.target = TipTarget::length_and_direction;
  const auto fill = [&](std::size_t i, Path& now) {
    if (!follow_goal(solver, problem, {lengths_[i], directions_[column]}, now) || !bearable(now)) return false;
    nodes_[i * directions_.size() + column] = now;
    return true;
  };
  const auto start_at = [&](Path& now) {
    now = node(start_row, column);
    problem.goal = {lengths_[start_row], directions_[column]};
  };
  Path path;
  first_row_[column] = last_row_[column] = start_row;
  start_at(path);
  for (std::size_t i = start_row; i-- > 0 && fill(i, path);) first_row_[column] = i;
  start_at(path);
  for (std::size_t i = start_row + 1; i < lengths_.size() && fill(i, path); ++i) last_row_[column] = i;
}

bool SheetManifold::find_position(double x, double z, Cell& cell) const {
  if (!(x >= 0 && z >= 0 && x + z > 0)) return false;
  const double direction = std::atan2(x, z), distance = std::sqrt(x * x + z * z);
  if (direction < directions_.front()) return false;
  const auto after = std::upper_bound(directions_.begin() + 1, directions_.end() - 1, direction);
  const auto j = static_cast<std::size_t>(after - directions_.begin()) - 1;
  const double along = (direction - directions_[j]) / (directions_[j + 1] - directions_[j]);
  std::size_t low = std::max(first_row_[j], first_row_[j + 1]), high = std::min(last_row_[j], last_row_[j + 1]);
  if (low >= high) return false;
  const auto reach = [&](std::size_t row) {
    const auto of = [](const Path& path) {
      return std::sqrt(tip_back(path) * tip_back(path) + tip_up(path) * tip_up(path));
    };
    return (1 - along) * of(node(row, j)) + along * of(node(row, j + 1));
  };
  double near = reach(low), far = reach(high);
  if (distance < near || distance > far) return false;
  while (high - low > 1) {
    const std::size_t middle = (low + high) / 2;
    const double there = reach(middle);
    (there <= distance ? low : high) = middle;
    (there <= distance ? near : far) = there;
  }
  cell = {low, j, (distance - near) / (far - near), along};
  return true;
}

bool SheetManifold::find_angle(double length, double angle, Cell& cell) const {
  if (!(length >= lengths_.front() && length <= lengths_.back())) return false;
  const auto after = std::upper_bound(lengths_.begin() + 1, lengths_.end() - 1, length);
  const auto i = static_cast<std::size_t>(after - lengths_.begin()) - 1;
  const double along = (length - lengths_[i]) / (lengths_[i + 1] - lengths_[i]);
  const auto there = [&](std::size_t j) { return first_row_[j] <= i && i + 1 <= last_row_[j]; };
  const auto angle_at = [&](std::size_t j) {
    return (1 - along) * tip_angle(node(i, j)) + along * tip_angle(node(i + 1, j));
  };
  for (std::size_t j = 0; j + 1 < directions_.size(); ++j) {
    if (!there(j) || !there(j + 1)) continue;
    const double before = angle_at(j), behind = angle_at(j + 1);
    if ((before - angle) * (behind - angle) > 0) continue;
    cell = {i, j, along, (angle - before) / (behind - before)};
    return true;
  }
  return false;
}

void SheetManifold::interpolate(const Cell& cell, Path& path) const {
  path.nodes.resize(SheetProblem::kSegments + 1);
  for (auto& y : path.nodes) y.fill(0.0);
  path.values.fill(0.0);
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t j = 0; j < 2; ++j) {
      const double share = (i ? cell.along_row : 1 - cell.along_row) * (j ? cell.along_column : 1 - cell.along_column);
      add_scaled(share, node(cell.row + i, cell.column + j), path);
    }
  }
  const double length = path.values[2];
  for (auto& y : path.nodes) y = {y[0], y[1] / length, y[2] * length, y[3] * length};
  path.values[0] /= length * length;
  path.values[1] /= length * length;
}

namespace {

/// From the uniform sheet without moment to the shape that is asked for, at the same goal.
bool solve_shape(const SheetShape& shape, SheetManifold::Data& data) {
  SheetProblem& problem = data.problem;
  problem.shape = {};
  if (!data.solver.solve(problem, data.path).converged) return false;
  if (shape.width_growth == 0 && shape.tip_moment == 0) return true;
  return follow(data.solver, problem, 1.0 / 512, data.path, data.trial, [&](double share, Path& /*guess*/) {
    problem.shape = {share * shape.width_growth, share * shape.tip_moment};
  });
}

}  // namespace

SheetSolution SheetManifold::at_position(double x, double z, const SheetShape& shape, Data& data) const {
  Cell cell{};
  if (!find_position(x, z, cell)) return {};
  interpolate(cell, data.path);
  data.problem.target = TipTarget::position;
  data.problem.goal = {x, z};
  if (!solve_shape(shape, data)) return {};
  SheetSolution found = describe_sheet(shape, data.path);
  found.valid = found.valid && found.suspended > kShortest && found.suspended < kLongest;
  return found;
}

SheetSolution SheetManifold::at_length_and_angle(double length, double angle, const SheetShape& shape,
                                                 Data& data) const {
  Cell cell{};
  if (!find_angle(length, angle, cell)) return {};
  interpolate(cell, data.path);
  data.problem.target = TipTarget::length_and_angle;
  data.problem.goal = {length, angle};
  return solve_shape(shape, data) ? describe_sheet(shape, data.path) : SheetSolution{};
}

}  // namespace withe
