#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "elastica/runge_kutta.hpp"
#include "elastica/sheet_manifold.hpp"
#include "elastica/sheet_motion.hpp"
#include "elastica/sheet_stability.hpp"

namespace withe {
namespace {

SheetProblem::Path solved(double x, double z, double tip_moment = 0.0) {
  static const SheetManifold manifold;
  SheetManifold::Data data;
  EXPECT_TRUE(manifold.at_position(x, z, tip_moment, data).valid) << x << " " << z;
  return data.path;
}

/// Width of a square that is folded over its diagonal, held at the corner: up to the middle and beyond.
SheetWidth diamond() { return {{0.0, 2.5, 6.5}, {0.1, 1.0, 0.0}}; }

TEST(RungeKutta, IsOfEighthOrderOnAPendulum) {
  const auto slope = [](double, const std::array<double, 2>& y) {
    return std::array<double, 2>{y[1], -std::sin(y[0])};
  };
  const auto at_end = [&](int steps) {
    std::array<double, 2> y{2.0, 0.0};
    for (int i = 0; i < steps; ++i) runge_kutta_step<2>(slope, 4.0 * i / steps, 4.0 / steps, y);
    return y[0];
  };
  const double exact = at_end(200);
  const double order = std::log2(std::abs(at_end(8) - exact) / std::abs(at_end(16) - exact));
  EXPECT_NEAR(order, 8.0, 1.0);
}

TEST(SheetProblem, DerivativesMatchDifferences) {
  for (const TipTarget target : {TipTarget::position, TipTarget::length_and_angle, TipTarget::length_and_direction,
                                 TipTarget::pose, TipTarget::sliding}) {
    SheetProblem problem;
    problem.shape = {diamond(), 0.2};
    problem.target = target;
    problem.goal = {2.0, 0.7, 1.5};
    problem.friction = -0.4;
    problem.sheet_length = 6.0;
    const SheetProblem::Path path = solved(3.0, 2.0);
    SheetProblem::System system, up, down;
    problem.linearise(path, system);
    constexpr double kStep = 1e-5;
    const auto differ = [&](auto&& change) {
      SheetProblem::Path moved = path;
      change(moved, kStep);
      problem.linearise(moved, up);
      moved = path;
      change(moved, -kStep);
      problem.linearise(moved, down);
    };
    const auto slope = [](double above, double below) { return (above - below) / (2 * kStep); };
    for (std::size_t p = 0; p < 3; ++p) {
      differ([p](SheetProblem::Path& at, double by) { at.values[p] += by; });
      for (std::size_t k = 0; k < system.links.size(); ++k)
        for (std::size_t i = 0; i < 4; ++i)
          EXPECT_NEAR(system.links[k].by_parameters[i][p], slope(up.links[k].gap[i], down.links[k].gap[i]), 1e-7);
      for (std::size_t i = 0; i < 3; ++i)
        EXPECT_NEAR(system.end_by_parameters[i][p], slope(up.end_gap[i], down.end_gap[i]), 1e-7);
    }
    for (std::size_t j = 0; j < 4; ++j) {
      differ([j](SheetProblem::Path& at, double by) { at.nodes[3][j] += by; });
      for (std::size_t i = 0; i < 4; ++i)
        EXPECT_NEAR(system.links[3].by_state[i][j], slope(up.links[3].gap[i], down.links[3].gap[i]), 1e-7);
      differ([j](SheetProblem::Path& at, double by) { at.nodes.back()[j] += by; });
      for (std::size_t i = 0; i < 3; ++i)
        EXPECT_NEAR(system.end_by_state[i][j], slope(up.end_gap[i], down.end_gap[i]), 1e-7);
    }
  }
}

TEST(SheetWidth, WeightIsTheIntegralOfTheWidth) {
  const SheetWidth width = diamond();
  double weight = 0;
  constexpr int kParts = 70000;
  for (int i = 0; i < kParts; ++i) weight += width.width_at(7.0 * (i + 0.5) / kParts) * 7.0 / kParts;
  EXPECT_NEAR(width.weight_at(7.0), weight, 1e-8);
  EXPECT_NEAR(width.weight_at(2.5), 2.5 * 0.55, 1e-14);
  EXPECT_NEAR(width.width_at(4.5), 0.5, 1e-14);
  EXPECT_EQ(width.width_at(8.0), 0.0);
  const SheetWidth half = width.blended(0.5, 2.0);
  for (double t : {0.0, 1.0, 2.5, 4.0, 6.0}) {
    EXPECT_NEAR(half.width_at(t), 0.5 + width.width_at(t), 1e-14);
    EXPECT_NEAR(half.weight_at(t), 0.5 * t + width.weight_at(t), 1e-14);
  }
}

TEST(SheetManifold, ShapesKeepTheMomentAboutTheTip) {
  // Moments about the lift-off point: weight at its centre, the tip's force and moment, nothing from the floor.
  using Asked = std::array<double, 3>;  // x, z, moment
  for (const SheetWidth& width : {SheetWidth(), diamond()}) {
    const SheetManifold manifold(width);
    for (const auto& [x, z, moment] : {Asked{1.0, 1.5, 0.0}, {3.0, 2.0, 0.0}, {6.0, 1.25, 0.0}, {3.0, 2.0, 0.05}}) {
      SheetManifold::Data data;
      ASSERT_TRUE(manifold.at_position(x, z, moment, data).valid) << x << " " << z;
      // The moment of the weight, integral of b X, by parts of X cut finely, ends of pieces among them.
      const SheetProblem::Path& p = data.path;
      const double length = p.values[2], weight = width.weight_at(length);
      const auto slope = [&width, &p, length, weight](double s, const std::array<double, 5>& y) {
        const double b = width.width_at(length - s), w = weight - width.weight_at(length - s);
        return std::array<double, 5>{y[1] / (2 * b), (p.values[0] - w) * std::cos(y[0]) - p.values[1] * std::sin(y[0]),
                                     std::cos(y[0]), std::sin(y[0]), b * y[2]};
      };
      std::array<double, 5> y{};
      constexpr int kSteps = 4000;
      for (int i = 0; i < kSteps; ++i) runge_kutta_step<3>(slope, length * i / kSteps, length / kSteps, y);
      const double tip_x = length - x;
      const double tip_up = weight - p.values[0], tip_forward = -p.values[1];
      EXPECT_NEAR(y[0], p.nodes.back()[0], 1e-6);
      EXPECT_NEAR(y[3], z, 1e-6);
      EXPECT_NEAR(tip_x * tip_up - z * tip_forward - y[4] + moment, 0.0, 1e-6);
    }
  }
}

TEST(SheetStability, AClampedColumnBucklesAtEulersLoad) {
  // Hardly bent, so that keeping the tip's way along the column is a constraint; it does not touch the buckling mode.
  SheetProblem::Path column;
  const double length = 0.05, load = 8 * std::numbers::pi * std::numbers::pi / (length * length);  // EI = 2
  const double wave = 4 * std::numbers::pi / length;
  for (int k = 0; k <= SheetProblem::kSegments; ++k) {
    const double s = length * k / SheetProblem::kSegments;
    column.nodes.push_back({1e-3 * std::sin(wave * s), 2e-3 * wave * std::cos(wave * s), s, 0.0});
  }
  column.values = {0.0, 0.998 * load, length};
  EXPECT_TRUE(sheet_is_stable(SheetShape{}, column));
  column.values[1] = 1.002 * load;
  EXPECT_FALSE(sheet_is_stable(SheetShape{}, column));
}

SheetMotionData held(const SheetForces& forces) {
  SheetMotionData data;
  set_sheet_forces({}, forces, data);
  return data;
}

TEST(SheetMotion, APoseIsMetAndLedBackToItsForces) {
  const SheetForces forces{3.0, 0.1, 4.0};
  SheetMotionData data = held(forces);
  const SheetPose start{tip_back(data.path), tip_up(data.path), tip_angle(data.path)};
  const SheetPose there{start[0] + 0.2, start[1] - 0.1, start[2] + 0.15};
  ASSERT_TRUE(move_sheet(there, data));
  EXPECT_NEAR(tip_back(data.path), there[0], 1e-10);
  EXPECT_NEAR(tip_up(data.path), there[1], 1e-10);
  EXPECT_NEAR(tip_angle(data.path), there[2], 1e-10);
  ASSERT_TRUE(move_sheet(start, data));
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(data.path.values[i], forces[i], 1e-8);
}

TEST(SheetMotion, WorkOfTheTipIsTheChangeOfEnergyOfASheetThatSticks) {
  // The tip's work over a small cycle of poses is zero: its forces and moment have a potential.
  SheetMotionData data = held({3.0, 0.1, 4.0});
  const SheetPose start{tip_back(data.path), tip_up(data.path), tip_angle(data.path)};
  const auto forces = [&data] {  // of the jaw on the sheet, along x (backwards), z, and its moment
    return std::array<double, 3>{data.path.values[1], data.path.values[2] - data.path.values[0],
                                 data.path.nodes.back()[1]};
  };
  constexpr double kStep = 1e-4;
  double slopes[3][3];
  for (std::size_t j = 0; j < 3; ++j) {
    SheetPose up = start, down = start;
    up[j] += kStep;
    down[j] -= kStep;
    ASSERT_TRUE(move_sheet(up, data));
    const auto above = forces();
    ASSERT_TRUE(move_sheet(down, data));
    const auto below = forces();
    ASSERT_TRUE(move_sheet(start, data));
    for (std::size_t i = 0; i < 3; ++i) slopes[i][j] = (above[i] - below[i]) / (2 * kStep);
  }
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < i; ++j) EXPECT_NEAR(slopes[i][j], slopes[j][i], 1e-5 * (1 + std::abs(slopes[i][j])));
}

TEST(SheetMotion, ASheetSlidesWhereItsForcesExceedFriction) {
  SheetMotionData data = held({1.5, 0.0, 3.0});
  const double x = tip_back(data.path), z = tip_up(data.path), angle = tip_angle(data.path);
  const SheetFriction rough{100.0, 6.0}, slick{0.05, 6.0};
  double slide = 0;
  SheetMotionData stuck = data;
  ASSERT_TRUE(drag_sheet({x + 0.3, z, angle}, rough, slide, stuck));
  EXPECT_EQ(slide, 0.0);
  ASSERT_GT(std::abs(stuck.path.values[1]), 0.05 * (stuck.path.values[0] + 6.0 - stuck.path.values[2]));
  for (double way = 0.05; way < 0.31; way += 0.05) ASSERT_TRUE(drag_sheet({x + way, z, angle}, slick, slide, data));
  EXPECT_GT(slide, 0.1);  // pushed back
  EXPECT_LT(slide, 0.3);
  const auto& [up, forward, length] = data.path.values;
  EXPECT_NEAR(forward, 0.05 * (up + 6.0 - length), 1e-9);
  EXPECT_NEAR(tip_back(data.path), x + 0.3 - slide, 1e-9);
}

}  // namespace
}  // namespace withe
