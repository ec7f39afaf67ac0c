// Springs: exact derivatives under every rule, the work of the discrete gradient, limits of the length.

#include <gtest/gtest.h>

#include "derivative_check.hpp"
#include "forces/spring.hpp"
#include "scenes.hpp"

namespace withe {
namespace {

using testing::derivative_matches;
using testing::MatrixX;
using Vector = Vec3<double>;

constexpr SpringRule kRules[] = {SpringRule::end, SpringRule::middle, SpringRule::mean};
constexpr double kRate = 1.7;  // [1/s]

Vector vec(const VectorX& x) { return {x(0), x(1), x(2)}; }

VectorX pull(const SpringForce<double>& force) {
  const Vector& w = force.direction;
  return force.tension * Vector3(w.x, w.y, w.z);
}

MatrixX matrix(const SpringForce<double>& force) {
  MatrixX out(3, 3);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out(i, j) = force.derivative.row[i][j];
  return out;
}

/// Stretched, pressed, at rest, without a length of its own, a damper alone, all.
std::vector<Spring> springs() {
  return {{3.0, 0.4, 0.0}, {3.0, 2.5, 0.0}, {3.0, 1.0, 0.0}, {3.0, 0.0, 0.0}, {0.0, 0.7, 0.9}, {3.0, 0.7, 0.9}};
}

TEST(SpringForce, DerivativeMatchesFiniteDifferencesUnderEveryRule) {
  testing::RandomNumbers random(3);
  for (const Spring& spring : springs())
    for (SpringRule rule : kRules)
      for (double turned : {0.0, 0.1, 0.8}) {
        const VectorX d0 = random.vector(3).normalized(), d = d0 + turned * random.vector(3);
        const SpringStart<double> start{rule, vec(d0), kRate};
        const auto force = [&](const VectorX& x) { return pull(spring_force(spring, start, vec(x))); };
        EXPECT_TRUE(derivative_matches(force, d, matrix(spring_force(spring, start, vec(d)))))
            << "rule " << static_cast<int>(rule) << ", turned " << turned << ", k " << spring.stiffness << ", L "
            << spring.rest_length;
      }
}

TEST(SpringForce, IsTheGradientOfTheEnergyWhereNothingIsDamped) {
  testing::RandomNumbers random(4);
  for (Spring spring : springs()) {
    spring.damping = 0.0;
    const VectorX d = random.vector(3);
    const auto energy = [&](const VectorX& x) { return spring_energy(spring, x.norm()); };
    if (spring.stiffness == 0.0) continue;
    EXPECT_TRUE(testing::gradient_matches(energy, d, pull(spring_force(spring, SpringStart<double>{}, vec(d)))));
  }
}

TEST(SpringForce, MeanDoesTheWorkThatTheEnergyChangesByAndTheDamperTakes) {
  testing::RandomNumbers random(5);
  for (const Spring& spring : springs())
    for (int k = 0; k < 20; ++k) {
      const VectorX d0 = random.vector(3), d1 = random.vector(3);
      const SpringForce<double> force =
          spring_force(spring, SpringStart<double>{SpringRule::mean, vec(d0), kRate}, vec(0.5 * (d0 + d1)));
      const double before = spring_energy(spring, d0.norm()), after = spring_energy(spring, d1.norm());
      const double grown = d1.norm() - d0.norm(), lost = spring.damping * kRate * grown * grown;
      EXPECT_NEAR(pull(force).dot(d1 - d0), after - before + lost, 1e-13 * (1.0 + before + after));
    }
}

TEST(SpringForce, ADamperNeverGivesUnderTheMidpointRules) {
  testing::RandomNumbers random(6);
  const Spring damper{0.0, 0.7, 0.9};
  for (SpringRule rule : {SpringRule::middle, SpringRule::mean})
    for (int k = 0; k < 50; ++k) {
      const VectorX d0 = random.vector(3), d1 = random.vector(3);
      const SpringForce<double> force = spring_force(damper, {rule, vec(d0), kRate}, vec(0.5 * (d0 + d1)));
      EXPECT_GE(pull(force).dot(d1 - d0), 0.0);
    }
}

TEST(SpringForce, WithoutARestLengthIsLinearDownToNothing) {
  const Spring spring{3.0, 0.0, 0.0};
  for (SpringRule rule : {SpringRule::end, SpringRule::middle})
    for (double size : {1.0, 1e-9, 1e-200, 0.0}) {
      const Vector d{0.3 * size, -0.5 * size, 0.8 * size};
      const SpringForce<double> force = spring_force(spring, {rule, d, kRate}, d);
      const VectorX expected = 3.0 * Vector3(d.x, d.y, d.z);
      EXPECT_LE((pull(force) - expected).norm(), 1e-15 * expected.norm() + 1e-190);
      EXPECT_LT((matrix(force) - 3.0 * MatrixX::Identity(3, 3)).norm(), 1e-14);
    }
}

TEST(SpringForce, IsFiniteWhereNodesMeet) {
  for (const Spring& spring : springs())
    for (SpringRule rule : kRules) {
      const SpringForce<double> force = spring_force(spring, {rule, Vector{}, kRate}, Vector{});
      EXPECT_EQ(pull(force).norm(), 0.0);
      EXPECT_TRUE(matrix(force).allFinite());
    }
}

}  // namespace
}  // namespace withe
