// Packs against the mathematics library.

#define WITHE_INSTRUCTION_SET test_packs
#define WITHE_LANES 2
#include "common/pack.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "common/instruction_set.hpp"

namespace withe {
namespace {

using test_packs::Pack;

constexpr double kUlp = std::numeric_limits<double>::epsilon();

TEST(Pack, SineAndCosineAreThoseOfTheLibraryToAnUlp) {
  std::mt19937 engine(1);
  for (double range : {1e-3, 1.0, 10.0, 1e3, 9e5, 1e12}) {
    std::uniform_real_distribution<double> angle(-range, range);
    for (int i = 0; i < 20000; ++i) {
      const double a = angle(engine), b = angle(engine);
      const auto both = test_packs::sine_cosine(Pack(Pack::Native{a, b}));
      for (int l = 0; l < 2; ++l) {
        const double x = l == 0 ? a : b;
        ASSERT_NEAR(both.sine[l], std::sin(x), 1.5 * kUlp * std::max(std::abs(std::sin(x)), 1e-9)) << x;
        ASSERT_NEAR(both.cosine[l], std::cos(x), 1.5 * kUlp * std::max(std::abs(std::cos(x)), 1e-9)) << x;
      }
    }
  }
}

TEST(Pack, ArctangentIsThatOfTheLibraryInEveryQuadrant) {
  std::mt19937 engine(2);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 100000; ++i) {
    const double y = normal(engine) * std::pow(10.0, i % 7 - 3), x = normal(engine);
    const Pack angle = test_packs::arctangent(Pack(Pack::Native{y, x}), Pack(Pack::Native{x, y}));
    ASSERT_NEAR(angle[0], std::atan2(y, x), 2.0 * kUlp * std::abs(std::atan2(y, x))) << y << " " << x;
    ASSERT_NEAR(angle[1], std::atan2(x, y), 2.0 * kUlp * std::abs(std::atan2(x, y))) << x << " " << y;
  }
  const Pack axes = test_packs::arctangent(Pack(Pack::Native{0.0, -0.0}), Pack(Pack::Native{-1.0, 2.0}));
  EXPECT_EQ(axes[0], std::atan2(0.0, -1.0));
  EXPECT_EQ(axes[1], 0.0);
}

TEST(Pack, RoundsToTheNearestInteger) {
  for (double x : {-2.5, -1.49, -0.2, 0.0, 0.49, 0.51, 7.0, 1e9 + 0.4})
    EXPECT_EQ(test_packs::round_to_integer(Pack(x))[1], std::nearbyint(x)) << x;
}

TEST(Pack, TransposesAndSelects) {
  const Pack in[2] = {Pack(Pack::Native{1.0, 2.0}), Pack(Pack::Native{3.0, 4.0})};
  Pack out[2];
  test_packs::transpose(in, out);
  EXPECT_EQ(out[0][1], 3.0);
  EXPECT_EQ(out[1][0], 2.0);
  EXPECT_EQ(test_packs::smaller(in[0], Pack(1.5))[1], 1.5);
  EXPECT_EQ(test_packs::larger(in[0], Pack(1.5))[1], 2.0);
  EXPECT_EQ(test_packs::absolute(-in[1])[0], 3.0);
  EXPECT_TRUE(test_packs::all(in[0].v < in[1].v));
  EXPECT_FALSE(test_packs::all(in[0].v < Pack(1.5).v));
}

TEST(InstructionSet, IsOneThatHasAName) {
  const std::string name = name_of(instruction_set());
  EXPECT_TRUE(name == "baseline" || name == "avx2");
  const char* asked = std::getenv("WITHE_SIMD");
  EXPECT_EQ(name, asked && *asked ? asked : name);
}

}  // namespace
}  // namespace withe
