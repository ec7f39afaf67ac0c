// Places of stencils' numbers: bands stay bands, scatter agrees with a dense sum, supports are projected out.

#include <gtest/gtest.h>

#include "assembly/assembler.hpp"
#include "derivative_check.hpp"
#include "states.hpp"

namespace withe {
namespace {

using testing::MatrixX;
using testing::SceneBuilder;

/// Greatest distance of two unknowns that share a stencil.
int half_bandwidth(const Assembler& assembler) {
  int width = 0;
  for (const ElementTable* table : {&assembler.stretch, &assembler.bend, &assembler.half})
    for (int e = 0; e < table->count(); ++e) {
      const int* dofs = table->dofs(e);
      for (int i = 0; i < table->width(); ++i)
        for (int j = 0; j < table->width(); ++j)
          if (dofs[i] >= 0 && dofs[j] >= 0) width = std::max(width, dofs[i] - dofs[j]);
    }
  return width;
}

int half_bandwidth(const SceneDescription& scene, std::optional<bool> planar = std::nullopt) {
  const Model model = build_model(scene, planar);
  return half_bandwidth(Assembler(model, {}, Symmetry::symmetric, SolverKind::automatic));
}

std::string solver_of(const SceneDescription& scene, std::optional<bool> planar = std::nullopt) {
  const Model model = build_model(scene, planar);
  return Assembler(model, {}, Symmetry::symmetric, SolverKind::automatic).solver().name();
}

SceneBuilder open_rod(SupportKind kind) {
  SceneBuilder builder;
  builder.add_rod(testing::helix(20));
  builder.support(kind, {0, 0});
  builder.support(kind, {0, 19});
  return builder;
}

TEST(Layout, OpenRodsAreBandsOfTenInSpace) {
  for (SupportKind kind : {SupportKind::pin, SupportKind::clamp, SupportKind::hold_edge}) {
    EXPECT_EQ(half_bandwidth(open_rod(kind).scene), 10);
    EXPECT_NE(solver_of(open_rod(kind).scene).find("band"), std::string::npos);
  }
}

TEST(Layout, OpenRodsAreBandsOfFiveInAPlane) {
  SceneBuilder builder;
  builder.add_rod(testing::arc(20), {}, false, Vector3::UnitY());
  builder.support(SupportKind::clamp, {0, 0});
  builder.support(SupportKind::clamp, {0, 19});
  EXPECT_EQ(half_bandwidth(builder.scene), 5);
  EXPECT_NE(solver_of(builder.scene).find("band"), std::string::npos);
}

TEST(Layout, ManyOpenRodsAreOneBand) {
  SceneBuilder builder;
  for (int r = 0; r < 4; ++r) {
    const Vector3 shift(5.0 * r, 0.3 * r, 0.1 * r * r);
    builder.add_rod(testing::helix(8).rowwise() + shift.transpose());
    builder.support(SupportKind::clamp, {r, 0});
  }
  EXPECT_EQ(half_bandwidth(builder.scene), 10);
}

/// A helix in three rods, given in the order last, first, middle.
SceneBuilder chain() {
  const MatrixX3 points = testing::helix(16);
  SceneBuilder builder;
  builder.add_rod(points.bottomRows(6));
  builder.add_rod(points.topRows(6));
  builder.add_rod(points.middleRows(5, 6));
  // The directors of the whole helix, so that the rods continue each other.
  SceneBuilder whole;
  whole.add_rod(points);
  const MatrixX3 directors = whole.scene.rods[0].directors;
  builder.scene.rods[0].directors = directors.bottomRows(5);
  builder.scene.rods[1].directors = directors.topRows(5);
  builder.scene.rods[2].directors = directors.middleRows(5, 5);
  builder.join({{1, 5}, {2, 0}}).join({{2, 5}, {0, 0}});
  return builder;
}

TEST(Layout, AChainOfRodsIsOneBandInWhateverOrderItIsDescribed) {
  EXPECT_EQ(half_bandwidth(chain().scene), 10);
  SceneBuilder clamped = chain();
  clamped.support(SupportKind::clamp, {1, 0});
  EXPECT_EQ(half_bandwidth(clamped.scene), 10);
}

TEST(Layout, BranchesAndRingsAreSparse) {
  EXPECT_NE(solver_of(testing::tee(JointForm::frame, false).scene), "");
  SceneBuilder closed;
  closed.add_rod(testing::ring(20, 1.0, 0.3), {}, true);
  EXPECT_GT(half_bandwidth(closed.scene), 24);
  EXPECT_NE(solver_of(closed.scene).find("sparse"), std::string::npos);
}

/// All unknowns as a dense matrix.
MatrixX dense(const LinearSolver& solver) {
  const Eigen::Index n = solver.size();
  MatrixX out(n, n);
  VectorX x = VectorX::Zero(n), y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    x(i) = 1.0;
    solver.multiply({x.data(), at(static_cast<int>(n))}, {y.data(), at(static_cast<int>(n))});
    out.col(i) = y;
    x(i) = 0.0;
  }
  return out;
}

/// Scatters random symmetric element matrices, and adds the same up densely.
MatrixX fill(Assembler& assembler, unsigned seed) {
  const Eigen::Index n = assembler.solver().size();
  MatrixX expected = MatrixX::Zero(n, n);
  testing::RandomNumbers random(seed);
  std::fill(assembler.solver().values().begin(), assembler.solver().values().end(), 0.0);
  for (const ElementTable* table : {&assembler.stretch, &assembler.bend, &assembler.half})
    for (int e = 0; e < table->count(); ++e) {
      double local[kMaxLocal][kMaxLocal] = {};
      const int* dofs = table->dofs(e);
      for (int i = 0; i < table->width(); ++i)
        for (int j = 0; j <= i; ++j) {
          local[i][j] = local[j][i] = random.normal();
          if (dofs[i] < 0 || dofs[j] < 0) continue;
          expected(dofs[i], dofs[j]) += 0.5 * local[i][j];
          if (i != j) expected(dofs[j], dofs[i]) += 0.5 * local[i][j];
        }
      table->add_hessian(e, local, 0.5, assembler.solver().values());
    }
  return expected;
}

std::vector<SceneDescription> scenes() {
  std::vector<SceneDescription> out{
      open_rod(SupportKind::clamp).scene,          chain().scene,           testing::tee(JointForm::frame, false).scene,
      testing::tee(JointForm::pairs, false).scene, testing::hinged().scene, testing::tee(JointForm::frame, true).scene};
  SceneBuilder sliding = testing::tee(JointForm::frame, false);
  sliding.support(SupportKind::clamp, {0, 0}, Vector3(0.6, 0.0, 0.8) * Vector3(0.6, 0.0, 0.8).transpose());
  sliding.support(SupportKind::pin, {1, 0}, Matrix3::Identity() - Vector3::UnitX() * Vector3::UnitX().transpose());
  sliding.support(SupportKind::hold_edge, {2, 2});
  out.push_back(sliding.scene);
  return out;
}

TEST(ElementTable, ScatterAgreesWithADenseSum) {
  for (const SceneDescription& scene : scenes())
    for (Symmetry symmetry : {Symmetry::symmetric, Symmetry::unsymmetric}) {
      const Model model = build_model(scene, std::nullopt);
      Assembler assembler(model, {}, symmetry, SolverKind::automatic);
      const MatrixX expected = fill(assembler, 5);
      EXPECT_LT((dense(assembler.solver()) - expected).norm(), 1e-12 * expected.norm());
    }
}

TEST(ElementTable, LeavesOutUnknownsThatAreNone) {
  const Model model = build_model(open_rod(SupportKind::pin).scene, std::nullopt);
  const int there[3] = {model.node_dof[1], model.node_dof[1] + 1, model.node_dof[2]};
  double all[5][5], alone[3][3];
  for (int i = 0; i < 25; ++i) all[i / 5][i % 5] = 1.0 + i;
  const int place[3] = {0, 2, 3};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) alone[i][j] = all[place[i]][place[j]];
  for (Symmetry symmetry : {Symmetry::symmetric, Symmetry::unsymmetric}) {
    Assembler assembler(model, {}, symmetry, SolverKind::automatic);
    assembler.couple({there[0], -1, there[1], there[2], -1}, 5);
    for (double scale : {2.0, -1.0}) {
      const std::span<double> values = assembler.solver().values();
      std::fill(values.begin(), values.end(), 0.0);
      scale > 0.0 ? assembler.contact.add_hessian(0, all, scale, values)
                  : assembler.contact.add_dense_hessian(0, alone, scale, values);
      EXPECT_EQ(assembler.contact.offset(0, 1, 0), -1);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < (symmetry == Symmetry::symmetric ? i + 1 : 3); ++j) {
          EXPECT_EQ(*assembler.entry(there[i], there[j], values), scale * alone[i][j]);
          EXPECT_EQ(assembler.contact.offset(0, place[i], place[j]), assembler.solver().offset(there[i], there[j]));
        }
    }
  }
}

TEST(ElementTable, GradientsAddUpWithTheirMagnitudes) {
  const Model model = build_model(open_rod(SupportKind::pin).scene, std::nullopt);
  const Assembler assembler(model, {}, Symmetry::symmetric, SolverKind::automatic);
  VectorX residual = VectorX::Zero(model.dof_count), magnitude = residual;
  const double up[6] = {1, 2, 3, 4, 5, 6}, down[6] = {-1, -2, -3, -4, -5, -6};
  assembler.stretch.add_gradient(0, up, 2.0, residual, magnitude);
  assembler.stretch.add_gradient(0, down, 1.0, residual, magnitude);
  EXPECT_EQ(residual(model.node_dof[0]), 1.0);
  EXPECT_EQ(magnitude(model.node_dof[0]), 3.0);
  EXPECT_EQ(residual(model.node_dof[1] + 2), 6.0);
  EXPECT_EQ(magnitude(model.node_dof[1] + 2), 18.0);
}

TEST(Assembler, ProjectionTakesHeldDirectionsOutOfTheMatrix) {
  for (const SceneDescription& scene : scenes())
    for (Symmetry symmetry : {Symmetry::symmetric, Symmetry::unsymmetric}) {
      const Model model = build_model(scene, std::nullopt);
      Assembler assembler(model, {}, symmetry, SolverKind::automatic);
      const MatrixX before = fill(assembler, 6);
      assembler.project_matrix();
      const MatrixX after = dense(assembler.solver());
      MatrixX P = MatrixX::Identity(model.dof_count, model.dof_count);
      for (const Constraint& c : model.constraints)
        P.block(c.first, c.first, c.size, c.size) = c.free.topLeftCorner(c.size, c.size);
      const MatrixX free = P * after * P, expected = P * before * P;
      EXPECT_LT((free - expected).norm(), 1e-12 * before.norm());
      // Held directions are coupled to nothing free, and are not singular.
      const MatrixX Q = MatrixX::Identity(model.dof_count, model.dof_count) - P;
      EXPECT_LT((P * after * Q).norm() + (Q * after * P).norm(), 1e-12 * before.norm());
      for (const Constraint& c : model.constraints)
        for (int i = 0; i < c.size; ++i) EXPECT_GT((Q * after * Q + P)(c.first + i, c.first + i), 0.0);
    }
}

TEST(Assembler, SplitsAVectorIntoWhatIsHeldAndWhatIsFree) {
  for (const SceneDescription& scene : scenes()) {
    const Model model = build_model(scene, std::nullopt);
    const Assembler assembler(model, {}, Symmetry::symmetric, SolverKind::automatic);
    const VectorX v = testing::RandomNumbers(9).vector(model.dof_count), held = assembler.held_part(v);
    VectorX free = v, twice;
    assembler.project(free);
    twice = free;
    assembler.project(twice);
    EXPECT_LT((free + held - v).norm(), 1e-14 * v.norm());
    EXPECT_LT((twice - free).norm(), 1e-14 * v.norm());
    EXPECT_NEAR(free.dot(held), 0.0, 1e-12 * v.squaredNorm());
  }
}

}  // namespace
}  // namespace withe
