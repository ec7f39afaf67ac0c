// Snapshots, copies and repeated runs: the same bits, and bytes that are damaged change nothing.

#include <gtest/gtest.h>

#include <functional>
#include <optional>

#include <Eigen/Geometry>

#include "worlds.hpp"

namespace withe {
namespace {

using testing::options;
using testing::same_state;
using testing::SceneBuilder;

constexpr Integrator kDynamic[] = {Integrator::backward_euler, Integrator::implicit_midpoint,
                                   Integrator::energy_momentum, Integrator::fourth_order, Integrator::verlet};

/// True if a scene can run backwards, as parts of fourth-order steps do.
bool reversible(const SceneDescription& scene) {
  for (const RodDescription& rod : scene.rods)
    if ((rod.viscous_time.array() > 0.0).any()) return false;
  return true;
}

Options options_for(Integrator integrator) {
  return options(integrator, integrator == Integrator::verlet ? 5e-5 : 5e-3);
}

std::vector<SceneDescription> scenes() {
  testing::RodMaterial lossy = testing::rubber();
  lossy.viscous_time = 2e-3;
  lossy.drag = 0.05;
  SceneBuilder joint = testing::tee(JointForm::frame, false, lossy);
  joint.scene.gravity = Vector3(0, 0, -1.0);
  joint.support(SupportKind::pin, {0, 0});
  SceneBuilder loaded = testing::hanging_arm();
  loaded.load(LoadKind::force, {0, 11}, Vector3(0.01, 0, 0), true);
  return {testing::hanging_arm().scene, testing::cantilever(12, lossy).scene, joint.scene, loaded.scene};
}

TEST(Snapshot, ContinuesWithTheSameBitsInTheSameWorldAndInANewOne) {
  for (const SceneDescription& scene : scenes())
    for (Integrator integrator : kDynamic) {
      if (integrator == Integrator::fourth_order && !reversible(scene)) continue;
      World world(scene, options_for(integrator));
      world.step(6);
      const std::string bytes = world.snapshot();
      world.step(6);
      World other(scene, options_for(integrator));
      other.restore(bytes);
      other.step(6);
      EXPECT_TRUE(same_state(world, other)) << static_cast<int>(integrator);
      world.restore(bytes);
      world.step(6);
      EXPECT_TRUE(same_state(world, other)) << static_cast<int>(integrator);
    }
}

/// A rod that lands on another one and on a floor.
SceneDescription landing(double friction) {
  SceneBuilder builder;
  builder.scene.gravity = Vector3(0, 0, -9.81);
  builder.add_rod(testing::line(Vector3(-0.12, -0.01, 5.2e-3), Vector3(0.12, 0.01, 5.2e-3), 13), testing::rubber());
  builder.add_rod(testing::line(Vector3(3e-3, -0.12, 0.017), Vector3(3e-3, 0.12, 0.019), 13), testing::rubber());
  for (RodDescription& rod : builder.scene.rods) rod.contact_radius.setConstant(12, 5e-3);
  ContactDescription& contact = builder.scene.contact;
  contact.rods = true;
  contact.friction = friction;
  contact.obstacles.emplace_back();
  contact.obstacle_friction = MatrixX3::Constant(1, 3, friction);
  contact.obstacle_restitution = VectorX::Ones(1);
  return builder.scene;
}

TEST(Snapshot, ChangesNothingThatFollows) {
  std::vector<SceneDescription> all = scenes();
  all.push_back(landing(0.0));
  all.push_back(landing(0.4));
  for (const SceneDescription& scene : all)
    for (Integrator integrator : kDynamic) {
      if (integrator == Integrator::fourth_order && (!reversible(scene) || scene.contact.any())) continue;
      if (integrator == Integrator::verlet && scene.contact.friction > 0.0) continue;
      World world(scene, options_for(integrator)), untouched(scene, options_for(integrator));
      for (int k = 0; k < 8; ++k) {
        world.step(3);
        untouched.step(3);
        const std::string bytes = world.snapshot();
        World copy(world), restored(scene, options_for(integrator));
        restored.restore(bytes);
        copy.energy();
        copy.contacts();
        copy.linearise();
        for (World* other : {&copy, &restored, &world}) other->step(2);
        untouched.step(2);
        EXPECT_TRUE(same_state(untouched, world)) << static_cast<int>(integrator) << ", " << k;
        EXPECT_TRUE(same_state(untouched, copy)) << static_cast<int>(integrator) << ", " << k;
        EXPECT_TRUE(same_state(untouched, restored)) << static_cast<int>(integrator) << ", " << k;
      }
    }
}

TEST(Snapshot, OfErrorControlledStepsGoesBackToTheStartAndToTheMiddle) {
  for (Integrator integrator : {Integrator::backward_euler, Integrator::implicit_midpoint, Integrator::energy_momentum,
                                Integrator::fourth_order}) {
    Options controlled = options_for(integrator);
    controlled.tolerance = 1e-3;
    World world(testing::hanging_arm().scene, controlled);
    const std::string start = world.snapshot();
    world.step(3);
    const std::string middle = world.snapshot();
    world.step(3);
    World fresh(testing::hanging_arm().scene, controlled);
    fresh.restore(middle);
    fresh.step(3);
    EXPECT_TRUE(same_state(world, fresh)) << static_cast<int>(integrator);
    world.restore(start);
    EXPECT_TRUE(world.snapshot() == start) << static_cast<int>(integrator);
    world.step(3);
    EXPECT_TRUE(world.snapshot() == middle) << static_cast<int>(integrator);
    world.step(3);
    EXPECT_TRUE(same_state(world, fresh)) << static_cast<int>(integrator);
  }
}

TEST(Snapshot, IsTheSameBytesAfterARestore) {
  for (const SceneDescription& scene : scenes()) {
    World world(scene, options_for(Integrator::implicit_midpoint));
    world.step(5);
    const std::string bytes = world.snapshot();
    World other(scene, options_for(Integrator::implicit_midpoint));
    other.restore(bytes);
    EXPECT_TRUE(other.snapshot() == bytes);
  }
}

/// Runs `before`, takes a snapshot, runs `after` on this world and on one that takes the snapshot fresh, and on
/// this world again.
void expect_same_continuation(const SceneDescription& scene, Integrator integrator,
                              const std::function<void(World&)>& before, const std::function<void(World&)>& after,
                              const char* what) {
  World world(scene, options_for(integrator));
  before(world);
  const std::string bytes = world.snapshot();
  after(world);
  World fresh(scene, options_for(integrator));
  fresh.restore(bytes);
  EXPECT_TRUE(fresh.snapshot() == bytes) << what;
  after(fresh);
  EXPECT_TRUE(same_state(world, fresh)) << what << ", a new world, scheme " << static_cast<int>(integrator);
  world.restore(bytes);
  EXPECT_TRUE(world.snapshot() == bytes) << what;
  after(world);
  EXPECT_TRUE(same_state(world, fresh)) << what << ", the same world, scheme " << static_cast<int>(integrator);
}

TEST(Snapshot, RemembersSupportsThatCameAndWent) {
  const auto five = [](World& w) { w.step(5); };
  for (Integrator integrator : {Integrator::backward_euler, Integrator::implicit_midpoint})
    for (const SceneDescription& scene : {testing::hanging_arm().scene, testing::cantilever().scene}) {
      const auto change = [](World& w) {
        w.step(3);
        w.add_support(testing::support(SupportKind::pin, {0, 11}));
        w.step(2);
        w.remove_support(0);
        w.add_support(testing::support(SupportKind::clamp, {0, 5}));
        w.step(2);
      };
      expect_same_continuation(scene, integrator, change, five, "supports before");
      expect_same_continuation(scene, integrator, five, change, "supports after");
    }
}

TEST(Snapshot, TellsApartSupportsOfTheSameNumber) {
  const SceneDescription scene = testing::hanging_arm().scene;
  World a(scene, options_for(Integrator::implicit_midpoint)), b(scene, options_for(Integrator::implicit_midpoint));
  a.add_support(testing::support(SupportKind::pin, {0, 11}));
  b.add_support(testing::support(SupportKind::pin, {0, 6}));
  b.restore(a.snapshot());
  a.step(5);
  b.step(5);
  EXPECT_TRUE(same_state(a, b));
  EXPECT_LT((b.positions().row(11) - scene.positions.row(11)).norm(), 1e-12);
}

TEST(Snapshot, RemembersThatAWorldLeftItsPlane) {
  const SceneDescription scene = testing::cantilever().scene;
  const auto leave = [](World& w) {
    w.step(4);
    w.set_gravity(Vector3(0, 1.0, -9.81));
    w.step(4);
  };
  expect_same_continuation(scene, Integrator::implicit_midpoint, leave, [](World& w) { w.step(4); }, "plane left");
  expect_same_continuation(scene, Integrator::implicit_midpoint, [](World& w) { w.step(4); }, leave, "plane to leave");
}

/// A callback prescribes motion within a step. If the motion leaves the plane, the step returns to a start in the
/// plane.
TEST(Snapshot, OfAWorldThatLeavesItsPlaneWithinAStep) {
  const SceneDescription scene = testing::cantilever(21).scene;
  for (Integrator integrator : {Integrator::backward_euler, Integrator::implicit_midpoint, Integrator::energy_momentum,
                                Integrator::fourth_order})
    for (const std::optional<double>& tolerance : {std::optional<double>{}, std::optional<double>{1e-3}}) {
      Options planar = options_for(integrator);
      planar.tolerance = tolerance;
      Options space = planar;
      space.planar = false;
      World a(scene, planar), b(scene, space);
      for (World* world : {&a, &b}) {
        world->step(2);
        world->set_step_callback([](World& w, double, double end) {
          const Vector3 turn = 8.0 * std::max(0.0, end - 0.013) * Vector3(0.0, -1.0, 0.7);
          w.prescribe_support(0, Vector3::Zero(),
                              Matrix3(Eigen::AngleAxisd(turn.norm(), Vector3(0, -1, 0.7).normalized())));
        });
        world->step(20);
        world->set_step_callback({});
      }
      ASSERT_FALSE(a.plan().planar);
      EXPECT_LT((a.positions() - b.positions()).cwiseAbs().maxCoeff(), tolerance ? 1e-3 : 1e-7)
          << static_cast<int>(integrator);
      World c(scene, planar);
      c.restore(a.snapshot());
      a.step(3);
      c.step(3);
      EXPECT_TRUE(same_state(a, c)) << static_cast<int>(integrator);
    }
}

TEST(Snapshot, AfterAStepThatMissedItsToleranceIsNotRefused) {
  for (int most : {1, 2, 3, 5}) {
    Options o = options_for(Integrator::implicit_midpoint);
    o.tolerance = 1e-13;
    o.max_halvings = most;
    World world(testing::hanging_arm().scene, o);
    EXPECT_THROW(world.step(50), ConvergenceFailure) << most;
    const std::string bytes = world.snapshot();
    EXPECT_NO_THROW(world.restore(bytes)) << most;
  }
}

TEST(Snapshot, RemembersRampsLoadsAndMotions) {
  SceneBuilder builder = testing::hanging_arm();
  builder.load(LoadKind::force, {0, 11}, Vector3(0.01, 0, 0));
  const auto act = [](World& w) {
    MatrixX2 k = w.natural_curvature(0);
    k.setConstant(5.0);
    w.set_natural_curvature(0, k, 0.05);
    w.set_natural_twist(0, VectorX::Constant(k.rows(), 3.0), 0.04);
    w.move_support(0, Vector3(0.12, 0.02, 0.0), Matrix3(Eigen::AngleAxisd(0.5, Vector3::UnitZ())), 0.06);
    w.set_load(0, Vector3(0, 0.02, 0).transpose());
    w.step(4);
  };
  for (Integrator integrator : {Integrator::implicit_midpoint, Integrator::energy_momentum})
    expect_same_continuation(builder.scene, integrator, act, [](World& w) { w.step(12); }, "actuation");
}

TEST(Snapshot, OfAnotherSceneIsRefused) {
  World a(testing::hanging_arm(12).scene, Options{}), b(testing::hanging_arm(13).scene, Options{});
  EXPECT_THROW(b.restore(a.snapshot()), std::invalid_argument);
}

TEST(Snapshot, DamagedAnywhereIsRefusedAndChangesNothing) {
  World world(testing::hanging_arm(6).scene, Options{}), untouched(world);
  const std::string bytes = world.snapshot();
  for (std::size_t i = 0; i < bytes.size(); i += 7) {
    std::string flipped = bytes;
    flipped[i] = static_cast<char>(flipped[i] ^ (1 << (i % 8)));
    EXPECT_THROW(world.restore(flipped), std::invalid_argument) << i;
    EXPECT_THROW(world.restore(bytes.substr(0, i)), std::invalid_argument) << i;
  }
  EXPECT_THROW(world.restore(bytes + "x"), std::invalid_argument);
  EXPECT_THROW(world.restore(""), std::invalid_argument);
  EXPECT_TRUE(same_state(world, untouched));
}

/// FNV-1a, as at the end of every snapshot.
std::string sealed(std::string body) {
  std::uint64_t hash = 14695981039346656037ull;
  for (const char c : body) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ull;
  body.append(reinterpret_cast<const char*>(&hash), sizeof hash);
  return body;
}

TEST(Snapshot, ForgedWithAValidSealEndsInAnErrorOrInAWorldThatRuns) {
  SceneBuilder builder = testing::hanging_arm(5);
  Options o = options(Integrator::implicit_midpoint);
  o.max_halvings = 3;
  World world(builder.scene, o);
  world.add_support(testing::support(SupportKind::pin, {0, 4}));
  world.step(2);
  const std::string sound = world.snapshot(), body = sound.substr(0, sound.size() - 8);
  ASSERT_EQ(sealed(body), sound);
  std::mt19937 random(5);
  int refused = 0, ran = 0;
  for (int k = 0; k < 400; ++k) {
    std::string forged = body;
    for (int n = 0; n < 1 + k % 3; ++n) {
      // The head, where counts and indices are, as often as the long tail of numbers.
      const std::size_t limit = k % 2 ? forged.size() : std::min<std::size_t>(forged.size(), 260);
      forged[random() % limit] = static_cast<char>(random());
    }
    World victim(builder.scene, o);
    try {
      victim.restore(sealed(forged));
      victim.step(1);
      ++ran;
    } catch (const std::invalid_argument&) {
      ++refused;
    } catch (const ConvergenceFailure&) {
      ++ran;
    }
  }
  EXPECT_GT(refused, 50);
  EXPECT_GT(ran, 50);
}

TEST(Copy, GoesOnLikeItsOriginalBitForBit) {
  for (const SceneDescription& scene : scenes())
    for (Integrator integrator : kDynamic) {
      if (integrator == Integrator::fourth_order && !reversible(scene)) continue;
      World world(scene, options_for(integrator));
      world.step(5);
      World copy(world);
      EXPECT_TRUE(same_state(world, copy));
      copy.step(6);
      world.step(6);
      EXPECT_TRUE(same_state(world, copy)) << static_cast<int>(integrator);
    }
}

TEST(Copy, IsIndependentOfItsOriginal) {
  World world(testing::hanging_arm().scene, Options{});
  world.step(3);
  const World before(world);
  World copy(world);
  copy.set_gravity(Vector3(5, 0, 0));
  copy.remove_support(0);
  copy.step(5);
  EXPECT_TRUE(same_state(world, before));
}

TEST(Step, IsRepeatableBitForBit) {
  for (const SceneDescription& scene : scenes())
    for (Integrator integrator : kDynamic) {
      if (integrator == Integrator::fourth_order && !reversible(scene)) continue;
      World a(scene, options_for(integrator)), b(scene, options_for(integrator));
      a.step(10);
      for (int k = 0; k < 10; ++k) b.step();
      EXPECT_TRUE(same_state(a, b)) << static_cast<int>(integrator);
    }
}

TEST(Equilibrium, IsRepeatableBitForBit) {
  World a(testing::hanging_arm().scene, options(Integrator::statics));
  World b(testing::hanging_arm().scene, options(Integrator::statics));
  a.equilibrium();
  b.equilibrium();
  EXPECT_TRUE(same_state(a, b));
}

}  // namespace
}  // namespace withe
