#include "elastica/rod.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "elastica/rod_kernels.hpp"
#include "elastica/rod_slope.hpp"

namespace withe {

namespace {

constexpr double kLongestSegment = 0.6, kLongestStep = 0.6;
constexpr double kTurnPerStep = 0.7;  ///< [rad]
constexpr double kDecay = 0.6;        ///< share of the decay rate of a bend along a rod in tension

double size_of(double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); }

/// Runge-Kutta steps from a node to the next cut.
template <std::size_t count>
int rod_steps(const RodVector& floor, double from, double to, const std::array<double, count>& y) {
  const double bend = 0.5 * size_of(y[3], y[4], y[5]);
  const auto decay = [&](double s) { return std::sqrt(0.5 * size_of(floor[0], floor[1], s - floor[2])); };
  const double rate = std::max({bend, kDecay * decay(from), kDecay * decay(to), kTurnPerStep / kLongestStep});
  return static_cast<int>(std::clamp(std::ceil((to - from) * rate / kTurnPerStep), 1.0, 40.0));
}

/// The components of F that a path carries as parameters.
template <RodEnd end>
constexpr std::array<std::size_t, 2> unknown_forces() {
  return end == RodEnd::no_moment ? std::array<std::size_t, 2>{1, 2} : std::array<std::size_t, 2>{0, 2};
}
template <RodEnd end>
constexpr std::size_t known_force() {
  return end == RodEnd::no_moment ? 0 : 1;
}

template <RodEnd end>
RodField field_of(const RodProblem<end>& problem, const RodVector& force) {
  const auto [one, other] = unknown_forces<end>();
  return {{force[0], force[1], force[2]},
          1.0 / problem.stretch_stiffness,
          {static_cast<int>(one), static_cast<int>(other)}};
}

/// The block of segments from `first` on. Lanes beyond the last segment repeat the last one.
template <RodEnd end>
RodBlock block_at(const RodProblem<end>& problem, const typename RodProblem<end>::Path& path, const RodVector& force,
                  std::size_t first, int parts) {
  RodBlock block{};
  block.parts = parts;
  for (std::size_t lane = 0; lane < kRodBlock; ++lane) {
    const std::size_t k = std::min(first + lane, problem.cuts.size() - 2);
    const double from = problem.cuts[k], to = problem.cuts[k + 1];
    const int steps = (rod_steps(force, from, to, path.nodes[k]) + parts - 1) / parts;
    block.s[lane] = from;
    block.part[lane] = (to - from) / parts;
    block.steps[lane] = steps;
    block.most_steps = std::max(block.most_steps, steps);
    for (std::size_t j = 0; j < kRodTurning; ++j) block.state[j][lane] = path.nodes[k][j];
  }
  if (first == 0) {
    block.lever[0] = problem.lever;
    block.behind[0] = problem.behind;
  }
  return block;
}

Quaternion unit(const Quaternion& q) {
  const double inverse = 1.0 / std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  return {inverse * q[0], inverse * q[1], inverse * q[2], inverse * q[3]};
}

}  // namespace

Quaternion product(const Quaternion& a, const Quaternion& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

std::vector<double> rod_cuts(double suspended) {
  const auto segments = static_cast<std::size_t>(std::max(4.0, std::ceil(suspended / kLongestSegment - 1e-9)));
  std::vector<double> cuts(segments + 1);
  for (std::size_t k = 0; k <= segments; ++k)
    cuts[k] = suspended * static_cast<double>(k) / static_cast<double>(segments);
  return cuts;
}

template <RodEnd end>
RodVector RodProblem<end>::floor_force(const Path& path) const {
  RodVector force{};
  force[known_force<end>()] = given_force;
  for (std::size_t i = 0; i < kParameters; ++i) force[unknown_forces<end>()[i]] = path.values[i];
  return force;
}

template <RodEnd end>
template <class Put>
void RodProblem<end>::for_blocks(const Path& path, const Put& put) const {
  const RodVector force = floor_force(path);
  const RodField field = field_of(*this, force);
  const std::size_t segments = cuts.size() - 1;
  for (std::size_t first = 0; first < segments; first += kRodBlock) {
    const RodBlock block = block_at(*this, path, force, first, 1);
    put(field, block, first, std::min<std::size_t>(kRodBlock, segments - first));
  }
}

template <RodEnd end>
void RodProblem<end>::linearise(const Path& path, System& system) const {
  const auto kernel = end == RodEnd::no_moment ? rod_kernels().linearise_turn : rod_kernels().linearise_move;
  system.links.resize(cuts.size() - 1);
  for_blocks(path, [&](const RodField& field, const RodBlock& block, std::size_t first, std::size_t count) {
    ByRodSegment ends[kStates][1 + kRodUnknowns];
    kernel(field, block, ends);
    for (std::size_t lane = 0; lane < count; ++lane) {
      typename System::Link& link = system.links[first + lane];
      for (int i = 0; i < kStates; ++i) {
        for (int j = 0; j < kStates; ++j)
          link.by_state[i][j] = j < kCoupled ? ends[i][1 + j][lane] : (i == j ? 1.0 : 0.0);
        for (int j = 0; j < kParameters; ++j) link.by_parameters[i][j] = ends[i][1 + kCoupled + j][lane];
        link.gap[i] = gap(path, first + lane, i, ends[i][0][lane]);
      }
    }
  });
  put_end(path, system);
}

template <RodEnd end>
void RodProblem<end>::put_gaps(const Path& path, System& system) const {
  const auto kernel = end == RodEnd::no_moment ? rod_kernels().turn : rod_kernels().move;
  for_blocks(path, [&](const RodField& field, const RodBlock& block, std::size_t first, std::size_t count) {
    ByRodSegment ends[kStates];
    kernel(field, block, ends);
    for (std::size_t lane = 0; lane < count; ++lane)
      for (int i = 0; i < kStates; ++i) system.links[first + lane].gap[i] = gap(path, first + lane, i, ends[i][lane]);
  });
  put_end(path, system);
}

/// Residual of a number that a segment ends with; a mere sum along the way starts from its node.
template <RodEnd end>
double RodProblem<end>::gap(const Path& path, std::size_t segment, int i, double ends) const {
  const auto at = static_cast<std::size_t>(i);
  return (i < kCoupled ? 0.0 : path.nodes[segment][at]) + ends - path.nodes[segment + 1][at];
}

template <RodEnd end>
void RodProblem<end>::put_end(const Path& path, System& system) const {
  const auto& y = path.nodes.back();
  // Only two components of m are free, since m.t is known. The component along which t is greatest is not free.
  std::array<std::size_t, 2> rows{6, 8};
  if constexpr (end == RodEnd::no_moment) {
    std::size_t along = 0;
    for (std::size_t i = 1; i < 3; ++i)
      if (std::abs(y[i]) > std::abs(y[along])) along = i;
    rows = {3 + (along + 1) % 3, 3 + (along + 2) % 3};
  }
  for (int i = 0; i < kParameters; ++i) {
    const auto at = static_cast<std::size_t>(i);
    std::fill_n(system.end_by_state[i], kStates, 0.0);
    std::fill_n(system.end_by_parameters[i], kParameters, 0.0);
    system.end_by_state[i][rows[at]] = 1.0;
    system.end_gap[i] = y[rows[at]] - (end == RodEnd::no_moment ? 0.0 : goal[at]);
    if constexpr (end == RodEnd::no_moment) {  // m = (m.t) t
      const std::size_t tangent = rows[at] - 3;
      system.end_by_state[i][tangent] = -twist(path);
      system.end_by_parameters[i][0] = lever * y[tangent];
      system.end_gap[i] -= twist(path) * y[tangent];
    }
  }
}

template <RodEnd end>
RodShape rod_shape(const RodProblem<end>& problem, const typename RodProblem<end>::Path& path, int spread) {
  RodShape shape;
  shape.suspended = problem.cuts.back();
  shape.stretch_stiffness = problem.stretch_stiffness;
  shape.floor_force = problem.floor_force(path);
  shape.twist = problem.twist(path);
  shape.lowest = std::numeric_limits<double>::infinity();
  const RodField field = field_of(problem, shape.floor_force);
  const auto keep = [&](double s, const RodPoint& point) {
    shape.places.push_back(s);
    shape.points.push_back(point);
    shape.lowest = std::min(shape.lowest, point.position[2]);
  };
  const auto& leaves = path.nodes[0];  // the shortest turn from x to the tangent
  const double half = std::sqrt(0.5 * (1.0 + leaves[0]));
  auto lifted = leaves;
  add_lever(problem.lever, problem.behind, field.floor, lifted);
  RodPoint start{{lifted[0], lifted[1], lifted[2]},
                 {lifted[3], lifted[4], lifted[5]},
                 {0, 0, 0},
                 {half, 0, -0.5 * leaves[2] / half, 0.5 * leaves[1] / half}};
  keep(0.0, start);
  const std::size_t segments = problem.cuts.size() - 1;
  std::vector<ByRodSegment> states(static_cast<std::size_t>(spread) * kRodWithRotation);
  for (std::size_t k = 0; k < segments; ++k) {
    const std::size_t lane = k % kRodBlock;
    if (lane == 0) rod_kernels().rotate(field, block_at(problem, path, shape.floor_force, k, spread), states.data());
    RodPoint point;
    for (int i = 0; i < spread; ++i) {
      const ByRodSegment* y = &states[static_cast<std::size_t>(i) * kRodWithRotation];
      for (std::size_t j = 0; j < 3; ++j) {
        point.tangent[j] = y[j][lane];
        point.moment[j] = y[3 + j][lane];
        point.position[j] = start.position[j] + y[kRodTurning + j][lane];
      }
      const ByRodSegment* turned = y + kRodWithPosition;
      point.rotation =
          unit(product({turned[0][lane], turned[1][lane], turned[2][lane], turned[3][lane]}, start.rotation));
      const double share = static_cast<double>(i + 1) / spread;
      keep(problem.cuts[k] + (problem.cuts[k + 1] - problem.cuts[k]) * share, point);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const double turning = point.tangent[i] - path.nodes[k + 1][i],
                   bending = point.moment[i] - path.nodes[k + 1][3 + i];
      shape.residual = std::max({shape.residual, std::abs(turning), std::abs(bending)});
    }
    start = point;
  }
  if constexpr (end == RodEnd::no_moment)
    for (std::size_t i = 0; i < 3; ++i) {
      const double bending = path.nodes.back()[3 + i] - shape.twist * path.nodes.back()[i];
      shape.residual = std::max(shape.residual, std::abs(bending));
    }
  return shape;
}

template class RodProblem<RodEnd::no_moment>;
template class RodProblem<RodEnd::plane_of_xz>;
template RodShape rod_shape(const RodProblem<RodEnd::no_moment>&, const RodProblem<RodEnd::no_moment>::Path&, int);
template RodShape rod_shape(const RodProblem<RodEnd::plane_of_xz>&, const RodProblem<RodEnd::plane_of_xz>::Path&, int);

}  // namespace withe
