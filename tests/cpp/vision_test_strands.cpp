#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "vision/branch_matching.hpp"
#include "vision/cable_paths.hpp"
#include "vision/color_image.hpp"
#include "vision/crossing_order.hpp"
#include "vision/mbest.hpp"
#include "vision/thinning.hpp"
#include "vision/tracing.hpp"
#include "vision/width_runs.hpp"

namespace withe {
namespace {

void draw_line(BitImage& image, const Vector2& a, const Vector2& b, double width) {
  const Vector2 along = b - a;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const Vector2 p(x, y);
      const double t = std::clamp((p - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
      if ((p - a - t * along).norm() <= width / 2) image.set(x, y);
    }
  }
}

TEST(BendingEnergy, IsThatOfAnArcOfACircleAndLessWhereTheBranchesAreBentAlready) {
  const double radius = 50;
  const double turn = 0.6;
  Branch from;
  from.point = Vector2(0, 0);
  from.tangent = Vector2(1, 0);
  from.half_width = 4;
  Branch to = from;
  to.point = radius * Vector2(std::sin(turn), 1 - std::cos(turn));
  to.tangent = -Vector2(std::cos(turn), std::sin(turn));
  const double arc = 0.5 * turn * turn / (radius * turn);
  EXPECT_NEAR(bending_energy(from, to), arc, 0.03 * arc);
  from.curvature = 1 / radius;
  to.curvature = -1 / radius;
  EXPECT_LT(bending_energy(from, to), 0.3 * arc);
  EXPECT_NEAR(bending_energy(from, to), bending_energy(to, from), 1e-12);
}

TEST(Tracing, StrandsThatLieSideBySideAreCalledAmbiguous) {
  BitImage mask(200, 500);
  draw_line(mask, {150, 95}, {350, 95}, 10);
  draw_line(mask, {150, 105}, {350, 105}, 10);
  draw_line(mask, {40, 40}, {150, 95}, 10);
  draw_line(mask, {350, 95}, {460, 40}, 10);
  draw_line(mask, {40, 160}, {150, 105}, 10);
  draw_line(mask, {350, 105}, {460, 160}, 10);
  const Tracing tracing = trace_lines(mask, {});
  EXPECT_EQ(tracing.cables.size(), 2U);
  bool parallel = false;
  for (const DoubtfulZone& doubt : tracing.doubts) parallel = parallel || doubt.reason == Doubt::parallel_strands;
  EXPECT_TRUE(parallel);
}

TEST(WidthRuns, FollowEachOtherWhereTheMaskBecomesNarrower) {
  BitImage mask(100, 500);
  draw_line(mask, {40, 50}, {460, 50}, 10);
  draw_line(mask, {40, 60}, {260, 60}, 10);
  SkeletonGraph graph = build_graph(thin(mask), mask, 200);
  prune_spurs(graph, 1.5);
  const std::vector<WidthRun> runs = find_width_runs(graph, mask);
  ASSERT_EQ(runs.size(), 2U);
  EXPECT_EQ(runs[0].edge, runs[1].edge);
  const WidthRun& wide = runs[0].width > runs[1].width ? runs[0] : runs[1];
  const WidthRun& narrow = runs[0].width > runs[1].width ? runs[1] : runs[0];
  EXPECT_NEAR(wide.width, 21, 0.7);  // rows from 45 to 65
  EXPECT_NEAR(narrow.width, 11, 0.7);
  EXPECT_GT(wide.length(), 170);
  EXPECT_GT(narrow.length(), 150);
}

TEST(WidthRuns, AWidthIsComparedWithThatOfSingleCablesIfAllAgree) {
  const std::vector<WidthRun> agree{{0, 0, 199, 10.4}, {1, 0, 149, 9.8}, {2, 0, 199, 20.3}};
  EXPECT_NEAR(narrower_cable(agree, 20.3), 10.1, 0.4);
  EXPECT_EQ(narrower_cable(agree, 10.4), 0);
  const std::vector<WidthRun> differ{{0, 0, 199, 8.0}, {1, 0, 149, 12.0}, {2, 0, 199, 20.0}};
  EXPECT_EQ(narrower_cable(differ, 20.0), 0);
  EXPECT_EQ(count_strands(20.3, 10.1), 2);
  EXPECT_EQ(count_strands(31.0, 10.0), 3);
  EXPECT_EQ(count_strands(15.0, 10.0), 0);
}

TEST(Tracing, ThreeCablesAtOnePointAreThreeCrossings) {
  BitImage mask(300, 300);
  for (int k = 0; k < 3; ++k) {
    const double angle = 0.2 + k * 1.0472;
    const Vector2 along(std::cos(angle), std::sin(angle));
    draw_line(mask, Vector2(150, 150) - 110 * along, Vector2(150, 150) + 110 * along, 10);
  }
  const Tracing tracing = trace_lines(mask, {});
  EXPECT_EQ(tracing.cables.size(), 3U);
  EXPECT_EQ(tracing.crossings.size(), 3U);
}

TEST(CablePaths, EveryLineOfTheSkeletonOutsideZonesBelongsToExactlyOneCable) {
  std::mt19937 random(5);
  for (int k = 0; k < 200; ++k) {
    BitImage mask(90, 130);
    std::bernoulli_distribution set(0.4 + 0.5 * (k % 10) / 10);
    for (int y = 0; y < 90; ++y) {
      for (int x = 0; x < 130; ++x) {
        if (set(random)) mask.set(x, y);
      }
    }
    const BitImage smooth = k % 2 == 0 ? mask : majority(mask);
    SkeletonGraph graph = build_graph(thin(smooth), smooth, 200);
    prune_spurs(graph, 1.5);
    const Continuations links = find_continuations(graph, {});
    std::vector<int> used(graph.edges.size(), 0);
    for (const CablePath& path : collect_paths(graph, links)) {
      for (const HalfEdge entry : path.entries) ++used[static_cast<std::size_t>(edge_of(entry))];
    }
    for (std::size_t e = 0; e < graph.edges.size(); ++e) {
      EXPECT_EQ(used[e], graph.edges[e].removed || links.inside[e] ? 0 : 1);
    }
  }
}

TEST(CrossingOrder, TheColourInsideTheCrossingDecides) {
  BitImage across(200, 300), along(200, 300), mask(200, 300);
  draw_line(along, {30, 100}, {270, 100}, 12);
  draw_line(across, {150, 20}, {150, 180}, 12);
  for (const bool across_is_over : {true, false}) {
    std::vector<std::uint8_t> pixels(200 * 300 * 3, 10);
    for (int y = 0; y < 200; ++y) {
      for (int x = 0; x < 300; ++x) {
        const bool a = across.at(x, y);
        const bool b = along.at(x, y);
        if (a || b) mask.set(x, y);
        if (a || b) pixels[static_cast<std::size_t>(3 * (y * 300 + x)) + ((a && (across_is_over || !b)) ? 0 : 2)] = 220;
      }
    }
    const ColorImage image{pixels.data(), 200, 300, 900};
    Tracing ours = trace_lines(mask, {});
    decide_order(image, ours);
    Tracing published = trace_mbest(mask);
    decide_order_mbest(image, published);
    for (const Tracing& tracing : {ours, published}) {
      ASSERT_EQ(tracing.cables.size(), 2U);
      ASSERT_EQ(tracing.crossings.size(), 1U);
      const MatrixX2& line = tracing.cables[static_cast<std::size_t>(tracing.crossings[0].over.cable)].centreline;
      const bool vertical = std::abs(line(0, 0) - line(line.rows() - 1, 0)) < 20;
      EXPECT_EQ(vertical, across_is_over);
      EXPECT_GT(tracing.crossings[0].confidence, 0);
    }
  }
}

TEST(ColorImage, HueSaturationAndValueOfPureColours) {
  EXPECT_EQ(to_hsv(255, 0, 0), (std::array<int, 3>{0, 255, 255}));
  EXPECT_EQ(to_hsv(0, 255, 0), (std::array<int, 3>{60, 255, 255}));
  EXPECT_EQ(to_hsv(0, 0, 128), (std::array<int, 3>{120, 255, 128}));
  EXPECT_EQ(to_hsv(70, 70, 70), (std::array<int, 3>{0, 0, 70}));
}

}  // namespace
}  // namespace withe
