#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "vision/bending_fit.hpp"
#include "vision/ground_mask.hpp"
#include "vision/labels.hpp"
#include "vision/thinning.hpp"
#include "vision/tracing.hpp"

namespace withe {
namespace {

BitImage random_image(int height, int width, double density, unsigned seed) {
  std::mt19937 random(seed);
  std::bernoulli_distribution set(density);
  BitImage image(height, width);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (set(random)) image.set(x, y);
    }
  }
  return image;
}

/// Pixels within half a width of a segment.
void draw(BitImage& image, const Vector2& a, const Vector2& b, double width) {
  const Vector2 along = b - a;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const Vector2 p(x, y);
      const double t = (p - a).dot(along) / along.squaredNorm();
      if (t >= 0 && t <= 1 && (p - a - t * along).norm() <= width / 2) image.set(x, y);
    }
  }
}

/// Parts of an image whose pixels touch, corners included.
int components(const BitImage& image) {
  std::vector<char> seen(static_cast<std::size_t>(image.height()) * image.width(), 0);
  int count = 0;
  for (int y0 = 0; y0 < image.height(); ++y0) {
    for (int x0 = 0; x0 < image.width(); ++x0) {
      if (!image.at(x0, y0) || seen[static_cast<std::size_t>(y0) * image.width() + x0]) continue;
      ++count;
      std::vector<Pixel> pending{{x0, y0}};
      seen[static_cast<std::size_t>(y0) * image.width() + x0] = 1;
      while (!pending.empty()) {
        const Pixel p = pending.back();
        pending.pop_back();
        for (int y = p.y - 1; y <= p.y + 1; ++y) {
          for (int x = p.x - 1; x <= p.x + 1; ++x) {
            if (!image.at(x, y) || seen[static_cast<std::size_t>(y) * image.width() + x]) continue;
            seen[static_cast<std::size_t>(y) * image.width() + x] = 1;
            pending.push_back({x, y});
          }
        }
      }
    }
  }
  return count;
}

TEST(BitImage, PackingAndUnpackingGivesTheSamePixelsForEveryWidth) {
  for (int width : {1, 7, 8, 63, 64, 65, 130}) {
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(3 * width));
    std::mt19937 random(7);
    for (auto& pixel : pixels) pixel = random() % 3 == 0 ? 255 : 0;
    std::vector<std::uint8_t> again(pixels.size());
    unpack(pack(pixels.data(), 3, width, width), again.data());
    for (std::size_t i = 0; i < pixels.size(); ++i) ASSERT_EQ(again[i], pixels[i] != 0) << width << " " << i;
  }
}

TEST(BitImage, MajorityDilationAndErosionAgreeWithCountingNeighbours) {
  for (const auto& [height, width] : {std::pair{1, 1}, {1, 70}, {40, 130}, {65, 64}}) {
    const BitImage image = random_image(height, width, 0.55, 3);
    const BitImage smooth = majority(image), wide = dilate(image), narrow = erode(image);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        int repeated = 0, set = 0, inside = 0;
        for (int v = y - 1; v <= y + 1; ++v) {
          for (int u = x - 1; u <= x + 1; ++u) {
            repeated += image.at(std::clamp(u, 0, width - 1), std::clamp(v, 0, height - 1));
            set += image.at(u, v);
            inside += u >= 0 && v >= 0 && u < width && v < height;
          }
        }
        ASSERT_EQ(smooth.at(x, y), repeated >= 5) << x << " " << y;
        ASSERT_EQ(wide.at(x, y), set > 0) << x << " " << y;
        ASSERT_EQ(narrow.at(x, y), set == inside) << x << " " << y;
      }
    }
  }
}

TEST(BitImage, DistanceIsThatToTheNearestBackgroundPixel) {
  const BitImage image = random_image(30, 90, 0.93, 5);
  const PixelIndex index(image);
  for (const Pixel p : index.pixels()) {
    double nearest = 1e9;
    for (int y = 0; y < 30; ++y) {
      for (int x = 0; x < 90; ++x) {
        if (!image.at(x, y)) nearest = std::min(nearest, std::hypot(x - p.x, y - p.y));
      }
    }
    ASSERT_NEAR(distance_to_background(image, p, 1e6, false), nearest, 1e-12);
    EXPECT_EQ(index.pixels()[static_cast<std::size_t>(index(p.x, p.y))], p);
  }
}

TEST(Thinning, LeavesLinesThatAreOnePixelWideAndAsManyPartsAsBefore) {
  BitImage image(120, 200);
  draw(image, {20, 20}, {180, 100}, 9);
  draw(image, {20, 100}, {180, 20}, 11);
  draw(image, {10, 60}, {40, 60}, 5);
  const BitImage skeleton = thin(image);
  EXPECT_EQ(components(skeleton), components(image));
  for (int y = 1; y < 120; ++y) {
    for (int x = 1; x < 200; ++x) {
      EXPECT_FALSE(skeleton.at(x, y) && skeleton.at(x - 1, y) && skeleton.at(x, y - 1) && skeleton.at(x - 1, y - 1));
      EXPECT_TRUE(!skeleton.at(x, y) || image.at(x, y));
    }
  }
  EXPECT_EQ(thin(skeleton), skeleton);
}

TEST(Thinning, DoesNotDependOnWhereWordsBegin) {
  const BitImage image = random_image(50, 100, 0.7, 11);
  const BitImage skeleton = thin(image);
  for (int shift : {1, 17, 63}) {
    BitImage moved(50, 100 + shift);
    const PixelIndex index(image);
    for (const Pixel p : index.pixels()) moved.set(p.x + shift, p.y);
    const BitImage result = thin(moved);
    for (int y = 0; y < 50; ++y) {
      for (int x = 0; x < 100; ++x) ASSERT_EQ(result.at(x + shift, y), skeleton.at(x, y));
    }
  }
}

TEST(BendingFit, KeepsAStraightLineAndBridgesAGapOfACircleSmoothly) {
  std::vector<FitSample> samples;
  const double radius = 80;
  for (int i = 0; i <= 150; ++i) {
    if (i > 60 && i < 90) continue;
    samples.push_back({radius * Vector2(std::cos(i / radius), std::sin(i / radius)), static_cast<double>(i), 1});
  }
  const MatrixX2 line = fit_least_bending(samples, 150, 2, 4, false);
  ASSERT_EQ(line.rows(), 76);
  for (Eigen::Index i = 0; i < line.rows(); ++i) EXPECT_NEAR(line.row(i).norm(), radius, 0.2) << i;
}

TEST(BendingFit, AClosedLineHasNoSeam) {
  std::vector<FitSample> samples;
  const double radius = 40;
  const double length = 2 * 3.14159265358979 * radius;
  for (int i = 0; i < 251; ++i) {
    samples.push_back({radius * Vector2(std::cos(i / radius), std::sin(i / radius)), static_cast<double>(i), 1});
  }
  const MatrixX2 line = fit_least_bending(samples, length, 2, 4, true);
  for (Eigen::Index i = 0; i < line.rows(); ++i) EXPECT_NEAR(line.row(i).norm(), radius, 0.1) << i;
  EXPECT_NEAR((line.row(0) - line.row(line.rows() - 1)).norm(), length / static_cast<double>(line.rows()), 0.05);
}

TEST(Tracing, TwoCablesThatCrossAreTwoLinesWithOneCrossing) {
  for (const double degrees : {90.0, 50.0, 25.0}) {
    BitImage mask(300, 400);
    const Vector2 center(200, 150);
    const double half = degrees * 3.14159265358979 / 360;
    const Vector2 up(std::cos(half), std::sin(half));
    const Vector2 down(std::cos(half), -std::sin(half));
    draw(mask, center - 120 * up, center + 120 * up, 9);
    draw(mask, center - 120 * down, center + 120 * down, 11);
    const Tracing tracing = trace_lines(mask, {});
    ASSERT_EQ(tracing.cables.size(), 2U) << degrees;
    ASSERT_EQ(tracing.crossings.size(), 1U) << degrees;
    EXPECT_LT((tracing.crossings[0].point - center).norm(), 2) << degrees;
    for (const Cable& cable : tracing.cables) {
      const bool rising = (cable.centreline(0, 1) > 150) == (cable.centreline(0, 0) > 200);
      const Vector2 direction = rising ? up : down;
      for (Eigen::Index i = 0; i < cable.centreline.rows(); ++i) {
        const Vector2 d = cable.centreline.row(i).transpose() - center;
        EXPECT_LT(std::abs(d.x() * direction.y() - d.y() * direction.x()), 1.2) << degrees;
      }
      EXPECT_NEAR((cable.centreline.row(0) - cable.centreline.bottomRows(1)).norm(), 240, 6);
      EXPECT_NEAR(cable.widths[10], rising ? 9 : 11, 1.2);
    }
  }
}

TEST(Tracing, ACableThatEndsOnAnotherIsAJointHalfAWidthFromItsCentreline) {
  BitImage mask(300, 400);
  draw(mask, {50, 150}, {350, 150}, 10);
  draw(mask, {200, 155}, {200, 280}, 10);
  const Tracing tracing = trace_lines(mask, {});
  ASSERT_EQ(tracing.cables.size(), 2U);
  ASSERT_EQ(tracing.joints.size(), 1U);
  EXPECT_EQ(tracing.crossings.size(), 0U);
  EXPECT_NEAR(tracing.joints[0].point.x(), 200, 1.5);
  EXPECT_NEAR(tracing.joints[0].point.y(), 155, 1.5);
  const CableRow through = tracing.joints[0].through;
  EXPECT_NE(tracing.joints[0].end.cable, through.cable);
  EXPECT_NEAR(tracing.cables[static_cast<std::size_t>(through.cable)].centreline(through.row, 0), 200, 2);
}

TEST(Tracing, GapsUpToFourWidthsAreBridgedAndWiderOnesAreNot) {
  for (const auto& [gap, cables] : {std::pair{10, 1U}, {24, 1U}, {36, 1U}, {56, 2U}}) {
    BitImage mask(100, 400);
    draw(mask, {30, 50}, {200, 50}, 10);
    draw(mask, {200.0 + gap, 50}, {370, 50}, 10);
    EXPECT_EQ(trace_lines(mask, {}).cables.size(), cables) << gap;
  }
}

TEST(Tracing, GapsAboveSixteenPixelsNeedEndsThatFaceEachOther) {
  for (const auto& [aside, cables] : {std::pair{0, 1U}, {4, 1U}, {14, 2U}}) {
    BitImage mask(120, 400);
    draw(mask, {30, 50}, {200, 50}, 10);
    draw(mask, {224, 50.0 + aside}, {370, 50.0 + aside}, 10);
    EXPECT_EQ(trace_lines(mask, {}).cables.size(), cables) << aside;
  }
}

TEST(BitImage, SpecksAreRegionsOfFewPixelsAlsoThroughCorners) {
  BitImage mask(20, 150);
  for (int i = 0; i < 12; ++i) mask.set(60 + i, 3 + i);  // touch at corners only, and lie in two words
  for (int i = 0; i < 11; ++i) mask.set(100 + i, 2);
  const BitImage left = without_specks(mask, 12);
  EXPECT_EQ(left.count(), 12U);
  EXPECT_TRUE(left.at(60, 3));
}

TEST(Labels, TheLabelledShareIgnoresSpecksUnlessThereIsNothingElse) {
  BitImage mask(100, 200);
  std::vector<std::int32_t> labels(100 * 200, 0);
  EXPECT_EQ(labelled_share(mask, labels.data()), 1.0);
  mask.set(5, 5);
  EXPECT_EQ(labelled_share(mask, labels.data()), 0.0);
  for (int y = 40; y < 50; ++y) {
    for (int x = 20; x < 120; ++x) {
      mask.set(x, y);
      labels[static_cast<std::size_t>(200 * y + x)] = x < 70 ? 1 : 0;
    }
  }
  EXPECT_DOUBLE_EQ(labelled_share(mask, labels.data()), 0.5);
}

TEST(GroundMask, ALineOfAnotherColourIsFoundAndItsShadowIsNot) {
  constexpr int height = 120;
  constexpr int width = 200;
  std::vector<std::uint8_t> pixels(3 * height * width);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double light = (y >= 60 && y < 70 ? 0.5 : 1.0) * (0.8 + 0.2 * x / width);  // a shadow below the line
      const bool line = y >= 50 && y < 60;
      for (int c = 0; c < 3; ++c) {
        const double level = line ? (c == 0 ? 180.0 : 50.0) : 190.0 * light;
        pixels[static_cast<std::size_t>(3 * (width * y + x) + c)] = static_cast<std::uint8_t>(level);
      }
    }
  }
  std::vector<std::uint8_t> mask(height * width);
  ground_mask({pixels.data(), height, width, 3 * width}, 25, mask.data());
  for (const auto& [y, found] : {std::pair{30, 0}, {55, 1}, {65, 0}, {90, 0}}) {
    EXPECT_EQ(static_cast<int>(mask[static_cast<std::size_t>(width * y + 100)]), found) << y;
  }
}

TEST(Tracing, TwoTipsThatTouchAreNotOneCable) {
  BitImage mask(200, 300);
  draw(mask, {50, 90}, {180, 100}, 9);
  draw(mask, {50, 112}, {180, 102}, 9);
  const Tracing tracing = trace_lines(mask, {});
  EXPECT_EQ(tracing.cables.size(), 2U);
}

TEST(Labels, EveryPixelOfTheMaskHasTheLabelOfItsCable) {
  BitImage mask(200, 300);
  draw(mask, {20, 50}, {280, 50}, 9);
  draw(mask, {20, 120}, {280, 150}, 9);
  const Tracing tracing = trace_lines(mask, {});
  ASSERT_EQ(tracing.cables.size(), 2U);
  std::vector<std::int32_t> labels(200 * 300, 0);
  paint_labels(mask, tracing, labels.data());
  const int upper = tracing.cables[0].centreline(0, 1) < 80 ? 1 : 2;
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 300; ++x) {
      const int expected = !mask.at(x, y) ? 0 : (y < 80 ? upper : 3 - upper);
      ASSERT_EQ(labels[static_cast<std::size_t>(y * 300 + x)], expected) << x << " " << y;
    }
  }
}

}  // namespace
}  // namespace withe
