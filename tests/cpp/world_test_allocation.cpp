// Steps do not allocate once every vector has its size.

#include <gtest/gtest.h>

#include "allocation_counter.hpp"
#include "worlds.hpp"

namespace withe {
namespace {

using testing::SceneBuilder;

/// Loads, drag, a moving clamp and actuation, all at work in every step.
std::unique_ptr<World> busy_world(SceneBuilder builder, Options options) {
  builder.scene.rods[0].drag.setConstant(0.05);
  auto world = std::make_unique<World>(builder.scene, options);
  world->move_support(0, Vector3(0.01, 0, 0.01), Matrix3::Identity(), 100.0);
  MatrixX2 curvature = world->natural_curvature(0);
  curvature.col(1).array() += 0.5;
  world->set_natural_curvature(0, curvature, 100.0);
  return world;
}

TEST(Step, DoesNotAllocateAfterWarmUp) {
  for (Integrator integrator : {Integrator::backward_euler, Integrator::implicit_midpoint, Integrator::energy_momentum,
                                Integrator::fourth_order, Integrator::verlet})
    for (const SceneBuilder& builder : {testing::cantilever(), testing::hanging_arm()}) {
      const double dt = integrator == Integrator::verlet ? 2e-5 : 2e-3;
      const auto world = busy_world(builder, testing::options(integrator, dt));
      world->step(20);
      const std::size_t before = allocation_count;
      world->step(20);
      EXPECT_EQ(allocation_count - before, 0u) << static_cast<int>(integrator) << " planar " << world->plan().planar;
    }
}

TEST(Step, InAFluidDoesNotAllocateAfterWarmUp) {
  for (FluidModel model : {FluidModel::resistive, FluidModel::stokeslets})
    for (Integrator integrator :
         {Integrator::backward_euler, Integrator::implicit_midpoint, Integrator::energy_momentum, Integrator::verlet}) {
      SceneBuilder builder = testing::hanging_arm();
      builder.scene.rods[0].contact_radius.setConstant(builder.scene.rods[0].rest_lengths.size(), 5e-3);
      builder.scene.fluid = {model, 0.1, 5e-3, 0.0};
      World world(builder.scene, testing::options(integrator, integrator == Integrator::verlet ? 2e-5 : 2e-3));
      world.step(20);
      const std::size_t before = allocation_count;
      world.step(20);
      EXPECT_EQ(allocation_count - before, 0u) << static_cast<int>(integrator);
    }
}

}  // namespace
}  // namespace withe
