// The Jacobian of friction, derived by hand, against dual numbers through the forces themselves, for every class of
// contact, law and dimension.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "contact/friction_jacobian.hpp"
#include "scenes.hpp"

namespace withe {
namespace {

using testing::RandomNumbers;

constexpr int kN = kContactUnknowns;

/// The last three are touched by a curve.
enum class Other { rod, sphere, capsule, beside_plane, beside_sphere, beside_capsule };

bool curved(Other other) { return other >= Other::beside_plane; }

/// A contact somewhere within a step, its frames turned and its surfaces slipped.
struct Touch {
  ContactPair pair;
  Obstacle obstacle;
  FrictionSetting setting;
  double now[kN] = {};
};

Vec3d random_point(RandomNumbers& random, bool planar) {
  return {random.normal(), random.normal(), planar ? 0.0 : random.normal()};
}

/// Edges that are nearly parallel in one case of six, with centrelines that are apart.
void place(RandomNumbers& random, Other other, bool planar, Touch& c, Vec3d (&x)[4]) {
  c.pair.rod_b = other == Other::rod ? 0 : -1;
  c.pair.weight_a = 0.01;
  c.pair.weight_b = 0.02;
  do {
    for (Vec3d& p : x) p = random_point(random, planar);
    if (random.normal() > 1.0) x[3] = x[2] + x[1] - x[0] + 0.05 * random_point(random, planar);
    if (other == Other::sphere) x[3] = x[2];
    c.setting.points = closest_points(x[0], x[1], x[2], x[3], c.pair.weight_a, c.pair.weight_b);
  } while (dot(c.setting.points.between, c.setting.points.between) < 0.04);
}

/// Makes surfaces thick enough to touch.
void press(Touch& c) {
  ContactPair& pair = c.pair;
  double distance = std::sqrt(c.setting.points.square);
  pair.radius_a = 0.42 * distance;
  pair.radius_b = 0.6 * distance;
  pair.tolerance = 0.1 * distance;
  pair.friction = 0.4;
}

/// Moves, turns and spins edges since the start of the step; an obstacle has its way.
void slip(RandomNumbers& random, const Vec3d (&x)[4], Touch& c) {
  FrictionSetting& f = c.setting;
  const bool rods = c.pair.rod_b >= 0, planar = !f.spatial;
  for (int i = 0; i < 4; ++i) {
    const bool moves = c.pair.curve() ? i < c.pair.piece.weights->nodes : rods || i < 2;
    const Vec3d start = x[i] + (moves ? 0.1 : 0.0) * random_point(random, planar);
    const double now[3] = {x[i].x, x[i].y, x[i].z}, before[3] = {start.x, start.y, start.z};
    std::copy(now, now + 3, c.now + 3 * i);
    std::copy(before, before + 3, f.start + 3 * i);
  }
  if (!rods) f.drift = 0.05 * random_point(random, planar);
  if (!rods) f.turn = planar ? Vec3d{0.0, 0.0, 0.2 * random.normal()} : 0.2 * random_point(random, planar);
  if (!rods) {
    const auto drawn = [&random] { return random.normal() > 0.0 ? 0.4 : 0.15; };
    c.pair.set_friction(drawn(), drawn(), 0.4);
  }
  f.stick = 0.03 * random_point(random, planar);
  if (planar) return;
  for (int b : {0, 1}) {
    c.now[12 + b] = random.normal();
    f.start[12 + b] = c.now[12 + b] + 0.1 * random.normal();
    const Vec3d source = random_point(random, planar);
    f.source[b] = (1.0 / std::sqrt(dot(source, source))) * source;
  }
}

/// A piece of a curve that bends beside an obstacle, its radius about as great as the distance.
void place_piece(RandomNumbers& random, Other other, bool planar, Touch& c, Vec3d (&x)[4]) {
  const CurveWeights* weights[] = {&kCurveInside, &kCurveInside, &kCurveStart, &kCurveEnd, &kCurveFirst, &kCurveLast};
  c.pair.piece.weights = weights[static_cast<int>(6.0 * std::abs(random.normal())) % 6];
  c.pair.piece.least_bend = 0.05;
  const double bent = random.normal();
  for (int i = 0; i < 4; ++i) {
    x[i] = Vec3d{i - 1.0, 1.0 + 0.2 * bent * (i - 1) * (i - 1), 0.0} + 0.1 * random_point(random, planar);
    if (i >= c.pair.piece.weights->nodes) x[i] = Vec3d{};
  }
  c.obstacle.radius = 3.0;
  if (other == Other::beside_plane) {
    c.obstacle.other = (1.0 / std::sqrt(1.01)) * Vec3d{0.1, 1.0, 0.0};
    c.setting.points.square = 1.0;
    return;
  }
  c.obstacle.kind = ObstacleKind::capsule;
  c.obstacle.point = Vec3d{0.0, -2.0, 0.0} + 0.3 * random_point(random, planar);
  c.obstacle.other = c.obstacle.point;
  if (other == Other::beside_capsule) c.obstacle.other += random_point(random, planar);
  c.setting.points.square = 1.0;
}

void random_touch(RandomNumbers& random, Other other, FrictionLaw law, bool planar, bool rolling, Touch& c) {
  FrictionSetting& f = c.setting;
  Vec3d x[4];
  if (curved(other))
    place_piece(random, other, planar, c, x);
  else
    place(random, other, planar, c, x);
  press(c);
  // The distance decides if the curve presses.
  if (curved(other)) c.pair.radius_a = 0.3 + curve_distance(c.pair.piece, c.obstacle, x).distance - c.pair.radius_b;
  f.pair = &c.pair;
  f.obstacle = other == Other::rod ? nullptr : &c.obstacle;
  f.law = law;
  f.spatial = !planar;
  f.centreline = random.normal() > 0.0 && !rolling;
  f.middle = other == Other::rod && random.normal() > 0.0;
  f.finite_turns = !planar && random.normal() > 0.0;
  f.pressing = {ContactLaw::imcv2, c.pair.radii(), c.pair.tolerance, 40.0, 0.01 * c.pair.tolerance};
  f.tangential_stiffness = random.normal() > 0.0 ? 1.0 : 100.0;
  f.rate = 3.0;
  slip(random, x, c);
  f.friction = c.pair.friction;
  f.isotropic = rolling || c.pair.isotropic();
  f.rolling = rolling;
  if (rolling) f.drift = f.turn = Vec3d{};
}

std::string class_of(const Touch& c, const FrictionForce<double>& friction) {
  const FrictionSetting& f = c.setting;
  std::string name = f.law == FrictionLaw::implicit ? "implicit" : friction.sticking ? "sticking" : "slipping";
  name += f.centreline ? ", centreline" : "";
  name += f.middle ? ", in the middle" : "";
  if (f.pair->curve()) {
    const Vec3d x[3] = {{c.now[0], c.now[1], c.now[2]}, {c.now[3], c.now[4], c.now[5]}, {c.now[6], c.now[7], c.now[8]}};
    const CurveDistance<double> d = curve_distance(f.pair->piece, c.obstacle, x);
    name += d.free ? ", s free" : "";
    return name + (f.pair->piece.weights == &kCurveInside ? ", inside" : ", at an end");
  }
  name += f.points.s_free ? ", s free" : "";
  return name + (f.points.t_free ? ", t free" : "");
}

using Matrix = Eigen::Matrix<double, kN, kN>;

Matrix by_dual_numbers(const Touch& c) {
  using Dual14 = Dual<kN>;
  Dual14 unknown[kN], gradient[kN];
  for (int i = 0; i < kN; ++i) unknown[i] = Dual14::unknown(c.now[i], i);
  friction_gradient(c.setting, unknown, gradient);
  Matrix J;
  for (int i = 0; i < kN; ++i)
    for (int j = 0; j < kN; ++j) J(i, j) = gradient[i].slope[j];
  return J;
}

Matrix by_hand(const Touch& c) {
  double jacobian[kN][kN] = {};
  add_friction_jacobian(c.setting, slipping_surfaces(c.setting, c.now), jacobian);
  Matrix J;
  for (int i = 0; i < kN; ++i)
    for (int j = 0; j < kN; ++j) J(i, j) = jacobian[i][j];
  return J;
}

/// Compares random contacts; returns how many classes there were.
std::size_t compare(Other other, FrictionLaw law, bool planar, bool rolling) {
  RandomNumbers random(11);
  std::set<std::string> seen;
  for (int k = 0; k < 1000; ++k) {
    Touch c;
    random_touch(random, other, law, planar, rolling, c);
    Matrix expected = by_dual_numbers(c);
    if (c.pair.curve()) {  // nodes that are not there, and in a plane what leads out of it
      for (int i = 0; i < kN; ++i) {
        const bool there = i < 12 ? i < 3 * c.pair.piece.weights->nodes && (!planar || i % 3 < 2)
                                  : !planar && i - 12 < c.pair.piece.weights->edges;
        if (!there) expected.col(i).setZero();
      }
    } else if (other != Other::rod) {  // an obstacle has no unknowns
      expected.middleCols<6>(6).setZero();
      expected.col(13).setZero();
    }
    double unused[kN] = {};
    const std::string name = class_of(c, friction_gradient(c.setting, c.now, unused));
    EXPECT_LT((by_hand(c) - expected).cwiseAbs().maxCoeff(), 1e-11 * expected.cwiseAbs().maxCoeff())
        << name << ", case " << k;
    seen.insert(name);
  }
  return seen.size();
}

/// Surfaces or centrelines that slip under the implicit law, and hold or slip under that with anchors.
void expect_dual_numbers(Other other, bool planar, std::size_t classes) {
  EXPECT_EQ(compare(other, FrictionLaw::implicit, planar, false), 2 * classes);
  EXPECT_EQ(compare(other, FrictionLaw::anchored, planar, false), 4 * classes);
  if (other == Other::rod) return;  // rods roll freely on each other
  EXPECT_EQ(compare(other, FrictionLaw::implicit, planar, true), classes);
  EXPECT_EQ(compare(other, FrictionLaw::anchored, planar, true), 2 * classes);
}

class FrictionJacobian : public ::testing::TestWithParam<bool> {};

/// A setting for `force_law`.
FrictionSetting law_setting(const ContactPair& pair, FrictionLaw law) {
  FrictionSetting f;
  f.pair = &pair;
  f.friction = pair.friction;
  f.law = law;
  f.rate = 3.0;
  f.tangential_stiffness = 40.0;
  return f;
}

TEST(ForceLaw, ForeseesTheForceOfTheLinearEquationsOfForceAndSlip) {
  // F / g(|S|^2) - S = 0, linear in changes of F and S, at an F that is not that of S
  ContactPair pair;
  pair.friction = 0.5;
  const double pressing = 2.0, limit = pair.friction * pressing, small = 1e-6;
  const Vec3d slip{0.4, -0.3, 0.1}, change{-0.02, 0.03, 0.01}, share{0.1, 0.2, -0.3};
  for (FrictionLaw law : {FrictionLaw::implicit, FrictionLaw::anchored}) {
    const FrictionSetting f = law_setting(pair, law);
    const auto inverse = [&](const Vec3d& s) { return 1.0 / force_law(f, pressing, dot(s, s), false).factor; };
    const ForceLaw g = force_law(f, pressing, dot(slip, slip), false);
    const Vec3d force = limit * g.predict(slip, change, &share, limit);
    const double turned = (inverse(slip + small * change) - inverse(slip - small * change)) / (2.0 * small);
    const Vec3d unbalanced = inverse(slip) * force + (turned * limit) * share - slip - change;
    EXPECT_LT(std::sqrt(dot(unbalanced, unbalanced)), 1e-8) << static_cast<int>(law);
  }
}

TEST(ForceLaw, ForeseesNoMoreThanTheLimitAndHoldsWhatIsForeseenToStop) {
  ContactPair pair;
  pair.friction = 0.5;
  const double pressing = 2.0, limit = pair.friction * pressing;
  const Vec3d slip{3.0, 0.0, 0.0}, none{};
  const ForceLaw g = force_law(law_setting(pair, FrictionLaw::implicit), pressing, dot(slip, slip), false);
  const Vec3d most = g.predict(slip, 100.0 * slip, &none, limit);
  EXPECT_NEAR(std::sqrt(dot(most, most)), 1.0, 1e-12);
  const auto stiffness = [&](const Vec3d* predicted) {
    return g.factor + 2.0 * g.by_square * dot(slip, g.dual_slip(slip, predicted, limit));
  };
  EXPECT_LT(stiffness(nullptr), 1e-6 * g.factor);  // that of the law: it slips
  EXPECT_EQ(stiffness(&none), g.factor);           // a chord to the origin
}

INSTANTIATE_TEST_SUITE_P(InSpaceAndInAPlane, FrictionJacobian, ::testing::Bool());

TEST_P(FrictionJacobian, OfTwoRodsIsThatOfDualNumbers) { expect_dual_numbers(Other::rod, GetParam(), 8); }

TEST_P(FrictionJacobian, OfAnObstacleIsThatOfDualNumbers) {
  expect_dual_numbers(Other::sphere, GetParam(), 2);
  expect_dual_numbers(Other::capsule, GetParam(), 4);
}

TEST_P(FrictionJacobian, OfACurveBesideAnObstacleIsThatOfDualNumbers) {
  expect_dual_numbers(Other::beside_plane, GetParam(), 4);
  expect_dual_numbers(Other::beside_sphere, GetParam(), 4);
  expect_dual_numbers(Other::beside_capsule, GetParam(), 4);
}

}  // namespace
}  // namespace withe
