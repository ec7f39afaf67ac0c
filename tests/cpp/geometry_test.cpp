// Frames, curvature, rotations, and the derivative check itself.

#include <gtest/gtest.h>

#include <random>

#include "derivative_check.hpp"
#include "geometry/curvature.hpp"
#include "geometry/frames.hpp"
#include "geometry/rotation.hpp"

namespace withe {
namespace {

using testing::derivative_matches;
using testing::gradient_matches;
using testing::MatrixX;
using Vec3d = Vec3<double>;

constexpr double kPi = 3.14159265358979323846;

Vec3d vec(const Vector3& v) { return {v.x(), v.y(), v.z()}; }
Vector3 eigen(const Vec3d& v) { return {v.x, v.y, v.z}; }

struct Random {
  std::mt19937 engine{7};
  std::normal_distribution<double> normal;
  Vector3 vector() { return {normal(engine), normal(engine), normal(engine)}; }
  Vector3 unit() { return vector().normalized(); }
};

Vector3 transported(const Vector3& d, const Vector3& from, const Vector3& to) {
  return eigen(parallel_transport(vec(d), vec(from), vec(to)));
}

TEST(DerivativeCheck, AcceptsTheDerivativeOfASine) {
  const VectorX x = VectorX::LinSpaced(3, 0.3, 1.7);
  const MatrixX J = x.array().cos().matrix().asDiagonal();
  EXPECT_TRUE(derivative_matches([](const VectorX& y) { return VectorX(y.array().sin()); }, x, J));
}

TEST(DerivativeCheck, NoticesARelativeErrorOfOneInAMillion) {
  const VectorX x = VectorX::LinSpaced(3, 0.3, 1.7);
  MatrixX J = x.array().cos().matrix().asDiagonal();
  J(0, 2) += 1e-6;
  EXPECT_FALSE(derivative_matches([](const VectorX& y) { return VectorX(y.array().sin()); }, x, J));
}

TEST(DerivativeCheck, NoticesAKink) {
  const VectorX x = VectorX::Constant(1, 1e-4);
  const auto kink = [](const VectorX& y) { return VectorX::Constant(1, y(0) + 0.1 * std::abs(y(0))); };
  EXPECT_FALSE(derivative_matches(kink, x, MatrixX::Constant(1, 1, 1.1)));
}

TEST(ParallelTransport, IsTheSmallestRotationBetweenTheTangents) {
  Random random;
  for (int k = 0; k < 20; ++k) {
    const Vector3 from = random.unit(), to = random.unit();
    const Vector3 d = from.cross(random.unit()).normalized();
    const Matrix3 R = Eigen::Quaterniond::FromTwoVectors(from, to).toRotationMatrix();
    EXPECT_LT((transported(d, from, to) - R * d).norm(), 1e-12);
  }
}

TEST(ParallelTransport, KeepsLengthAndStaysNormalToTheTangent) {
  Random random;
  for (int k = 0; k < 20; ++k) {
    const Vector3 from = random.unit(), to = random.unit();
    const Vector3 d = from.cross(random.unit()).normalized(), out = transported(d, from, to);
    EXPECT_NEAR(out.norm(), 1.0, 1e-13);
    EXPECT_NEAR(out.dot(to), 0.0, 1e-13);
  }
}

TEST(ParallelTransport, UndoesItselfOnTheWayBack) {
  Random random;
  const Vector3 from = random.unit(), to = random.unit(), d = from.cross(random.unit()).normalized();
  EXPECT_LT((transported(transported(d, from, to), to, from) - d).norm(), 1e-13);
}

TEST(ParallelTransport, RoundAnOctantTurnsByItsSolidAngle) {
  const Vector3 x = Vector3::UnitX(), y = Vector3::UnitY(), z = Vector3::UnitZ();
  const Vector3 back = transported(transported(transported(y, x, y), y, z), z, x);
  EXPECT_NEAR(signed_angle(vec(y), vec(back), vec(x)), 0.5 * kPi, 1e-13);
}

TEST(SignedAngle, IsPositiveAboutItsAxis) {
  const Vector3 axis = Vector3(1, 2, -1).normalized(), d = axis.unitOrthogonal();
  for (double angle : {-3.0, -0.4, 0.0, 1.2, 3.1}) {
    const Vector3 turned = Eigen::AngleAxisd(angle, axis) * d;
    EXPECT_NEAR(signed_angle(vec(d), vec(turned), vec(axis)), angle, 1e-13);
  }
}

/// The frame of an edge e whose source tangent is `source`.
EdgeFrame<double> frame_of(const Vector3& e, const Vector3& source, const Vector3& reference, double theta) {
  return edge_frame(vec(e), e.norm(), vec(source), vec(reference), std::cos(theta), std::sin(theta));
}

TEST(EdgeFrame, IsARightHandedTriadAlongTheEdge) {
  Random random;
  for (int k = 0; k < 20; ++k) {
    const Vector3 source = random.unit(), e = 2.0 * random.vector();
    const auto f = frame_of(e, source, source.unitOrthogonal(), random.normal(random.engine));
    Matrix3 m;
    m << eigen(f.d1), eigen(f.d2), eigen(f.tangent);
    EXPECT_LT((m.transpose() * m - Matrix3::Identity()).norm(), 1e-12);
    EXPECT_NEAR(m.determinant(), 1.0, 1e-12);
    EXPECT_LT((m.col(2) - e.normalized()).norm(), 1e-14);
  }
}

TEST(EdgeFrame, ThetaTurnsTheDirectorsAboutTheTangent) {
  const Vector3 source = Vector3::UnitX(), e(1.0, 0.7, -0.4), reference = Vector3::UnitY();
  const auto zero = frame_of(e, source, reference, 0.0), turned = frame_of(e, source, reference, 0.9);
  EXPECT_NEAR(signed_angle(zero.d1, turned.d1, zero.tangent), 0.9, 1e-13);
}

/// Angle by which the directors of `e + change` lead those of `e` carried there by parallel transport, which over
/// a small change is infinitesimal transport to third order.
double lead(const Vector3& e, const Vector3& change, const Vector3& source) {
  const Vector3 reference = source.unitOrthogonal();
  const auto from = frame_of(e, source, reference, 0.3), to = frame_of(e + change, source, reference, 0.3);
  return signed_angle(parallel_transport(from.d1, from.tangent, to.tangent), to.d1, to.tangent);
}

TEST(EdgeFrame, SpinIsTheDerivativeOfTheDirectorsTurn) {
  Random random;
  for (int k = 0; k < 10; ++k) {
    const Vector3 source = random.unit();
    const Vector3 e = 1.4 * (source + 0.9 * random.unit());
    const auto f = frame_of(e, source, source.unitOrthogonal(), 0.3);
    EXPECT_TRUE(
        gradient_matches([&](const VectorX& d) { return lead(e, d, source); }, VectorX::Zero(3), eigen(f.spin)));
  }
}

TEST(EdgeFrame, SpinVanishesWhereTheEdgeIsItsOwnSource) {
  const Vector3 e(0.3, -0.5, 1.1);
  const auto f = frame_of(e, e.normalized(), e.unitOrthogonal(), 0.2);
  EXPECT_LT(eigen(f.spin).norm(), 1e-15);
}

TEST(EdgeFrame, BowGivesTheSymmetricDerivativeOfTheSpin) {
  Random random;
  for (int k = 0; k < 10; ++k) {
    const Vector3 source = random.unit();
    const Vector3 e = 1.4 * (source + 0.9 * random.unit());
    const Vector3 reference = source.unitOrthogonal();
    const auto f = frame_of(e, source, reference, 0.0);
    const Vector3 spin = eigen(f.spin), bow = eigen(f.bow);
    // Derivative of the spin: a symmetric part from bow, and the curvature of parallel transport, t / (2 l^2).
    const MatrixX symmetric = -0.5 * (spin * bow.transpose() + bow * spin.transpose());
    const auto spin_at = [&](const VectorX& x) { return VectorX(eigen(frame_of(x, source, reference, 0.0).spin)); };
    MatrixX J(3, 3);
    const MatrixX estimate = testing::central_difference(spin_at, e, 1e-5);
    J = symmetric + 0.5 * (estimate - estimate.transpose());
    EXPECT_TRUE(derivative_matches(spin_at, e, J));
    const MatrixX antisymmetric = 0.5 * (estimate - estimate.transpose());
    const Vector3 t = e.normalized();
    EXPECT_LT((antisymmetric.cwiseAbs() - 0.5 / e.squaredNorm() * cross_matrix(t).cwiseAbs()).norm(), 1e-8);
  }
}

EdgeFrame<double> drawn(const Matrix3& m) { return {vec(m.col(2)), vec(m.col(0)), vec(m.col(1)), 1.0, {}, {}}; }

TEST(BendTwistStrain, OfAPureBendIsTwiceTheTangentOfHalfTheTurnTowardsTheDirector) {
  const Matrix3 f0 = Matrix3::Identity();  // d1 = x, d2 = y, t = z
  const double phi = 0.7;
  const auto towards_d1 = bend_twist_strain(drawn(f0), drawn(rotation_exp(phi * Vector3::UnitY()) * f0), 0.0);
  EXPECT_NEAR(towards_d1.kappa1, 2.0 * std::tan(0.5 * phi), 1e-14);
  EXPECT_NEAR(towards_d1.kappa2, 0.0, 1e-14);
  EXPECT_NEAR(towards_d1.tau, 0.0, 1e-14);
  const auto towards_d2 = bend_twist_strain(drawn(f0), drawn(rotation_exp(-phi * Vector3::UnitX()) * f0), 0.0);
  EXPECT_NEAR(towards_d2.kappa2, 2.0 * std::tan(0.5 * phi), 1e-14);
  EXPECT_NEAR(towards_d2.kappa1, 0.0, 1e-14);
}

TEST(BendTwistStrain, OfAPureTwistIsItsAngle) {
  const auto s = bend_twist_strain(drawn(Matrix3::Identity()), drawn(rotation_exp(1.1 * Vector3::UnitZ())), 0.0);
  EXPECT_NEAR(s.tau, 1.1, 1e-14);
  EXPECT_NEAR(s.kappa1, 0.0, 1e-14);
  EXPECT_NEAR(s.kappa2, 0.0, 1e-14);
}

TEST(BendTwistStrain, OfFramesThatAreTwistedIsWhatEdgesTurnByTowardsDirectorsHalfway) {
  const double phi = 0.7, bent = 2.0 * std::tan(0.5 * phi);
  const Matrix3 bend = rotation_exp(phi * Vector3::UnitY());
  for (const double tau : {0.2, -0.5, 1.0, -1.5, 3.1, -5.0, 13.0}) {
    const Matrix3 f0 = rotation_exp(-0.5 * tau * Vector3::UnitZ());
    const auto s = bend_twist_strain(drawn(f0), drawn(bend * rotation_exp(0.5 * tau * Vector3::UnitZ())), tau + 0.3);
    EXPECT_NEAR(s.tau, tau, 1e-14);
    EXPECT_NEAR(s.kappa1, bent, 1e-14);
    EXPECT_NEAR(s.kappa2, 0.0, 1e-14);
  }
}

TEST(BendTwistStrain, FollowsTheBranchOfThePreviousTwist) {
  const auto f1 = drawn(rotation_exp(1.1 * Vector3::UnitZ()));
  EXPECT_NEAR(bend_twist_strain(drawn(Matrix3::Identity()), f1, 13.0).tau, 1.1 + 4.0 * kPi, 1e-13);
  EXPECT_NEAR(bend_twist_strain(drawn(Matrix3::Identity()), f1, -5.0).tau, 1.1 - 2.0 * kPi, 1e-13);
}

TEST(BendTwistStrain, DoesNotChangeWhenBothFramesAreTurned) {
  const Matrix3 f0 = rotation_exp(Vector3(0.2, 1.0, -0.4)), f1 = rotation_exp(Vector3(-0.5, 0.3, 0.9));
  const Matrix3 R = rotation_exp(Vector3(1.0, -2.0, 0.7));
  const auto a = bend_twist_strain(drawn(f0), drawn(f1), 0.0), b = bend_twist_strain(drawn(R * f0), drawn(R * f1), 0.0);
  EXPECT_NEAR(a.kappa1, b.kappa1, 1e-13);
  EXPECT_NEAR(a.kappa2, b.kappa2, 1e-13);
  EXPECT_NEAR(a.tau, b.tau, 1e-13);
}

TEST(PlanarKappa, IsTwiceTheTangentOfHalfTheTurn) {
  for (double turn : {-2.5, -0.1, 0.0, 1.3, 3.0})
    EXPECT_NEAR(planar_kappa(std::cos(0.4), std::sin(0.4), std::cos(0.4 + turn), std::sin(0.4 + turn)),
                2.0 * std::tan(0.5 * turn), 1e-11);
}

TEST(Rotation, LogarithmUndoesTheExponential) {
  Random random;
  for (double angle : {0.0, 1e-9, 1e-3, 1.0, 3.0, kPi - 1e-6}) {
    const Vector3 v = angle * random.unit();
    EXPECT_LT((rotation_log(rotation_exp(v)) - v).norm(), 1e-9 * std::max(angle, 1e-3)) << angle;
  }
}

TEST(Rotation, ExponentialTurnsAboutItsVector) {
  const Matrix3 R = rotation_exp(0.5 * kPi * Vector3::UnitZ());
  EXPECT_LT((R * Vector3::UnitX() - Vector3::UnitY()).norm(), 1e-15);
}

TEST(Rotation, CrossMatrixIsTheCrossProduct) {
  const Vector3 a(1, -2, 3), b(0.5, 0.1, -0.7);
  EXPECT_LT((cross_matrix(a) * b - a.cross(b)).norm(), 1e-15);
}

TEST(Cayley, TurnsByTwiceTheArcTangentOfHalfItsVector) {
  Random random;
  for (double size : {1e-6, 0.1, 1.0, 5.0}) {
    const Vector3 w = size * random.unit();
    EXPECT_LT((cayley(w) - rotation_exp(2.0 * std::atan(0.5 * size) * w.normalized())).norm(), 1e-14);
    EXPECT_LT((cayley_inverse(cayley(w)) - w).norm(), 1e-13 * (1.0 + size * size));
  }
}

TEST(Cayley, AgreesWithTheExponentialToThirdOrder) {
  const Vector3 axis = Vector3(1, 2, 3).normalized();
  const double coarse = (cayley(0.1 * axis) - rotation_exp(0.1 * axis)).norm();
  const double fine = (cayley(0.05 * axis) - rotation_exp(0.05 * axis)).norm();
  EXPECT_NEAR(coarse / fine, 8.0, 0.1);
}

TEST(Cayley, SpinIsTheDerivativeOfTheRotation) {
  Random random;
  for (int k = 0; k < 5; ++k) {
    const Vector3 w = random.vector();
    const Matrix3 start = cayley(w);
    const auto spun = [&](const VectorX& dw) {
      return VectorX(rotation_log(cayley(w + Vector3(dw)) * start.transpose()));
    };
    EXPECT_TRUE(derivative_matches(spun, VectorX::Zero(3), cayley_spin(w)));
  }
}

TEST(Rotation, OrthonormalizedRemovesDrift) {
  const Matrix3 R = rotation_exp(Vector3(0.4, -0.3, 1.0));
  Matrix3 drifted = R;
  drifted(0, 1) += 1e-9;
  const Matrix3 clean = orthonormalized(drifted);
  EXPECT_LT((clean.transpose() * clean - Matrix3::Identity()).norm(), 1e-14);
  EXPECT_LT((clean - R).norm(), 2e-9);
}

}  // namespace
}  // namespace withe
