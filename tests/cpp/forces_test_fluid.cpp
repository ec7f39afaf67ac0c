// Fluids: the mobility of Stokeslet segments against the kernel integrated numerically and against theory, and
// resistive-force theory against its definition.

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "derivative_check.hpp"
#include "forces/resistive.hpp"
#include "forces/stokeslets.hpp"
#include "states.hpp"

namespace withe {
namespace {

using testing::kPi;
using testing::MatrixX;
using testing::SceneBuilder;

constexpr double kGaussPlace[] = {-0.9602898564975363, -0.7966664774136267, -0.5255324099163290, -0.1834346424956498,
                                  0.1834346424956498,  0.5255324099163290,  0.7966664774136267,  0.9602898564975363};
constexpr double kGaussWeight[] = {0.1012285362903763, 0.2223810344533745, 0.3137066458778873, 0.3626837833783620,
                                   0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};

/// 8 pi mu times the velocity at r from a regularized point force [Cortez, Fauci and Medovikov 2005, eq. 10].
Matrix3 stokeslet(const Vector3& r, double regularization) {
  const double e2 = regularization * regularization, R = std::sqrt(r.squaredNorm() + e2);
  return ((1.0 / R + e2 / (R * R * R)) * Matrix3::Identity() + r * r.transpose() / (R * R * R)).eval();
}

/// Velocities of nodes for forces on nodes, every edge integrated numerically; not made symmetric.
MatrixX integrated_mobility(const Model& model, const MatrixX3& x, double regularization) {
  constexpr int kPieces = 100;
  const int n = model.node_count;
  MatrixX B = MatrixX::Zero(3 * n, 3 * n);
  VectorX length = VectorX::Zero(n);
  for (int e = 0; e < model.edge_count; ++e) {
    const int tail = model.edge_tail[at(e)], head = model.edge_head[at(e)];
    const Vector3 a = x.row(tail), d = x.row(head) - x.row(tail);
    length[tail] += 0.5 * model.edge_length[e];
    length[head] += 0.5 * model.edge_length[e];
    for (int piece = 0; piece < kPieces; ++piece)
      for (int g = 0; g < 8; ++g) {
        const double s = (piece + 0.5 * (1.0 + kGaussPlace[g])) / kPieces;
        const double weight = 0.5 * kGaussWeight[g] / kPieces * d.norm();
        for (int i = 0; i < n; ++i) {
          const Matrix3 S = weight * stokeslet(x.row(i).transpose() - (a + s * d), regularization);
          B.block<3, 3>(3 * i, 3 * tail) += (1.0 - s) * S;
          B.block<3, 3>(3 * i, 3 * head) += s * S;
        }
      }
  }
  for (int j = 0; j < n; ++j) B.middleCols<3>(3 * j) /= length[j];
  return B;
}

MatrixX3 positions(const Model& model, const VectorX& q) {
  MatrixX3 x = MatrixX3::Zero(model.node_count, 3);
  for (int i = 0; i < model.node_count; ++i)
    x.row(i).head(model.dimension) = q.segment(model.node_dof[at(i)], model.dimension);
  return x;
}

SceneDescription in_stokeslets(SceneBuilder builder, double regularization) {
  builder.scene.fluid = {FluidModel::stokeslets, 1.0, regularization, 0.0};
  return builder.scene;
}

SceneBuilder rod_through(const MatrixX3& points, bool closed = false, const Vector3& normal = Vector3(0.3, -0.5, 0.8)) {
  SceneBuilder builder;
  builder.add_rod(points, {}, closed, normal);
  return builder;
}

/// Helices beside each other, a joint, a ring, an arc in a plane, one edge.
std::vector<std::pair<std::string, SceneDescription>> scenes() {
  SceneBuilder pair = rod_through(testing::helix(11));
  pair.add_rod(testing::helix(8).rowwise() + Vector3(0.3, 1.1, 0.2).transpose());
  return {{"two helices", in_stokeslets(pair, 0.1)},
          {"a tee", in_stokeslets(testing::tee(JointForm::frame, false), 0.05)},
          {"a ring", in_stokeslets(rod_through(testing::ring(9, 1.0, 0.2), true), 0.3)},
          {"an arc in a plane", in_stokeslets(rod_through(testing::arc(6), false, Vector3::UnitY()), 0.2)},
          {"an edge", in_stokeslets(rod_through(testing::line(Vector3::Zero(), Vector3(0.5, 0, 0), 2)), 0.02)}};
}

TEST(Stokeslets, MobilityIsTheKernelIntegratedAlongTheRods) {
  for (const auto& [name, scene] : scenes()) {
    const Model model = build_model(scene, std::nullopt);
    StokesletFluid fluid(model);
    const VectorX q = initial_state(model).q;
    const MatrixX B = integrated_mobility(model, positions(model, q), scene.fluid.regularization);
    const MatrixX expected = 0.5 * (B + B.transpose());
    EXPECT_LT((fluid.mobility(q) - expected).cwiseAbs().maxCoeff(), 1e-11 * expected.cwiseAbs().maxCoeff()) << name;
  }
}

TEST(Stokeslets, ForcesMoveTheNodesAsAskedWithOldFactorisationsToo) {
  for (const auto& [name, scene] : scenes()) {
    const Model model = build_model(scene, std::nullopt);
    StokesletFluid fluid(model);
    testing::RandomNumbers random(5);
    VectorX q = initial_state(model).q, force;
    const int d = model.dimension;
    for (int k = 0; k < 8; ++k) {
      q += 0.02 * random.vector(q.size());
      const VectorX v = random.vector(q.size());
      ASSERT_TRUE(fluid.solve(q, v, force)) << name;
      const MatrixX A = fluid.mobility(q);
      VectorX moved = VectorX::Zero(3 * model.node_count), wanted = moved;
      for (int i = 0; i < model.node_count; ++i) {
        moved.segment(3 * i, d) = force.segment(model.node_dof[at(i)], d);
        wanted.segment(3 * i, d) = v.segment(model.node_dof[at(i)], d);
      }
      EXPECT_LT((A * moved + 8.0 * kPi * wanted).norm(), 1e-7 * wanted.norm()) << name << ", " << k;
    }
  }
}

TEST(Stokeslets, MobilityIsPositiveDefiniteUpToThreeEdgesOfRegularization) {
  for (double edges : {0.01, 0.5, 1.0, 2.0, 2.9}) {
    SceneBuilder crossing = rod_through(testing::line(Vector3(-1, 0, 0), Vector3(1, 0, 0), 41));
    crossing.add_rod(testing::line(Vector3(0.01, -1, 0.02), Vector3(0.01, 1, 0.02), 41));
    crossing.add_rod(testing::helix(57, 0.3, 0.2, 1.5));
    const Model model = build_model(in_stokeslets(crossing, 0.05 * edges), std::nullopt);
    StokesletFluid fluid(model);
    const MatrixX A = fluid.mobility(initial_state(model).q);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<MatrixX>(A).eigenvalues()[0], 0.0) << edges;
  }
}

TEST(Stokeslets, FarAwayTheFluidMovesAsBehindAPointForce) {
  double before = 0.0;
  for (double away : {8.0, 16.0, 32.0}) {
    SceneBuilder builder = rod_through(testing::line(Vector3(-0.1, 0, 0), Vector3(0.1, 0, 0), 3));
    const Vector3 r = away * Vector3(0.48, 0.6, 0.64);
    builder.add_rod(testing::line(r - Vector3(0, 0.1, 0), r + Vector3(0, 0.1, 0), 3));
    const Model model = build_model(in_stokeslets(builder, 0.1), std::nullopt);
    const MatrixX A = StokesletFluid(model).mobility(initial_state(model).q);
    const Matrix3 expected = (Matrix3::Identity() + r * r.transpose() / r.squaredNorm()) / away;
    const double error = (A.block<3, 3>(3, 12) - expected).norm() * away;  // their middle nodes
    EXPECT_LT(error, 2e-3);
    if (before > 0.0) {
      EXPECT_NEAR(before / error, 4.0, 0.2);
    }
    before = error;
  }
}

/// Total force of a straight rod of length one that moves along or across itself, over 8 pi mu U.
double straight_drag(int nodes, double regularization, const Vector3& velocity) {
  const Model model = build_model(
      in_stokeslets(rod_through(testing::line(Vector3::Zero(), Vector3(1, 0, 0), nodes)), regularization), false);
  StokesletFluid fluid(model);
  VectorX v = VectorX::Zero(model.dof_count), force;
  for (int i = 0; i < nodes; ++i) v.segment<3>(model.node_dof[at(i)]) = velocity;
  EXPECT_TRUE(fluid.solve(initial_state(model).q, v, force));
  return -force.dot(v) / (8.0 * kPi);
}

TEST(Stokeslets, AStraightRodHasTheDragOfASlenderCylinder) {
  // F = 2 pi mu L U (1/s + 0.80685/s^2 + 0.82854/s^3) along it, 4 pi mu L U (1/s - 0.19315/s^2 + 0.21484/s^3) across
  // it. Here s = ln(L/a) [Keller and Rubinow 1976]. The remaining error is of the order of 1/s^4, plus a / L for the
  // ends, which the blobs round.
  for (double slenderness : {100.0, 1000.0}) {
    const double s = std::log(slenderness), radius = 1.0 / slenderness;
    const double along = 0.25 * (1.0 / s + 0.80685 / (s * s) + 0.82854 / (s * s * s));
    const double across = 0.5 * (1.0 / s - 0.19315 / (s * s) + 0.21484 / (s * s * s));
    const int nodes = static_cast<int>(slenderness);
    const double regularization = std::sqrt(std::exp(1.0)) * radius, left = 4.0 / (s * s * s);
    EXPECT_NEAR(straight_drag(nodes, regularization, Vector3(1, 0, 0)) / along, 1.0, left);
    EXPECT_NEAR(straight_drag(nodes, regularization, Vector3(0, 1, 0)) / across, 1.0, left);
  }
}

TEST(Stokeslets, ResistanceToWavesIsThatOfALongRod) {
  const int nodes = 801;
  const double regularization = 0.0149;  // of edges of 0.005
  SceneBuilder builder = rod_through(testing::line(Vector3::Zero(), Vector3(4, 0, 0), nodes));
  const Model model = build_model(in_stokeslets(builder, regularization), false);
  const MatrixX A = StokesletFluid(model).mobility(initial_state(model).q);
  const int middle = nodes / 2;
  for (double wave : {0.5, 1.0, 1.5}) {
    double least = INFINITY;
    for (int direction : {0, 1}) {
      double velocity = 0.0;
      for (int j = 0; j < nodes; ++j)
        velocity += A(3 * middle + direction, 3 * j + direction) *
                    std::cos(wave * 4.0 * (j - middle) / (nodes - 1.0) / regularization);
      least = std::min(least, velocity * 4.0 / (nodes - 1.0));
    }
    EXPECT_NEAR(8.0 * kPi / least / wave_resistance(wave), 1.0, 0.05) << wave;  // the wave ends with the rod
  }
}

TEST(Stokeslets, LocalDragIsAsGreatAsTheResistanceOfAnyMotionOfARod) {
  for (const MatrixX3& points : {testing::line(Vector3::Zero(), Vector3(1, 0, 0), 25), testing::helix(40)})
    for (double edges : {0.01, 0.2, 0.4, 0.8, 1.5, 2.9}) {
      const double edge = (points.row(1) - points.row(0)).norm();
      const Model model = build_model(in_stokeslets(rod_through(points), edges * edge), false);
      StokesletFluid fluid(model);
      MassMatrix drag;
      fluid.set_local_drag(1.0, drag);
      const Eigen::Index n = 3 * model.node_count;
      MatrixX D(n, n);
      VectorX unit, moved;
      for (int j = 0; j < model.node_count; ++j)
        for (int k = 0; k < 3; ++k) {
          unit.setZero(model.dof_count);
          unit[model.node_dof[at(j)] + k] = 1.0;
          multiply(model, drag, unit, moved);
          for (int i = 0; i < model.node_count; ++i)
            D.block<3, 1>(3 * i, 3 * j + k) = moved.segment<3>(model.node_dof[at(i)]);
        }
      const MatrixX R = 8.0 * kPi * fluid.mobility(initial_state(model).q).inverse();
      const MatrixX R_symmetric = 0.5 * (R + R.transpose());
      const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixX> ratios(R_symmetric, D, Eigen::EigenvaluesOnly);
      EXPECT_LT(ratios.eigenvalues().maxCoeff(), 1.26) << edges;
    }
}

TEST(Stokeslets, RegularizationsThatNoEdgeCanTellAreRefused) {
  const SceneBuilder rod = rod_through(testing::line(Vector3::Zero(), Vector3(1, 0, 0), 11));
  EXPECT_NO_THROW(StokesletFluid(build_model(in_stokeslets(rod, 0.299), false)));
  EXPECT_THROW(StokesletFluid(build_model(in_stokeslets(rod, 0.301), false)), std::invalid_argument);
  EXPECT_THROW(StokesletFluid(build_model(in_stokeslets(rod, 0.0), false)), std::invalid_argument);
}

TEST(ResistiveForce, IsAlongAndAcrossTheTangentWithAnExactJacobian) {
  testing::RandomNumbers random(3);
  for (int d : {2, 3})
    for (int k = 0; k < 10; ++k) {
      const VectorX start = random.vector(2 * d);
      const double h = 0.3, along = 0.7, across = 1.9;
      const auto at_end = [&](const VectorX& z, bool with_hessian, Local& local) {
        ResistiveEdge edge{d, along, across, {}, 0.0, {}, 1.0 / h};
        const VectorX e = z.tail(d) - z.head(d);
        edge.inverse_length = 1.0 / e.norm();
        for (int i = 0; i < d; ++i) {
          edge.tangent[i] = e[i] / e.norm();
          edge.change[0][i] = z[i] - start[i];
          edge.change[1][i] = z[d + i] - start[d + i];
        }
        resistive_local(edge, with_hessian, local);
      };
      const auto gradient = [&](const VectorX& z) {
        Local local;
        at_end(z, false, local);
        return VectorX(Eigen::Map<VectorX>(local.gradient, 2 * d));
      };
      const VectorX z = start + 0.5 * random.vector(2 * d);
      Local local;
      at_end(z, true, local);
      MatrixX H(2 * d, 2 * d);
      for (int i = 0; i < 2 * d; ++i)
        for (int j = 0; j < 2 * d; ++j) H(i, j) = local.hessian[i][j];
      EXPECT_TRUE(testing::derivative_matches(gradient, z, H, 1e-2 * (z.tail(d) - z.head(d)).norm()));
      const VectorX t = (z.tail(d) - z.head(d)).normalized(), v = (z - start).head(d) / h;
      const VectorX expected = along * t * t.dot(v) + across * (v - t * t.dot(v));
      EXPECT_LT((gradient(z).head(d) - expected).norm(), 1e-14 * expected.norm());
    }
}

TEST(ResistiveForce, CoefficientsAreThoseOfTheLiterature) {
  const ResistiveCoefficients straight = resistive_coefficients(1.0, 100.0, 0.0);
  EXPECT_NEAR(straight.along, 2.0 * kPi / (std::log(100.0) - 0.5), 1e-12);
  EXPECT_NEAR(straight.across, 4.0 * kPi / (std::log(100.0) + 0.5), 1e-12);
  const ResistiveCoefficients waves = resistive_coefficients(1.0, 100.0, 80.3);
  EXPECT_NEAR(waves.along, 2.0 * kPi / std::log(0.18 * 80.3), 1e-12);
  EXPECT_NEAR(waves.across, 4.0 * kPi / (std::log(0.18 * 80.3) + 0.5), 1e-12);
  EXPECT_THROW(resistive_coefficients(1.0, 1.5, 0.0), std::invalid_argument);
  EXPECT_THROW(resistive_coefficients(1.0, 100.0, 5.0), std::invalid_argument);
}

}  // namespace
}  // namespace withe
