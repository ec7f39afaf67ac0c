// Explicit steps.

#include <gtest/gtest.h>

#include "worlds.hpp"

namespace withe {
namespace {

using testing::options;
using testing::SceneBuilder;

TEST(Verlet, RefusesAStepAboveTheStableOne) {
  EXPECT_THROW(World(testing::hanging_arm().scene, options(Integrator::verlet, 0.1)), std::invalid_argument);
  World fine(testing::hanging_arm().scene, options(Integrator::verlet, 5e-5));
  EXPECT_GT(fine.plan().stable_step, 5e-5);
}

/// Explicit steps without drag skip some work. A negligible drag forces the general path.
TEST(Verlet, WithoutDragTakesTheSameStepsAsTheGeneralPath) {
  SceneBuilder joint = testing::tee(JointForm::frame, false, testing::rubber());
  joint.scene.gravity = Vector3(0, 0, -1.0);
  joint.support(SupportKind::clamp, {0, 0});
  SceneBuilder loaded = testing::hanging_arm();
  loaded.load(LoadKind::force, {0, 11}, Vector3(0.01, 0.02, 0), true);
  for (const SceneDescription& scene :
       {testing::cantilever().scene, testing::hanging_arm().scene, joint.scene, loaded.scene}) {
    SceneDescription dragged = scene;
    for (RodDescription& rod : dragged.rods) rod.drag.setConstant(1e-290);
    World lean(scene, options(Integrator::verlet, 2e-5)), general(dragged, options(Integrator::verlet, 2e-5));
    const MatrixX3 start = lean.positions();
    lean.step(400);
    general.step(400);
    const double moved = (lean.positions() - start).norm();
    EXPECT_GT(moved, 1e-5);
    EXPECT_LT((lean.positions() - general.positions()).norm(), 1e-7 * moved);
    EXPECT_LT((lean.reaction(0).force - general.reaction(0).force).norm(), 1e-7 * general.reaction(0).force.norm());
  }
}

/// Position of an arm after a fiftieth of a second, and the error of its energy balance.
std::pair<MatrixX3, double> swing(double dt, bool follower) {
  SceneBuilder builder = testing::hanging_arm();
  builder.load(LoadKind::force, {0, 11}, Vector3::Zero(), follower);
  World world(builder.scene, options(Integrator::verlet, dt));
  const Energy start = world.energy();
  world.set_step_callback([](World& w, double time, double) {
    w.set_load(0, std::sin(300.0 * time) * Vector3(0.02, 0.01, 0.03).transpose());
  });
  world.step(static_cast<int>(std::lround(0.02 / dt)));
  const Energy end = world.energy();
  return {world.positions(), end.total - end.work + end.dissipated - start.total};
}

TEST(Verlet, IsOfSecondOrderUnderLoadsThatChange) {
  for (const bool follower : {false, true}) {
    const MatrixX3 exact = swing(1.25e-6, follower).first;
    double before = 0.0;
    for (const double dt : {4e-5, 2e-5, 1e-5}) {
      const double error = (swing(dt, follower).first - exact).norm();
      if (before > 0.0) {
        EXPECT_GT(before / error, 3.6) << dt;
      }
      before = error;
    }
    // Energy swings with the modes that a step does not resolve, but what is lost falls with its square as well.
    EXPECT_LT(std::abs(swing(1e-5, follower).second), 0.4 * std::abs(swing(2e-5, follower).second) + 1e-9);
  }
}

}  // namespace
}  // namespace withe
