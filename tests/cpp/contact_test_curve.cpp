// Distance of an obstacle from the smooth curve of a rod: derivatives, continuity along the curve, and how near it is
// to the arc that its nodes stand for.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "contact/curve.hpp"
#include "geometry/distance_field.hpp"
#include "geometry/tube.hpp"
#include "scenes.hpp"

namespace withe {
namespace {

using testing::RandomNumbers;

Vec3d random_point(RandomNumbers& random) { return {random.normal(), random.normal(), random.normal()}; }

/// Two curves about the nodes, in a channel of radius 1.
Tube bent_tube() {
  return {{{-2.5, 0.2, 0.1}, {0.0, 0.0, -0.2}, {2.5, 0.1, 0.3}}, {{-1.25, 0.1, -0.3}, {1.25, -0.1, -0.1}}, 1.0, 0.2};
}

/// About the distance from a sphere of radius 2 below the nodes.
DistanceField round_field() {
  const int n = 9;
  std::vector<double> values;
  for (int i = -1; i <= n; ++i)
    for (int j = -1; j <= n; ++j)
      for (int k = -1; k <= n; ++k) values.push_back(std::hypot(i - 4.0, j - 4.0, k - 1.0) - 2.0);
  return {values, {n, n, n}, {-4.0, -4.0, -3.0}, {1.0, 1.0, 1.0}};
}

Obstacle random_obstacle(RandomNumbers& random, int kind) {
  Obstacle o;
  o.radius = 2.0;
  if (kind == 0) {
    const Vec3d n = Vec3d{0.0, 0.0, 1.0} + 0.3 * random_point(random);
    o.other = (1.0 / std::sqrt(dot(n, n))) * n;
    return o;
  }
  if (kind > 2) {
    static const Tube tube = bent_tube();
    static const DistanceField field = round_field();
    o.kind = ObstacleKind::shape;
    o.point = 0.1 * random_point(random);
    o.shape = kind == 3 ? static_cast<const Shape*>(&tube) : &field;
    o.radius = o.shape->radius();
    return o;
  }
  o.kind = ObstacleKind::capsule;
  o.point = Vec3d{0.0, 0.0, -2.0} + 0.3 * random_point(random);
  o.other = kind == 1 ? o.point : o.point + random_point(random);
  return o;
}

/// Straight, bent to and from the obstacle.
void random_nodes(RandomNumbers& random, Vec3d (&x)[3]) {
  const double bent = 0.3 * random.normal();
  for (int i = 0; i < 3; ++i) x[i] = Vec3d{i - 1.0, 0.0, 0.2 + bent * (i - 1) * (i - 1)} + 0.05 * random_point(random);
}

TEST(CurveDistance, DerivativesAreThoseOfTheDistance) {
  RandomNumbers random(3);
  const CurveWeights* weights[] = {&kCurveInside, &kCurveStart, &kCurveEnd, &kCurveFirst, &kCurveLast};
  int free = 0;
  for (int k = 0; k < 500; ++k) {
    const CurvePiece piece{.weights = weights[k % 5], .least_bend = 0.02};
    const Obstacle o = random_obstacle(random, k / 5 % 5);
    Vec3d x[3];
    random_nodes(random, x);
    const auto distance = [&](const double (&q)[9]) {
      Vec3d p[3];
      for (int i = 0; i < 3; ++i) p[i] = {q[3 * i], q[3 * i + 1], q[3 * i + 2]};
      return curve_distance(piece, o, p);
    };
    double q[9];
    for (int i = 0; i < 9; ++i) q[i] = x[i / 3][i % 3];
    const CurveDistance<double> d = distance(q);
    const CurveSlopes slopes = curve_slopes(piece, d);
    free += d.free;
    double hessian[9][9] = {};
    add_curve_hessian(piece, o, d, slopes, 1.0, 9, &hessian[0][0]);
    const double h = 1e-6;
    for (int j = 0; j < 9; ++j) {
      double up[9], down[9];
      std::copy(q, q + 9, up);
      std::copy(q, q + 9, down);
      up[j] += h;
      down[j] -= h;
      const CurveDistance<double> above = distance(up), below = distance(down);
      EXPECT_NEAR(slopes.distance[j], (above.distance - below.distance) / (2.0 * h), 1e-7) << k;
      if (above.free != below.free) continue;
      EXPECT_NEAR(slopes.s[j], (above.s - below.s) / (2.0 * h), 1e-6 * (1.0 + std::abs(slopes.s[j]))) << k;
      const CurveSlopes high = curve_slopes(piece, above), low = curve_slopes(piece, below);
      for (int i = 0; i < 9; ++i)
        EXPECT_NEAR(hessian[i][j], (high.distance[i] - low.distance[i]) / (2.0 * h),
                    1e-6 * (1.0 + std::abs(hessian[i][j])))
            << k;
    }
  }
  EXPECT_GT(free, 50);
  EXPECT_LT(free, 450);
}

TEST(CurveDistance, GoesOnSmoothlyFromPieceToPieceOfAnEvenlyBentRod) {
  const double turn = 0.3;
  Vec3d x[4];
  for (int i = 0; i < 4; ++i) x[i] = {std::sin(turn * i), 0.0, std::cos(turn * i)};
  const Vec3d a = curve_point(kCurveInside, x, 0.5), b = curve_point(kCurveInside, x + 1, -0.5);
  EXPECT_NEAR(dot(a, a), dot(b, b), 1e-15);
  EXPECT_LT(std::sqrt(dot(a - b, a - b)), turn * turn * turn / 7.0);
  Vec3d first{}, second{};
  for (int i = 0; i < 3; ++i) {
    first += (kCurveInside.slope[i] + 0.5 * kCurveInside.bend[i]) * x[i];
    second += (kCurveInside.slope[i] - 0.5 * kCurveInside.bend[i]) * x[i + 1];
  }
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(first[k], second[k], 1e-15);  // both that of the edge between
}

TEST(CurveDistance, OfAnArcConvergesWithTheFourthPowerOfAnEdge) {
  double last = 0.0;
  for (int n : {8, 16, 32, 64}) {
    const double turn = 2.0 * std::numbers::pi / n;
    Vec3d x[3];
    for (int i = 0; i < 3; ++i) x[i] = {std::sin(turn * (i - 1)), 0.0, std::cos(turn * (i - 1))};
    double worst = 0.0;
    for (double s : {-0.5, -0.3, 0.0, 0.2, 0.5}) {
      const Vec3d c = curve_point(kCurveInside, x, s);
      worst = std::max(worst, std::abs(std::sqrt(dot(c, c)) - 1.0));
    }
    if (last > 0.0) {
      EXPECT_GT(std::log2(last / worst), 3.85);
    }
    last = worst;
  }
  EXPECT_LT(last, 3e-6);
}

TEST(CurveDistance, IsThatOfAStraightRodFromAPlane) {
  const Vec3d x[3] = {{-1.0, 0.0, 0.3}, {0.0, 0.0, 0.3}, {1.0, 0.0, 0.3}};
  const Obstacle floor{.other = {0.0, 0.0, 1.0}};
  for (const CurveWeights* weights : {&kCurveInside, &kCurveStart, &kCurveEnd, &kCurveFirst, &kCurveLast}) {
    const CurvePiece piece{.weights = weights, .least_bend = 1e-3};
    const CurveDistance<double> d = curve_distance(piece, floor, x);
    EXPECT_NEAR(d.distance, 0.3, 1e-15);
    EXPECT_NEAR(d.s, 0.0, 1e-12);  // and presses about its middle
  }
}

}  // namespace
}  // namespace withe
