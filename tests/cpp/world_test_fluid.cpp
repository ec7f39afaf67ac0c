// Fluids in a world: the same bits from a snapshot, the same motion in a plane, the same equilibria.

#include <gtest/gtest.h>

#include "worlds.hpp"

namespace withe {
namespace {

using testing::options;
using testing::SceneBuilder;

constexpr Integrator kSchemes[] = {Integrator::backward_euler, Integrator::implicit_midpoint,
                                   Integrator::energy_momentum, Integrator::verlet};

SceneDescription in_fluid(SceneBuilder builder, FluidModel model) {
  for (RodDescription& rod : builder.scene.rods) rod.fluid_radius.setConstant(rod.rest_lengths.size(), 5e-3);
  builder.scene.fluid = {model, 0.1, 5e-3, 0.0};
  return builder.scene;
}

Options options_for(Integrator integrator) {
  return options(integrator, integrator == Integrator::verlet ? 5e-5 : 5e-3);
}

TEST(Fluid, SnapshotsGoOnWithTheSameBitsInTheSameWorldAndInOthers) {
  for (FluidModel model : {FluidModel::resistive, FluidModel::stokeslets})
    for (const SceneBuilder& builder : {testing::hanging_arm(), testing::cantilever()})
      for (Integrator integrator : kSchemes) {
        const SceneDescription scene = in_fluid(builder, model);
        World world(scene, options_for(integrator));
        world.step(7);
        const std::string bytes = world.snapshot();
        World copy(world);
        world.step(6);
        World other(scene, options_for(integrator));
        other.restore(bytes);
        for (World* w : {&copy, &other}) {
          w->step(6);
          EXPECT_TRUE(testing::same_state(world, *w)) << static_cast<int>(integrator);
        }
        world.restore(bytes);
        world.step(6);
        EXPECT_TRUE(testing::same_state(world, other)) << static_cast<int>(integrator);
        EXPECT_GT(world.energy().dissipated, 0.0);
      }
}

TEST(Fluid, OfAnotherKindRefusesASnapshot) {
  const World thick(in_fluid(testing::hanging_arm(), FluidModel::stokeslets), options_for(Integrator::backward_euler));
  for (FluidModel model : {FluidModel::none, FluidModel::resistive}) {
    World other(in_fluid(testing::hanging_arm(), model), options_for(Integrator::backward_euler));
    EXPECT_THROW(other.restore(thick.snapshot()), std::invalid_argument);
  }
}

void set(World& world, ParameterKind kind, double value) {
  const ParameterSetting setting{kind, 0, {&value, 1, 1}};
  world.set({&setting, 1});
}

TEST(Fluid, ItsNumbersChangeWhileRunningAndComeBackFromASnapshot) {
  for (auto [kind, value] :
       {std::pair(ParameterKind::fluid_viscosity, 0.4), std::pair(ParameterKind::fluid_regularization, 0.02)}) {
    World world(in_fluid(testing::hanging_arm(), FluidModel::stokeslets), options_for(Integrator::backward_euler));
    World still(world);
    world.step(2);
    still.step(2);
    set(world, kind, value);
    world.step(2);
    still.step(2);
    EXPECT_FALSE(testing::same_state(world, still));
    World copy(world), other(in_fluid(testing::hanging_arm(), FluidModel::stokeslets), world.options());
    other.restore(world.snapshot());
    for (World* each : {&world, &copy, &other}) each->step(4);
    EXPECT_TRUE(testing::same_state(world, copy));
    EXPECT_TRUE(testing::same_state(world, other));
    EXPECT_THROW(set(world, kind, -1.0), std::invalid_argument);
    World dry(testing::hanging_arm().scene, options_for(Integrator::backward_euler));
    EXPECT_THROW(set(dry, kind, value), std::invalid_argument);
  }
  World local(in_fluid(testing::hanging_arm(), FluidModel::resistive), options_for(Integrator::backward_euler));
  EXPECT_THROW(set(local, ParameterKind::fluid_regularization, 0.02), std::invalid_argument);
}

TEST(Fluid, InAPlaneMovesRodsAsInSpace) {
  for (FluidModel model : {FluidModel::resistive, FluidModel::stokeslets})
    for (Integrator integrator : {Integrator::backward_euler, Integrator::implicit_midpoint, Integrator::verlet}) {
      Options spatial = options_for(integrator);
      spatial.planar = false;
      World plane(in_fluid(testing::cantilever(), model), options_for(integrator));
      World space(in_fluid(testing::cantilever(), model), spatial);
      ASSERT_TRUE(plane.plan().planar);
      plane.step(20);
      space.step(20);
      EXPECT_LT((plane.positions() - space.positions()).cwiseAbs().maxCoeff(), 1e-9) << static_cast<int>(integrator);
    }
}

TEST(Fluid, LeavesEquilibriaAlone) {
  for (FluidModel model : {FluidModel::resistive, FluidModel::stokeslets}) {
    World dry(testing::hanging_arm().scene, options_for(Integrator::implicit_midpoint));
    World wet(in_fluid(testing::hanging_arm(), model), options_for(Integrator::implicit_midpoint));
    EXPECT_TRUE(dry.equilibrium().stable);
    EXPECT_TRUE(wet.equilibrium().stable);
    EXPECT_LT((dry.positions() - wet.positions()).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(Fluid, CannotRunBackwards) {
  for (FluidModel model : {FluidModel::resistive, FluidModel::stokeslets})
    EXPECT_THROW(World(in_fluid(testing::hanging_arm(), model), options_for(Integrator::fourth_order)),
                 std::invalid_argument);
}

}  // namespace
}  // namespace withe
