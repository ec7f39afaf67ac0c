#include "elastica/rod_grasp.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "elastica/rod_stability.hpp"

namespace withe {

namespace {

using Path = GraspProblem::Path;
constexpr std::size_t kRows = 22, kColumns = 48, kRowSegments = 12;
constexpr double kTableStiffness = 2 * 2087.0;
constexpr double kLongestElement = 0.12;
constexpr double kForceStep = 0.25, kAngleStep = 0.3;
constexpr double kBelowFloor = 1e-6;  ///< [Lgb]

std::vector<double> row_cuts(double length) {
  std::vector<double> cuts(kRowSegments + 1);
  for (std::size_t k = 0; k <= kRowSegments; ++k)
    cuts[k] = length * static_cast<double>(k) / static_cast<double>(kRowSegments);
  return cuts;
}

/// A rod lifted a little by its tip: theta = (length s^2 / 2 - s^3 / 3) / 4, up to 1.5.
Path gentle_lift(const std::vector<double>& cuts) {
  const double length = std::min(cuts.back(), 3.0);
  Path path;
  path.values = {0.0, length / 2};
  for (double s : cuts) {
    const double u = std::min(s, length), angle = std::min(1.5, u * u * (length / 8 - u / 12));
    path.nodes.push_back({std::cos(angle), 0, std::sin(angle), 0, cuts.back() < 1.5 ? -u * (length - u) / 2 : 0.0, 0});
  }
  path.nodes[0] = {1, 0, 0, 0, 0, 0};
  return path;
}

/// Curvature enters as the moment at lift-off.
void set_curvature(double curvature, Path& path) { path.nodes[0][5] = -2.0 * curvature; }

/// At the plane of x and z.
void mirror(Path& path) {
  path.values[0] = -path.values[0];
  for (auto& y : path.nodes) {
    y[1] = -y[1];
    y[3] = -y[3];
    y[5] = -y[5];
  }
}

/// Further by an angle about its own first axis.
Quaternion rolled(const Quaternion& q, double angle) {
  return product(q, {std::cos(0.5 * angle), std::sin(0.5 * angle), 0, 0});
}

}  // namespace

GraspTable::GraspTable() {
  const double first = 0.8 * kShortest;
  for (std::size_t i = 0; i < kRows; ++i)
    lengths_.push_back(first * std::pow(kLongestRow / first, static_cast<double>(i) / (kRows - 1)));
  for (std::size_t j = 0; j <= kColumns; ++j)
    curvatures_.push_back(kGreatestCurvature * static_cast<double>(j) / static_cast<double>(kColumns));
  ShootingSolver<GraspProblem> solver;
  GraspProblem problem;
  problem.stretch_stiffness = kTableStiffness;
  for (double length : lengths_) {
    problem.cuts = row_cuts(length);
    Path path = gentle_lift(problem.cuts), trial;
    solver.solve(problem, path, {.iterations = 60});
    for (double curvature : curvatures_) {
      const double before = -0.5 * path.nodes[0][5];
      follow(solver, problem, 1e-3, path, trial,
             [&](double share, Path& guess) { set_curvature(before + share * (curvature - before), guess); });
      nodes_.push_back(path);
    }
  }
}

void GraspTable::guess(double suspended, double curvature, const std::vector<double>& cuts, Path& path) const {
  const auto cell = [](const std::vector<double>& grid, double at) {
    const auto after = std::upper_bound(grid.begin() + 1, grid.end() - 1, at);
    return static_cast<std::size_t>(after - grid.begin()) - 1;
  };
  const double length = std::min(suspended, lengths_.back());
  const std::size_t row = cell(lengths_, length), column = cell(curvatures_, curvature);
  const double along_row = (length - lengths_[row]) / (lengths_[row + 1] - lengths_[row]);
  const double along_column = (curvature - curvatures_[column]) / (curvatures_[column + 1] - curvatures_[column]);
  // The table's path at this length and curvature, with cuts evenly along it.
  Path mixed;
  mixed.nodes.assign(kRowSegments + 1, {});
  mixed.values.fill(0.0);
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t j = 0; j < 2; ++j) {
      const double share = (i ? along_row : 1 - along_row) * (j ? along_column : 1 - along_column);
      const Path& from = nodes_[(row + i) * curvatures_.size() + column + j];
      for (std::size_t k = 0; k < mixed.nodes.size(); ++k)
        for (std::size_t c = 0; c < 6; ++c) mixed.nodes[k][c] += share * from.nodes[k][c];
      for (std::size_t c = 0; c < 2; ++c) mixed.values[c] += share * from.values[c];
    }
  }
  path.values = mixed.values;
  path.nodes.resize(cuts.size());
  const bool is_long = suspended > lengths_.back();
  const double segment = length / static_cast<double>(kRowSegments);
  for (std::size_t k = 0; k < cuts.size(); ++k) {
    const double s = cuts[k];
    if (is_long && s > length - segment) {  // pulled so hard that the tangent follows the force
      const double across = -mixed.values[0], up = s - mixed.values[1], force = std::sqrt(across * across + up * up);
      path.nodes[k] = {0, across / force, up / force, 2 * across / (force * force), 0, 0};
      continue;
    }
    const double place = s / segment;
    const std::size_t at = std::min(static_cast<std::size_t>(place), kRowSegments - 1);
    const double u = place - static_cast<double>(at);
    for (std::size_t c = 0; c < 6; ++c) path.nodes[k][c] = (1 - u) * mixed.nodes[at][c] + u * mixed.nodes[at + 1][c];
  }
  path.nodes[0] = {1, 0, 0, 0, 0, 0};
  set_curvature(curvature, path);
}

bool GraspTable::solve(const GraspQuestion& asked, const std::vector<double>& cuts, Data& data) const {
  GraspProblem& problem = data.problem;
  problem.stretch_stiffness = asked.stretch_stiffness;
  problem.given_force = 0;
  problem.lever = asked.lever;
  problem.behind = asked.lever * std::sqrt(kRodBendStiffness / asked.twist_stiffness);
  problem.cuts = cuts;
  guess(asked.suspended, std::abs(asked.curvature), problem.cuts, data.path);
  const ShootingOutcome outcome = data.solver.solve(problem, data.path);
  data.iterations = outcome.iterations;
  if (!outcome.converged) return false;
  // In steps so small that a solution is not left for another one.
  const auto change = [&](double whole, double step, const auto& set) {
    const int parts = static_cast<int>(std::ceil(std::abs(whole) / step));
    for (int i = 0; i < parts; ++i) {
      const auto ask = [&](double share, Path& at) { set(whole * (i + share) / parts, at); };
      if (!follow(data.solver, problem, 0.05, data.path, data.trial, ask)) return false;
    }
    return true;
  };
  if (!change(asked.axial_force, kForceStep, [&](double force, Path& /*at*/) { problem.given_force = force; }))
    return false;
  if (!change(asked.base_angle, kAngleStep,
              [](double angle, Path& at) { at.nodes[0] = {std::cos(angle), 0, std::sin(angle), 0, 0, 0}; }))
    return false;
  if (asked.curvature < 0) mirror(data.path);
  return true;
}

RodGrasp GraspTable::grasp(const GraspQuestion& asked, Data& data) const {
  RodGrasp found;
  found.solved = solve(asked, data);
  if (!found.solved) return found;
  const double segment = data.problem.cuts[1];
  const RodShape shape = rod_shape(data.problem, data.path, static_cast<int>(std::ceil(segment / kLongestElement)));
  found.tip = shape.points.back();
  found.tip.rotation = rolled(found.tip.rotation, shape.twist * shape.suspended / asked.twist_stiffness);
  found.floor_force = shape.floor_force;
  found.residual = shape.residual;
  found.solved = shape.lowest > -kBelowFloor && (asked.base_angle != 0 || shape.floor_force[2] > 0);
  found.stable = rod_is_stable(shape, asked.twist_stiffness);
  return found;
}

}  // namespace withe
