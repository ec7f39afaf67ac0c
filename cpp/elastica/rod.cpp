#include "elastica/rod.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "common/dual.hpp"
#include "elastica/runge_kutta.hpp"

namespace withe {

namespace {

constexpr double kLongestSegment = 0.6, kLongestStep = 0.6;
constexpr double kTurnPerStep = 0.7;  ///< [rad]
constexpr double kDecay = 0.6;        ///< as much of the exponent with which a bend dies out along a pulled rod

template <class Scalar>
using Vector = std::array<Scalar, 3>;

/// The moment of the floor's force, which acts below and behind lift-off, on the state there.
template <std::size_t count, class Scalar>
void put_lever(double lever, double behind, const Vector<Scalar>& floor, std::array<Scalar, count>& y) {
  y[3] -= lever * floor[1];
  y[4] += lever * floor[0];
  y[5] += behind * floor[1];
}

/// The equations of the header: t, m, then what follows from them (r, or a quaternion and r).
template <class Scalar>
struct RodSlope {
  Vector<Scalar> floor;
  double compliance;

  template <std::size_t count>
  std::array<Scalar, count> operator()(double s, const std::array<Scalar, count>& y) const {
    const Scalar n[3] = {-floor[0], -floor[1], s - floor[2]};
    const Scalar stretch = 1.0 + compliance * (n[0] * y[0] + n[1] * y[1] + n[2] * y[2]);
    std::array<Scalar, count> slope;
    slope[0] = 0.5 * (y[4] * y[2] - y[5] * y[1]);
    slope[1] = 0.5 * (y[5] * y[0] - y[3] * y[2]);
    slope[2] = 0.5 * (y[3] * y[1] - y[4] * y[0]);
    slope[3] = stretch * (y[2] * n[1] - y[1] * n[2]);
    slope[4] = stretch * (y[0] * n[2] - y[2] * n[0]);
    slope[5] = stretch * (y[1] * n[0] - y[0] * n[1]);
    if constexpr (count >= 9)
      for (std::size_t i = 0; i < 3; ++i) slope[6 + i] = stretch * y[i];
    if constexpr (count == 13) {  // q' = w q / 2, w = t x t' the turning without twist
      const Scalar* q = &y[9];
      const Scalar twist = y[0] * y[3] + y[1] * y[4] + y[2] * y[5];
      const Scalar m[3] = {y[3] - twist * y[0], y[4] - twist * y[1], y[5] - twist * y[2]};
      slope[9] = -0.25 * (m[0] * q[1] + m[1] * q[2] + m[2] * q[3]);
      slope[10] = 0.25 * (m[0] * q[0] + m[1] * q[3] - m[2] * q[2]);
      slope[11] = 0.25 * (m[1] * q[0] + m[2] * q[1] - m[0] * q[3]);
      slope[12] = 0.25 * (m[2] * q[0] + m[0] * q[2] - m[1] * q[1]);
    }
    return slope;
  }
};

double size_of(double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); }

/// Runge-Kutta steps from a node to the next cut.
template <std::size_t count>
int rod_steps(const RodVector& floor, double from, double to, const std::array<double, count>& y) {
  const double bend = 0.5 * size_of(y[3], y[4], y[5]);
  const auto decay = [&](double s) { return std::sqrt(0.5 * size_of(floor[0], floor[1], s - floor[2])); };
  const double rate = std::max({bend, kDecay * decay(from), kDecay * decay(to), kTurnPerStep / kLongestStep});
  return static_cast<int>(std::clamp(std::ceil((to - from) * rate / kTurnPerStep), 1.0, 40.0));
}

template <int coupled, std::size_t count, class Scalar>
void across(const RodSlope<Scalar>& slope, double from, double to, int steps, std::array<Scalar, count>& y) {
  const double h = (to - from) / steps;
  const auto at = [&](const Scalar& s, const std::array<Scalar, count>& state) { return slope(value_of(s), state); };
  for (int i = 0; i < steps; ++i) runge_kutta_step<coupled>(at, Scalar(from + i * h), Scalar(h), y);
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

}  // namespace

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
void RodProblem<end>::linearise(const Path& path, System& system) const {
  using Number = Dual<kCoupled + kParameters>;
  system.links.resize(cuts.size() - 1);
  const RodVector force = floor_force(path);
  RodSlope<Number> slope{{force[0], force[1], force[2]}, 1.0 / stretch_stiffness};
  for (int j = 0; j < kParameters; ++j) {
    const std::size_t component = unknown_forces<end>()[static_cast<std::size_t>(j)];
    slope.floor[component] = Number::unknown(force[component], kCoupled + j);
  }
  for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
    const auto& y = path.nodes[k];
    std::array<Number, kStates> state;
    for (int i = 0; i < kStates; ++i) {
      const auto at = static_cast<std::size_t>(i);
      state[at] = i < kCoupled ? Number::unknown(y[at], i) : Number(y[at]);
    }
    if (k == 0) put_lever(lever, behind, slope.floor, state);
    across<kCoupled>(slope, cuts[k], cuts[k + 1], rod_steps(force, cuts[k], cuts[k + 1], y), state);
    typename System::Link& link = system.links[k];
    for (int i = 0; i < kStates; ++i) {
      const auto at = static_cast<std::size_t>(i);
      for (int j = 0; j < kStates; ++j) link.by_state[i][j] = j < kCoupled ? state[at].slope[j] : (i == j ? 1.0 : 0.0);
      for (int j = 0; j < kParameters; ++j) link.by_parameters[i][j] = state[at].slope[kCoupled + j];
      link.gap[i] = state[at].value - path.nodes[k + 1][at];
    }
  }
  put_end(path, system);
}

template <RodEnd end>
void RodProblem<end>::put_end(const Path& path, System& system) const {
  const auto& y = path.nodes.back();
  // Of m only two components are free, for m.t is known: not the one along which t is greatest.
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
  const RodSlope<double> slope{shape.floor_force, 1.0 / problem.stretch_stiffness};
  std::array<double, 13> y{};
  const auto& leaves = path.nodes[0];  // the shortest turn from x to the tangent
  const double half = std::sqrt(0.5 * (1.0 + leaves[0]));
  y[9] = half;
  y[11] = -0.5 * leaves[2] / half;
  y[12] = 0.5 * leaves[1] / half;
  const auto keep = [&](double s) {
    const double unit = 1.0 / std::sqrt(y[9] * y[9] + y[10] * y[10] + y[11] * y[11] + y[12] * y[12]);
    shape.places.push_back(s);
    shape.points.push_back({{y[0], y[1], y[2]},
                            {y[3], y[4], y[5]},
                            {y[6], y[7], y[8]},
                            {unit * y[9], unit * y[10], unit * y[11], unit * y[12]}});
    shape.lowest = std::min(shape.lowest, y[8]);
  };
  const auto start_of = [&](std::size_t k) {
    std::copy_n(path.nodes[k].begin(), 6, y.begin());
    if (k == 0) put_lever(problem.lever, problem.behind, shape.floor_force, y);
  };
  start_of(0);
  keep(0.0);
  for (std::size_t k = 0; k + 1 < problem.cuts.size(); ++k) {
    start_of(k);
    const double from = problem.cuts[k], to = problem.cuts[k + 1];
    const int steps = rod_steps(shape.floor_force, from, to, path.nodes[k]);
    for (int i = 1; i <= spread; ++i) {
      const double begin = from + (to - from) * (i - 1) / spread, stop = from + (to - from) * i / spread;
      across<13>(slope, begin, stop, (steps + spread - 1) / spread, y);
      keep(stop);
    }
    for (std::size_t i = 0; i < 6; ++i)
      shape.residual = std::max(shape.residual, std::abs(y[i] - path.nodes[k + 1][i]));
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
