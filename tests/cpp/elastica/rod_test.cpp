#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "elastica/rod.hpp"
#include "elastica/rod_grasp.hpp"
#include "elastica/rod_stability.hpp"

namespace withe {
namespace {

constexpr double kStretchStiffness = 4174.0;

template <class Problem>
void expect_derivatives(const Problem& problem, const typename Problem::Path& path) {
  typename Problem::System system, up, down;
  problem.linearise(path, system);
  constexpr double kStep = 1e-5;
  const auto differ = [&](auto&& change) {
    typename Problem::Path moved = path;
    change(moved, kStep);
    problem.linearise(moved, up);
    moved = path;
    change(moved, -kStep);
    problem.linearise(moved, down);
  };
  const auto expect = [&](double derivative, double above, double below) {
    EXPECT_NEAR(derivative, (above - below) / (2 * kStep), 1e-7 * std::max(1.0, std::abs(derivative)));
  };
  for (std::size_t p = 0; p < 2; ++p) {
    differ([p](auto& at, double by) { at.values[p] += by; });
    for (std::size_t k = 0; k < system.links.size(); ++k)
      for (std::size_t i = 0; i < Problem::kStates; ++i)
        expect(system.links[k].by_parameters[i][p], up.links[k].gap[i], down.links[k].gap[i]);
  }
  const std::size_t middle = path.nodes.size() / 2;
  for (std::size_t j = 0; j < Problem::kStates; ++j) {
    differ([&](auto& at, double by) { at.nodes[middle][j] += by; });
    for (std::size_t i = 0; i < Problem::kStates; ++i)
      expect(system.links[middle].by_state[i][j], up.links[middle].gap[i], down.links[middle].gap[i]);
    differ([&](auto& at, double by) { at.nodes.back()[j] += by; });
    for (std::size_t i = 0; i < 2; ++i) expect(system.end_by_state[i][j], up.end_gap[i], down.end_gap[i]);
  }
}

TEST(RodProblem, DerivativesMatchDifferences) {
  const GraspTable table;
  GraspTable::Data data;
  for (const double curvature : {0.3, 2.5}) {
    for (const double lever : {0.0, 0.1}) {
      ASSERT_TRUE(table.solve({4.0, curvature, kStretchStiffness, 0.1, 0.0, lever}, data));
      expect_derivatives(data.problem, data.path);
    }
    RodProblem<RodEnd::plane_of_xz> held;
    RodProblem<RodEnd::plane_of_xz>::Path path;
    held.stretch_stiffness = kStretchStiffness;
    held.cuts = data.problem.cuts;
    path.values = {0.1, 1.4};
    for (const auto& y : data.path.nodes) path.nodes.push_back({y[0], y[1], y[2], y[3], y[4], y[5], 0.1, 0.2, 0.3});
    expect_derivatives(held, path);
  }
}

TEST(RodProblem, GapsAloneAreThoseOfTheLinearisation) {
  const GraspTable table;
  GraspTable::Data data;
  ASSERT_TRUE(table.solve({7.0, 1.0, kStretchStiffness, 0.2, 0.0, 0.1}, data));  // segments that fill no whole packs
  auto path = data.path;
  for (auto& y : path.nodes) y[3] += 0.01;
  GraspProblem::System system, gaps;
  data.problem.linearise(path, system);
  data.problem.linearise(data.path, gaps);
  data.problem.put_gaps(path, gaps);
  for (std::size_t k = 0; k < system.links.size(); ++k)
    for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(gaps.links[k].gap[i], system.links[k].gap[i], 1e-14);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(gaps.end_gap[i], system.end_gap[i], 1e-14);
}

TEST(RodShape, KeepsUnitTangentsMomentsAcrossThemAndTheEnergyIntegral) {
  const GraspTable table;
  GraspTable::Data data;
  ASSERT_TRUE(table.solve({8.0, 1.2}, data));
  const RodShape shape = rod_shape(data.problem, data.path, 6);
  for (const RodPoint& at : shape.points) {
    const auto& [tangent, moment, position, rotation] = at;
    EXPECT_NEAR(tangent[0] * tangent[0] + tangent[1] * tangent[1] + tangent[2] * tangent[2], 1.0, 1e-7);
    EXPECT_NEAR(tangent[0] * moment[0] + tangent[1] * moment[1] + tangent[2] * moment[2], 0.0, 1e-6);
    // The quaternion turns x into the tangent.
    const double w = rotation[0], x = rotation[1], y = rotation[2], z = rotation[3];
    EXPECT_NEAR(1 - 2 * (y * y + z * z), tangent[0], 1e-7);
    EXPECT_NEAR(2 * (x * y + w * z), tangent[1], 1e-7);
    EXPECT_NEAR(2 * (x * z - w * y), tangent[2], 1e-7);
  }
  // d/ds (m.m / 4 + n.t) = n'.t = t_z, so the sum less the height stays what it is at lift-off.
  const auto integral = [&](std::size_t i) {
    const RodPoint& at = shape.points[i];
    double sum = -at.position[2];
    for (std::size_t k = 0; k < 3; ++k) {
      const double force = -shape.floor_force[k] + (k == 2 ? shape.places[i] : 0.0);
      sum += 0.25 * at.moment[k] * at.moment[k] + force * at.tangent[k];
    }
    return sum;
  };
  for (std::size_t i = 0; i < shape.points.size(); ++i) EXPECT_NEAR(integral(i), integral(0), 1e-6);
}

/// A straight rod along x pushed together between two clamps, so short that its weight does nothing.
RodShape strut(double force) {
  constexpr double kLength = 0.1;
  RodShape shape;
  shape.suspended = kLength;
  shape.floor_force = {force, 0, 0};
  for (int i = 0; i <= 200; ++i) {
    shape.places.push_back(kLength * i / 200);
    shape.points.push_back({{1, 0, 0}, {0, 0, 0}, {shape.places.back(), 0, 0}, {1, 0, 0, 0}});
  }
  return shape;
}

TEST(RodStability, OfAClampedStrutEndsAtEulersLoad) {
  const double euler = 4 * std::pow(std::numbers::pi / 0.1, 2) * 2.0;
  EXPECT_TRUE(rod_is_stable(strut(0.999 * euler), 4.0 / 3));
  EXPECT_FALSE(rod_is_stable(strut(1.001 * euler), 4.0 / 3));
}

TEST(RodStability, OfATwistedStrutEndsAtGreenhillsMoment) {
  // Clamped at both ends, twisted by M: the least M with tan(u) = u, M L / EI = 2 u = 8.9868 [Love 1927, 272].
  const auto twisted = [](double moment) {
    RodShape shape = strut(0.0);
    for (RodPoint& at : shape.points) at.moment = {moment, 0, 0};
    return shape;
  };
  const double critical = 8.98681891 * 2.0 / 0.1;
  EXPECT_TRUE(rod_is_stable(twisted(0.999 * critical), 4.0 / 3));
  EXPECT_FALSE(rod_is_stable(twisted(1.001 * critical), 4.0 / 3));
}

}  // namespace
}  // namespace withe
