#include "elastica/sheet_manifold.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/interpolation.hpp"

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

double mean_width(const SheetWidth& width, double length) {
  return width.even() ? 1.0 : width.weight_at(length) / length;
}

/// A pull bends a narrow part of a sheet more sharply.
bool bearable(const SheetWidth& width, const Path& path) {
  const double narrow = std::min(width.width_at(0.0), width.width_at(path.values[2]));
  return path.values[1] > -SheetManifold::kGreatestPull * narrow && path.values[0] > 0;
}

/// Variables that remain smooth for short lengths, where gravity has no effect. Forces are divided by the mean width.
void add_scaled(double share, double width, const Path& from, Path& sum) {
  const double length = from.values[2];
  for (std::size_t k = 0; k < from.nodes.size(); ++k) {
    const auto& y = from.nodes[k];
    auto& to = sum.nodes[k];
    to[0] += share * y[0];
    to[1] += share * y[1] * length / width;
    to[2] += share * y[2] / length;
    to[3] += share * y[3] / length;
  }
  sum.values[0] += share * from.values[0] * length * length / width;
  sum.values[1] += share * from.values[1] * length * length / width;
  sum.values[2] += share * length;
}

}  // namespace

SheetManifold::SheetManifold(const SheetWidth& width) : width_(width) {
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

/// Lifted without tangential force; an uneven sheet by making an even one of the same mean width more and more so.
std::optional<Path> SheetManifold::first_path(double length, ShootingSolver<SheetProblem>& solver) const {
  Path path = gentle_lift(length), trial;
  SheetProblem problem;
  problem.target = TipTarget::length_and_angle;
  problem.goal = {length, tip_angle(path)};
  if (!solver.solve(problem, path).converged) return {};
  if (width_.even()) return path;
  const double mean = mean_width(width_, length);
  const bool there = follow(solver, problem, 1e-3, path, trial, [&](double share, Path& /*guess*/) {
    problem.shape.width = width_.blended(share, 1 / mean);
  });
  if (!there) return {};
  path.values = {path.values[0] * mean, path.values[1] * mean, path.values[2]};
  for (auto& y : path.nodes) y[1] *= mean;
  return path;
}

void SheetManifold::fill_row(std::size_t row, ShootingSolver<SheetProblem>& solver) {
  SheetProblem problem;
  problem.shape.width = width_;
  const double length = lengths_[row];
  const std::optional<Path> lifted = first_path(length, solver);
  if (!lifted) return;
  Path path = *lifted;
  const Path middle = path;
  problem.target = TipTarget::length_and_direction;
  problem.goal = {length, std::atan2(tip_back(path), tip_up(path))};
  const auto goal = problem.goal;
  const auto first = static_cast<std::size_t>(std::lower_bound(directions_.begin(), directions_.end() - 1, goal[1]) -
                                              directions_.begin());
  const auto fill = [&](std::size_t j, Path& now) {
    if (!follow_goal(solver, problem, {length, directions_[j]}, now) || !bearable(width_, now)) return false;
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
  problem.shape.width = width_;
  problem.target = TipTarget::length_and_direction;
  const auto fill = [&](std::size_t i, Path& now) {
    if (!follow_goal(solver, problem, {lengths_[i], directions_[column]}, now) || !bearable(width_, now)) return false;
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

namespace {

double reach_of(const Path& path) {
  const double x = tip_back(path), z = tip_up(path);
  return std::sqrt(x * x + z * z);
}

template <std::size_t most>
bool is_monotonic(const std::array<double, most>& values, std::size_t count) {
  const bool grows = values[1] > values[0];
  for (std::size_t i = 1; i < count; ++i)
    if (values[i] == values[i - 1] || (values[i] > values[i - 1]) != grows) return false;
  return true;
}

}  // namespace

std::optional<SheetManifold::Cell> SheetManifold::find_position(double direction, double distance) const {
  if (direction < directions_.front()) return {};
  const auto after = std::upper_bound(directions_.begin() + 1, directions_.end() - 1, direction);
  const auto j = static_cast<std::size_t>(after - directions_.begin()) - 1;
  const double along = (direction - directions_[j]) / (directions_[j + 1] - directions_[j]);
  std::size_t low = std::max(first_row_[j], first_row_[j + 1]), high = std::min(last_row_[j], last_row_[j + 1]);
  if (low >= high) return {};
  const auto reach = [&](std::size_t row) {
    return (1 - along) * reach_of(node(row, j)) + along * reach_of(node(row, j + 1));
  };
  if (distance < reach(low) || distance > reach(high)) return {};
  while (high - low > 1) {
    const std::size_t middle = (low + high) / 2;
    (reach(middle) <= distance ? low : high) = middle;
  }
  return Cell{low, j};
}

std::optional<SheetManifold::Cell> SheetManifold::find_angle(double length, double angle) const {
  if (!(length >= lengths_.front() && length <= lengths_.back())) return {};
  const auto after = std::upper_bound(lengths_.begin() + 1, lengths_.end() - 1, length);
  const auto i = static_cast<std::size_t>(after - lengths_.begin()) - 1;
  const double along = (length - lengths_[i]) / (lengths_[i + 1] - lengths_[i]);
  const auto there = [&](std::size_t j) { return first_row_[j] <= i && i + 1 <= last_row_[j]; };
  const auto angle_at = [&](std::size_t j) {
    return (1 - along) * tip_angle(node(i, j)) + along * tip_angle(node(i + 1, j));
  };
  for (std::size_t j = 0; j + 1 < directions_.size(); ++j) {
    if (!there(j) || !there(j + 1)) continue;
    if ((angle_at(j) - angle) * (angle_at(j + 1) - angle) <= 0) return Cell{i, j};
  }
  return {};
}

SheetManifold::Patch SheetManifold::patch_around(const Cell& cell) const {
  const std::size_t column = std::clamp<std::size_t>(cell.column, 1, directions_.size() - kPoints + 1) - 1;
  std::size_t low = 0, high = lengths_.size() - 1;
  for (std::size_t j = column; j < column + kPoints; ++j) {
    low = std::max(low, first_row_[j]);
    high = std::min(high, last_row_[j]);
  }
  if (low > cell.row || high < std::max(cell.row + 1, low + kPoints - 1)) return {cell, 2, {}, {}};
  const std::size_t row = std::clamp(std::max<std::size_t>(cell.row, 1) - 1, low, high - kPoints + 1);
  return {{row, column}, kPoints, {}, {}};
}

SheetManifold::Patch SheetManifold::patch_at_position(const Cell& cell, double direction, double distance) const {
  Patch patch = patch_around(cell);
  Weights places{}, reaches{};
  for (std::size_t j = 0; j < patch.points; ++j) places[j] = directions_[patch.first.column + j];
  patch.columns = lagrange_weights(places, patch.points, direction);
  // Everything is smooth in the distance, too, along a direction.
  for (std::size_t i = 0; i < patch.points; ++i)
    for (std::size_t j = 0; j < patch.points; ++j)
      reaches[i] += patch.columns[j] * reach_of(node(patch.first.row + i, patch.first.column + j));
  patch.rows = lagrange_weights(reaches, patch.points, distance);
  return patch;
}

SheetManifold::Patch SheetManifold::patch_at_angle(const Cell& cell, double length, double angle) const {
  const auto weigh = [&](Patch& patch) {
    Weights places{}, angles{};
    for (std::size_t i = 0; i < patch.points; ++i) places[i] = lengths_[patch.first.row + i];
    patch.rows = lagrange_weights(places, patch.points, length);
    for (std::size_t j = 0; j < patch.points; ++j)
      for (std::size_t i = 0; i < patch.points; ++i)
        angles[j] += patch.rows[i] * tip_angle(node(patch.first.row + i, patch.first.column + j));
    patch.columns = lagrange_weights(angles, patch.points, angle);
    return is_monotonic(angles, patch.points);
  };
  Patch patch = patch_around(cell);
  if (weigh(patch)) return patch;
  patch = {cell, 2, {}, {}};  // near the greatest angle of a length, past which it falls again
  weigh(patch);
  return patch;
}

void SheetManifold::interpolate(const Patch& patch, Path& path) const {
  path.nodes.resize(SheetProblem::kSegments + 1);
  for (auto& y : path.nodes) y.fill(0.0);
  path.values.fill(0.0);
  for (std::size_t i = 0; i < patch.points; ++i)
    for (std::size_t j = 0; j < patch.points; ++j)
      add_scaled(patch.rows[i] * patch.columns[j], mean_width(width_, lengths_[patch.first.row + i]),
                 node(patch.first.row + i, patch.first.column + j), path);
  const double length = path.values[2], width = mean_width(width_, length);
  for (auto& y : path.nodes) y = {y[0], y[1] * width / length, y[2] * length, y[3] * length};
  path.values[0] *= width / (length * length);
  path.values[1] *= width / (length * length);
}

/// Solves without moment at the tip, and continues from there to the requested moment.
bool SheetManifold::solve(double tip_moment, Data& data) const {
  SheetProblem& problem = data.problem;
  problem.shape = {width_, 0.0};
  if (!data.solver.solve(problem, data.path).converged) return false;
  if (tip_moment == 0) return true;
  return follow(data.solver, problem, 1.0 / 512, data.path, data.trial,
                [&](double share, SheetProblem::Path& /*guess*/) { problem.shape.tip_moment = share * tip_moment; });
}

SheetSolution SheetManifold::at_position(double x, double z, double tip_moment, Data& data) const {
  if (!(x >= 0 && z >= 0 && x + z > 0)) return {};
  const double direction = std::atan2(x, z), distance = std::sqrt(x * x + z * z);
  const auto cell = find_position(direction, distance);
  if (!cell) return {};
  interpolate(patch_at_position(*cell, direction, distance), data.path);
  data.problem.target = TipTarget::position;
  data.problem.goal = {x, z};
  if (!solve(tip_moment, data)) return {};
  SheetSolution found = describe_sheet(data.problem.shape, data.path);
  found.valid = found.valid && found.suspended > kShortest && found.suspended < kLongest;
  return found;
}

SheetSolution SheetManifold::at_length_and_angle(double length, double angle, double tip_moment, Data& data) const {
  const auto cell = find_angle(length, angle);
  if (!cell) return {};
  interpolate(patch_at_angle(*cell, length, angle), data.path);
  data.problem.target = TipTarget::length_and_angle;
  data.problem.goal = {length, angle};
  return solve(tip_moment, data) ? describe_sheet(data.problem.shape, data.path) : SheetSolution{};
}

}  // namespace withe
