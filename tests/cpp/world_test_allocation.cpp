// Steps do not allocate once every vector has its size.

#include <algorithm>
#include <string>

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

/// A hand that yields, and a ring that rubs and travels along its rod.
TEST(Step, WithHandsDoesNotAllocateAfterWarmUp) {
  for (Integrator integrator : {Integrator::backward_euler, Integrator::implicit_midpoint, Integrator::energy_momentum})
    for (SceneBuilder builder : {testing::cantilever(), testing::hanging_arm()}) {
      const double whole = builder.scene.rods[0].rest_lengths.sum();
      for (const bool slides : {false, true}) {
        builder.support(SupportKind::hand, {0, 0});
        HandDescription& hand = builder.scene.supports.back().hand;
        hand.at = (slides ? 0.6 : 0.9) * whole;
        hand.yields = true;
        hand.slides = slides;
        hand.stiffness = {30.0, 30.0, 30.0, 1e-3, 1e-3, 1e-3};
        hand.friction = slides ? 0.3 : 0.0;
      }
      World world(builder.scene, testing::options(integrator, 2e-3));
      for (int hand : {1, 2}) world.move_support(hand, world.support_position(hand) + Vector3(0.02, 0, 0.01), {}, 0.1);
      world.step(20);
      const std::size_t before = allocation_count;
      world.step(20);
      EXPECT_EQ(allocation_count - before, 0u) << static_cast<int>(integrator) << " planar " << world.plan().planar;
    }
}

TEST(Step, InAFluidDoesNotAllocateAfterWarmUp) {
  for (FluidModel model : {FluidModel::resistive, FluidModel::stokeslets})
    for (Integrator integrator :
         {Integrator::backward_euler, Integrator::implicit_midpoint, Integrator::energy_momentum, Integrator::verlet}) {
      SceneBuilder builder = testing::hanging_arm();
      builder.scene.rods[0].fluid_radius.setConstant(builder.scene.rods[0].rest_lengths.size(), 5e-3);
      builder.scene.fluid = {model, 0.1, 5e-3, 0.0};
      World world(builder.scene, testing::options(integrator, integrator == Integrator::verlet ? 2e-5 : 2e-3));
      world.step(20);
      const std::size_t before = allocation_count;
      world.step(20);
      EXPECT_EQ(allocation_count - before, 0u) << static_cast<int>(integrator);
    }
}

/// A rod above an obstacle, or a coil that lies on itself; and a second rod across it.
SceneBuilder lying(const ObstacleDescription& obstacle, bool rods, bool coiled = false) {
  SceneBuilder builder;
  builder.scene.gravity = Vector3(0, 0, -9.81);
  const MatrixX3 straight = testing::line(Vector3(0, 0, 5e-3), Vector3(0.3, 0.01, 5e-3), 16);
  MatrixX3 coil = testing::helix(24, 0.05, 0.0102, 1.6);
  coil.col(2).array() += 5e-3;
  builder.add_rod(coiled ? coil : straight, testing::rubber());
  if (rods && !coiled)
    builder.add_rod(testing::line(Vector3(0.15, -0.1, 0.016), Vector3(0.15, 0.1, 0.017), 12), testing::rubber());
  for (RodDescription& rod : builder.scene.rods) rod.contact_radius.setConstant(rod.rest_lengths.size(), 5e-3);
  builder.scene.contact.rods = rods;
  builder.scene.contact.obstacles = {obstacle};
  return builder;
}

ObstacleDescription floor_at(double height) {
  ObstacleDescription floor;
  floor.point = Vector3(0, 0, height);
  return floor;
}

ObstacleDescription capsule_below(const Vector3& start, const Vector3& end) {
  ObstacleDescription capsule;
  capsule.kind = ObstacleKind::capsule;
  capsule.point = start;
  capsule.other = end;
  capsule.radius = 0.02;
  return capsule;
}

struct Rubbing {
  double friction;
  FrictionLaw law;
};

/// Allocations of some steps. `layouts`: steps in which the matrix gets room for edges that touch as they never have.
struct Allocated {
  std::size_t layouts = 0, others = 0;
};

Allocated allocated_by(World& world, int steps) {
  constexpr std::size_t kLayout = 200;  // for every element one, and more
  Allocated sum;
  for (int k = 0; k < steps; ++k) {
    const std::size_t before = allocation_count;
    world.step(1);
    const std::size_t own = allocation_count - before;
    if (own > kLayout)
      ++sum.layouts;
    else
      sum.others += own;
  }
  return sum;
}

World rubbing_world(SceneBuilder builder, const Rubbing& rubbing, Integrator integrator) {
  ContactDescription& contact = builder.scene.contact;
  contact.friction = rubbing.friction;
  contact.friction_law = rubbing.law;
  contact.obstacle_friction = MatrixX3::Constant(1, 3, rubbing.friction);
  contact.obstacle_restitution = VectorX::Ones(1);
  return World(builder.scene, testing::options(integrator, integrator == Integrator::verlet ? 2e-5 : 2e-3));
}

constexpr Rubbing kRubbing[] = {{0.0, FrictionLaw::implicit},
                                {0.4, FrictionLaw::implicit},
                                {0.4, FrictionLaw::lagged},
                                {0.4, FrictionLaw::anchored},
                                {0.4, FrictionLaw::semi_explicit}};
constexpr Integrator kWithContact[] = {Integrator::backward_euler, Integrator::implicit_midpoint,
                                       Integrator::energy_momentum, Integrator::verlet};

std::string name_of(Integrator integrator, const Rubbing& rubbing) {
  return " integrator " + std::to_string(static_cast<int>(integrator)) + " friction " +
         std::to_string(static_cast<int>(rubbing.law)) + " " + std::to_string(rubbing.friction);
}

TEST(Step, OnAFloorDoesNotAllocateAfterWarmUp) {
  for (Integrator integrator : kWithContact)
    for (const Rubbing& rubbing : kRubbing) {
      World world = rubbing_world(lying(floor_at(0.0), false), rubbing, integrator);
      world.step(150);
      const Allocated later = allocated_by(world, 50);
      EXPECT_EQ(later.layouts + later.others, 0u) << name_of(integrator, rubbing);
    }
}

/// If contacts come and go, their vectors grow when there are more contacts than ever before. Each vector grows at most
/// once while the number has not doubled. The more pairs of edges have touched, the fewer pairs are left without a
/// place in the matrix; such a pair allocates too.
constexpr std::size_t kVectors = 19;

TEST(Step, WithContactsThatComeAndGoAllocatesForMoreThanEverOnly) {
  const SceneBuilder scenes[] = {
      lying(floor_at(-3e-3), false),  // bounces
      lying(capsule_below(Vector3(0.1, 0, -0.02), Vector3(0.1, 0, -0.02)), false),
      lying(capsule_below(Vector3(0.1, -0.1, -0.02), Vector3(0.1, 0.1, -0.02)), false),
      lying(floor_at(0.0), true),
      lying(floor_at(0.0), true, true),
  };
  for (const SceneBuilder& scene : scenes)
    for (Integrator integrator : kWithContact)
      for (const Rubbing& rubbing : kRubbing) {
        World world = rubbing_world(scene, rubbing, integrator);
        const Allocated first = allocated_by(world, 300), later = allocated_by(world, 100);
        const std::string what = "scene " + std::to_string(&scene - scenes) + name_of(integrator, rubbing);
        EXPECT_LE(later.others, kVectors * (1 + later.layouts)) << what;
        EXPECT_LT(later.layouts, std::max<std::size_t>(first.layouts, 1)) << what;
      }
}

/// Nor where surfaces are pushed deep into each other, so that steps are repeated with stiffer contact.
TEST(Step, ThatIsRepeatedWithStifferContactDoesNotAllocateAfterWarmUp) {
  for (StiffnessRule rule : {StiffnessRule::forces, StiffnessRule::source}) {
    SceneBuilder builder = lying(floor_at(0.0), false);
    builder.scene.contact.stiffness_rule = rule;
    builder.scene.contact.obstacle_friction = MatrixX3::Zero(1, 3);
    builder.scene.contact.obstacle_restitution = VectorX::Ones(1);
    const int push = builder.load(LoadKind::force, {0, 8}, Vector3::Zero());
    World world(builder.scene, testing::options(Integrator::backward_euler, 2e-3));
    const auto pushes = [&](int first, int last) {
      for (int k = first; k < last; ++k) {
        const Eigen::RowVector3d force(0, 0, k % 10 == 5 ? -20.0 - k : 0.0);
        world.set_load(push, force);
        world.step(1);
      }
    };
    pushes(0, 60);
    const std::size_t before = allocation_count;
    pushes(60, 120);
    EXPECT_EQ(allocation_count - before, 0u) << static_cast<int>(rule);
  }
}

}  // namespace
}  // namespace withe
