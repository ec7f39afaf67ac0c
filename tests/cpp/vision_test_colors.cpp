#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "vision/branch_matching.hpp"
#include "vision/strand_classes.hpp"
#include "vision/thinning.hpp"
#include "vision/tracing.hpp"

namespace withe {
namespace {

using Rgb = std::array<std::uint8_t, 3>;
constexpr Rgb kRed{200, 40, 40}, kBlue{40, 90, 200}, kGround{150, 150, 150};

/// A picture that owns its pixels, and the mask of its strands.
struct Picture {
  static constexpr int kHeight = 200, kWidth = 300;
  std::vector<std::uint8_t> pixels;
  BitImage mask{kHeight, kWidth};

  Picture() {
    for (int i = 0; i < kHeight * kWidth; ++i) pixels.insert(pixels.end(), kGround.begin(), kGround.end());
  }
  ColorImage image() const { return {pixels.data(), kHeight, kWidth, 3 * kWidth}; }

  /// A strand of width 9 around a curve of points less than 1 px apart, shaded towards its flanks. `color_at` gives the
  /// colour by number of the point.
  template <class Curve, class Color>
  void draw(const Curve& curve, int count, const Color& color_at) {
    constexpr double radius = 4.5;
    for (int i = 0; i < count; ++i) {
      const Vector2 p = curve(i);
      for (int y = static_cast<int>(p.y() - radius); y <= static_cast<int>(p.y() + radius) + 1; ++y) {
        for (int x = static_cast<int>(p.x() - radius); x <= static_cast<int>(p.x() + radius) + 1; ++x) {
          const double distance = (Vector2(x, y) - p).norm();
          if (distance > radius) continue;
          mask.set(x, y);
          const double light = 1 - 0.4 * distance / radius;
          const Rgb color = color_at(i);
          for (std::size_t c = 0; c < 3; ++c) {
            pixels[static_cast<std::size_t>(3 * (y * kWidth + x)) + c] = static_cast<std::uint8_t>(light * color[c]);
          }
        }
      }
    }
  }
};

/// The upper (-1) or lower (1) of two bends whose tops overlap by 4 px.
Vector2 bend(int i, int side) {
  const double x = 40 + 0.5 * i;
  return {x, 100 + side * ((x - 150) * (x - 150) / 180 + 2.5)};
}
constexpr int kBendPoints = 440;

TEST(ColorDifference, IsLargeForHuesAndSmallForShadingAndHighlights) {
  const LogColor red{{0.9F, 0.4F}, 4.5F}, shaded{{0.9F, 0.4F}, 3.9F}, pale{{0.75F, 0.33F}, 4.7F};
  const LogColor blue{{-0.6F, -0.8F}, 4.5F};
  EXPECT_GT(color_difference(red, blue), 3);
  EXPECT_LT(color_difference(red, shaded), 0.7);
  EXPECT_LT(color_difference(red, pale), 0.7);
  EXPECT_FLOAT_EQ(color_difference(red, blue), color_difference(blue, red));
}

TEST(StrandClasses, CutsBetweenStrandsOfDifferentColors) {
  Picture picture;
  picture.draw([](int i) { return Vector2(40 + 0.5 * i, 100); }, 400, [](int) { return kBlue; });
  picture.draw([](int i) { return Vector2(140, 20 + 0.5 * i); }, 320, [](int) { return kRed; });
  const SkeletonGraph graph = build_graph(thin(picture.mask), picture.mask, 200);
  const StrandClasses classes(picture.image(), graph, picture.mask);
  ASSERT_EQ(classes.count(), 2);
  EXPECT_NE(classes.at(60, 100), classes.at(140, 100));
  EXPECT_EQ(classes.at(60, 100), classes.at(220, 100));
  EXPECT_EQ(classes.at(5, 5), -1);
  BitImage parts = picture.mask;
  ASSERT_TRUE(classes.cut(parts));
  int regions = 0;
  for_each_region(parts, [&](const std::vector<Pixel>& region) {
    ++regions;
    for (const Pixel p : region) {
      ASSERT_EQ(classes.at(p.x, p.y), classes.at(region.front().x, region.front().y));
    }
  });
  EXPECT_EQ(regions, 3);
}

TEST(StrandClasses, HaveNoRegionsIfAllStrandsHaveOneColor) {
  Picture picture;
  picture.draw([](int i) { return Vector2(40 + 0.5 * i, 100); }, 400, [](int) { return kBlue; });
  const SkeletonGraph graph = build_graph(thin(picture.mask), picture.mask, 200);
  const StrandClasses classes(picture.image(), graph, picture.mask);
  ASSERT_EQ(classes.count(), 1);
  EXPECT_EQ(classes.at(60, 100), -1);
  EXPECT_EQ(classes.region_of(Vector2(60, 100)).count(), 0U);
  BitImage parts = picture.mask;
  EXPECT_FALSE(classes.cut(parts));
}

TEST(TraceLines, ColorsDecideWhetherTwoBendsTouchOrCross) {
  for (const bool crosses : {false, true}) {
    Picture picture;
    for (const int side : {-1, 1}) {
      picture.draw([side](int i) { return bend(i, side); }, kBendPoints,
                   [&](int i) {
                     const bool first = (side < 0) != (crosses && i > kBendPoints / 2);
                     return first ? kRed : kBlue;
                   });
    }
    const ColorImage image = picture.image();
    const Tracing tracing = trace_lines(picture.mask, {}, &image);
    ASSERT_EQ(tracing.cables.size(), 2) << crosses;
    for (const Cable& cable : tracing.cables) {
      const auto last = cable.centreline.rows() - 1;
      const bool changes = (cable.centreline(0, 1) < 100) != (cable.centreline(last, 1) < 100);
      EXPECT_EQ(changes, crosses);
    }
    EXPECT_EQ(tracing.crossings.size(), crosses ? 1 : 0);
  }
}

TEST(TraceLines, StripesOfOneCableStayTogetherAndAreReported) {
  Picture picture;
  picture.draw([](int i) { return Vector2(30 + 0.5 * i, 100 + 30 * std::sin(0.01 * i)); }, 480,
               [](int i) { return i / 80 % 2 == 0 ? kRed : kBlue; });
  const ColorImage image = picture.image();
  const Tracing tracing = trace_lines(picture.mask, {}, &image);
  ASSERT_EQ(tracing.cables.size(), 1);
  EXPECT_LT(tracing.cables[0].centreline.col(0).minCoeff(), 36);
  EXPECT_GT(tracing.cables[0].centreline.col(0).maxCoeff(), 263);
  const auto reported = std::any_of(tracing.doubts.begin(), tracing.doubts.end(),
                                    [](const DoubtfulZone& doubt) { return doubt.reason == Doubt::different_colors; });
  EXPECT_TRUE(reported);
}

TEST(TraceLines, AStrandContinuesBeneathTwoOthersAndCrossesBoth) {
  Picture picture;
  picture.draw([](int i) { return Vector2(30 + 0.5 * i, 100 + 0.05 * i); }, 480, [](int) { return kBlue; });
  picture.draw([](int i) { return Vector2(140, 20 + 0.5 * i); }, 320, [](int) { return kRed; });
  picture.draw([](int i) { return Vector2(153, 20 + 0.5 * i); }, 320, [](int) { return Rgb{40, 150, 60}; });
  const ColorImage image = picture.image();
  const Tracing tracing = trace_lines(picture.mask, {}, &image);
  ASSERT_EQ(tracing.cables.size(), 3);
  EXPECT_EQ(tracing.crossings.size(), 2);
}

TEST(TraceLines, WavesOnTheBorderAddNoCable) {
  BitImage mask(200, 300);
  for (int x = 30; x < 270; ++x) {
    const double up = 1.5 * std::sin(0.9 * x) + std::sin(2.3 * x + 1),
                 down = 1.5 * std::cos(0.8 * x) + std::sin(2.7 * x);
    for (int y = 0; y < 200; ++y) {
      if (y > 95 + up && y < 105 + down) mask.set(x, y);
      if (x > 50 && x < 250 && std::abs(x - 150 - 0.2 * (y - 100)) < 5 + 0.5 * (up - down)) mask.set(x, y);
    }
  }
  EXPECT_EQ(trace_lines(mask, {}).cables.size(), 2);
}

/// Least energy of all pairings, by trying every partner of the first open end.
double least_energy(const std::vector<double>& singles, const std::vector<PairCandidate>& candidates,
                    std::vector<char>& used) {
  const auto open = std::find(used.begin(), used.end(), 0);
  if (open == used.end()) return 0;
  const int a = static_cast<int>(open - used.begin());
  *open = 1;
  double best = singles[at(a)] + least_energy(singles, candidates, used);
  for (const PairCandidate& pair : candidates) {
    const int b = pair.a == a ? pair.b : (pair.b == a ? pair.a : -1);
    if (b < 0 || used[at(b)]) continue;
    used[at(b)] = 1;
    best = std::min(best, pair.energy + least_energy(singles, candidates, used));
    used[at(b)] = 0;
  }
  used[at(a)] = 0;
  return best;
}

TEST(PairEnds, FindsThePairsOfLeastEnergy) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> energy(0, 3);
  for (int round = 0; round < 200; ++round) {
    const std::vector<double> singles(7, 1.0);
    std::vector<PairCandidate> candidates;
    for (int a = 0; a < 7; ++a) {
      for (int b = a + 1; b < 7; ++b) candidates.push_back({a, b, energy(random)});
    }
    double sum = 7;
    for (const auto& [a, b] : pair_ends(singles, candidates)) {
      const auto pair = std::find_if(candidates.begin(), candidates.end(),
                                     [a = a, b = b](const PairCandidate& c) { return c.a == a && c.b == b; });
      ASSERT_NE(pair, candidates.end());
      sum += pair->energy - 2;
    }
    std::vector<char> used(7, 0);
    EXPECT_NEAR(sum, least_energy(singles, candidates, used), 1e-12);
  }
}

TEST(MatchBranches, PairsOppositeBranchesOfManyLinesThroughAPoint) {
  constexpr int lines = 8;
  std::vector<Branch> branches;
  for (int i = 0; i < 2 * lines; ++i) {
    const double angle = std::numbers::pi * i / lines;
    Branch branch;
    branch.tangent = {-std::cos(angle), -std::sin(angle)};
    branch.point = -30 * branch.tangent;
    branch.half_width = 4;
    branches.push_back(branch);
  }
  const Matching matching = match_branches(branches, 4);
  ASSERT_EQ(matching.pairs.size(), lines);
  for (const auto& [a, b] : matching.pairs) EXPECT_EQ(b - a, lines);
}

}  // namespace
}  // namespace withe
