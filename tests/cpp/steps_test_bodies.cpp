// Rigid bodies in a step: derivatives of what acts on the parts that they carry, and the work over a step.

#include <gtest/gtest.h>

#include <random>
#include <tuple>

#include "case_residual.hpp"
#include "scenes.hpp"

namespace withe::testing {
namespace {

/// Two bodies: one with its centre of mass off its base, and a second one on a hinge of the first. Springs pull at
/// them.
SceneDescription two_bodies() {
  SceneBuilder builder;
  SceneDescription& scene = builder.scene;
  scene.gravity = Vector3(0.3, -0.2, -9.0);
  scene.positions.resize(5, 3);
  scene.positions << 0.1, 0.2, -0.1,  // base of the first body
      0.5, 0.3, 0.2,                  // its centre
      0.9, -0.1, 0.4,                 // hinge, and base of the second
      1.4, 0.2, 0.1,                  // its centre
      0.2, 0.9, 0.6;                  // a further point of the first
  scene.added_mass.setZero(5);
  scene.added_mass << 0.0, 1.3, 0.0, 0.8, 0.2;
  BodyDescription first, second;
  first.name = "first";
  first.node = 0;
  first.carried = {1, 2, 4};
  first.inertia << 0.4, 0.05, -0.02, 0.05, 0.5, 0.03, -0.02, 0.03, 0.6;
  second.name = "second";
  second.node = 2;
  second.carried = {3};
  second.inertia << 0.3, 0.02, 0.01, 0.02, 0.35, 0.0, 0.01, 0.0, 0.25;
  second.carrier = 0;
  scene.bodies = {first, second};
  JointDescription joint;
  joint.clusters = {{}, {}};
  joint.bodies = {0, 1};
  joint.links = {{.parent = 0,
                  .child = 1,
                  .axis = Vector3(0.3, 0.8, -0.5).normalized(),
                  .stiffness = 1.5,
                  .rest_angle = 0.4,
                  .damping = 0.0,
                  .moment = 0.2}};
  scene.joints = {joint};
  scene.springs = {{{3, 4}, 7.0, 0.6, 0.0}, {{1, 3}, 5.0, 0.9, 0.0}};
  return scene;
}

/// The same with a slide in place of the hinge.
SceneDescription on_a_slide() {
  SceneDescription scene = two_bodies();
  scene.bodies[0].carried = {1, 4};
  scene.joints[0].links[0].slides = true;
  return scene;
}

/// A configuration away from the start: unknowns of the bodies at random, and carried parts in their places.
VectorX displaced(Equations& equations, const Model& model, std::mt19937& random) {
  std::uniform_real_distribution<double> number(-0.3, 0.3);
  VectorX z = equations.problem().start->q;
  for (int i = 0; i < model.dof_count; ++i) z[i] += number(random);
  equations.place(z);
  return z;
}

class BodiesInAStep : public ::testing::TestWithParam<std::tuple<StepRule, bool>> {
 protected:
  BodiesInAStep()
      : model_(build_model(std::get<1>(GetParam()) ? on_a_slide() : two_bodies(), false)),
        state_(initial_state(model_)) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> number(-1.0, 1.0);
    for (int i = 0; i < model_.dof_count; ++i) state_.v[i] = number(random);
    const Equations statics(model_, {.rule = StepRule::statics});
    parameters_ = initial_parameters(model_);
  }

  Model model_;
  State state_;
  Parameters parameters_;
};

TEST_P(BodiesInAStep, HaveTheDerivativesOfTheirRows) {
  const StepRule rule = std::get<0>(GetParam());
  Equations equations(model_, {.rule = rule});
  equations.begin(state_, parameters_, rule, rule == StepRule::statics ? 0.0 : 0.2);
  std::mt19937 random(7);
  const VectorX z = displaced(equations, model_, random);
  StepData data;
  equations.evaluate(z, true, nullptr, data);
  std::vector<bool> is_carried(at(model_.dof_count), false);
  for (const CarriedPart& part : model_.carried) std::fill_n(is_carried.begin() + part.own_dof, part.own_size, true);
  const bool symmetric = equations.assembler().solver().symmetry() == Symmetry::symmetric;
  MatrixX found(model_.dof_count, model_.dof_count), expected = found;
  for (int i = 0; i < model_.dof_count; ++i) {
    VectorX unit = VectorX::Unit(model_.dof_count, i), column(model_.dof_count);
    const auto n = static_cast<std::size_t>(model_.dof_count);
    equations.assembler().solver().multiply({unit.data(), n}, {column.data(), n});
    found.col(i) = column;
  }
  constexpr double kStep = 1e-5;
  for (int i = 0; i < model_.dof_count; ++i) {
    VectorX rows[2];
    for (int side : {0, 1}) {
      VectorX moved = z;
      moved[i] += side == 0 ? -kStep : kStep;
      equations.evaluate(moved, false, nullptr, data);
      rows[side] = data.full_residual;
    }
    expected.col(i) = (rows[1] - rows[0]) / (2.0 * kStep);
  }
  if (symmetric) expected = (0.5 * (expected + expected.transpose())).eval();
  double greatest = 0.0, off = 0.0;
  for (int i = 0; i < model_.dof_count; ++i)
    for (int j = 0; j < model_.dof_count; ++j) {
      if (is_carried[at(i)] || is_carried[at(j)]) continue;
      greatest = std::max(greatest, std::abs(expected(i, j)));
      off = std::max(off, std::abs(found(i, j) - expected(i, j)));
    }
  EXPECT_LT(off, 1e-7 * greatest);
  // Carried parts follow at the rates of `expand`.
  VectorX step = VectorX::Zero(model_.dof_count);
  for (int i = 0; i < model_.dof_count; ++i)
    if (!is_carried[at(i)]) step[i] = 0.1 * (i % 7) - 0.3;
  VectorX ahead = z + kStep * step, behind = z - kStep * step;
  equations.place(ahead);
  equations.place(behind);
  expand_step(equations.problem(), z, step);
  EXPECT_LT(((ahead - behind) / (2.0 * kStep) - step).lpNorm<Eigen::Infinity>(), 1e-8);
}

INSTANTIATE_TEST_SUITE_P(Rules, BodiesInAStep,
                         ::testing::Combine(::testing::Values(StepRule::statics, StepRule::backward_euler,
                                                              StepRule::midpoint, StepRule::energy_momentum),
                                            ::testing::Bool()));

/// Sum of the products of rows and displacements over an energy-momentum step.
TEST(CarriedParts, DoTheWorkOfTheirForcesOnTheBodies) {
  for (const SceneDescription& scene : {two_bodies(), on_a_slide()}) {
    const Model model = build_model(scene, false);
    const Parameters parameters = initial_parameters(model);
    const State state = initial_state(model);
    Equations equations(model, {.rule = StepRule::energy_momentum});
    equations.begin(state, parameters, StepRule::energy_momentum, 0.1);
    std::mt19937 random(11);
    std::uniform_real_distribution<double> number(-1.0, 1.0);
    const VectorX z = displaced(equations, model, random), change = 2.0 * (z - state.q);
    VectorX rows(model.dof_count);
    for (int i = 0; i < model.dof_count; ++i) rows[i] = number(random);
    const double work = rows.dot(change);
    VectorX magnitude = rows.cwiseAbs();
    std::vector<Carrying> carrying;
    fold_rows(equations.problem(), z, rows, magnitude, carrying);
    EXPECT_NEAR(rows.dot(change), work, 1e-13 * magnitude.dot(change.cwiseAbs()));
  }
}

}  // namespace
}  // namespace withe::testing
