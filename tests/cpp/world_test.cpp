// A scene while it runs: supports, reactions, actuation, energy, adaptive steps, and what is refused.

#include "world/world.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "worlds.hpp"

namespace withe {
namespace {

using testing::options;
using testing::same_state;
using testing::SceneBuilder;

Matrix3 turn(double angle, const Vector3& axis) { return Eigen::AngleAxisd(angle, axis).toRotationMatrix(); }

double weight_of(const SceneDescription& scene) {
  double mass = scene.added_mass.sum();
  for (const RodDescription& rod : scene.rods) mass += rod.line_density.dot(rod.rest_lengths);
  return 9.81 * mass;
}

/// Moment of the weight about a point.
Vector3 weight_moment(const World& world, const Vector3& about) {
  Vector3 moment = Vector3::Zero();
  const MatrixX3 x = world.positions();
  for (const RodDescription& rod : world.description().rods)
    for (Eigen::Index e = 0; e < rod.rest_lengths.size(); ++e)
      for (int end = 0; end < 2; ++end) {
        const int node = rod.nodes[static_cast<std::size_t>(e + end) % rod.nodes.size()];
        const double mass = 0.5 * rod.rest_lengths(e) * rod.line_density(e);
        moment += (x.row(node).transpose() - about).cross(Vector3(0, 0, -9.81 * mass));
      }
  return moment;
}

std::vector<SceneDescription> hanging_scenes() {
  SceneBuilder held = testing::hanging_arm();
  held.scene.supports[0].kind = SupportKind::hold_edge;
  SceneBuilder tee = testing::tee(JointForm::frame, false, testing::rubber());
  tee.scene.positions *= 0.08;
  for (RodDescription& rod : tee.scene.rods) rod.rest_lengths *= 0.08;
  tee.scene.gravity = Vector3(0, 0, -9.81);
  tee.support(SupportKind::clamp, {0, 0});
  return {testing::hanging_arm().scene, testing::cantilever().scene, held.scene, tee.scene};
}

TEST(Reaction, CarriesTheWeightAndItsMomentInEquilibrium) {
  for (const SceneDescription& scene : hanging_scenes()) {
    World world(scene, options(Integrator::statics));
    world.equilibrium();
    const Reaction r = world.reaction(0);
    const double weight = weight_of(scene);
    EXPECT_LT((r.force - Vector3(0, 0, weight)).norm(), 1e-6 * weight);
    const Vector3 root = world.support_position(0), moment = weight_moment(world, root);
    EXPECT_LT((r.moment + moment).norm(), 1e-6 * (moment.norm() + 0.1 * weight));
  }
}

TEST(Reaction, OfTwoSupportsSharesTheWeight) {
  SceneBuilder builder = testing::hanging_arm();
  builder.support(SupportKind::pin, {0, 11});
  World world(builder.scene, options(Integrator::statics));
  world.equilibrium();
  const Vector3 sum = world.reaction(0).force + world.reaction(1).force;
  EXPECT_LT((sum - Vector3(0, 0, weight_of(builder.scene))).norm(), 1e-6 * weight_of(builder.scene));
  EXPECT_EQ(world.reaction(1).moment.norm(), 0.0);
}

TEST(Reaction, OfASlidingPinHasNoForceAlongItsWay) {
  SceneBuilder builder = testing::cantilever();
  const Vector3 way = Vector3(0.8, 0, 0.6);
  builder.support(SupportKind::pin, {0, 11}, way * way.transpose());
  World world(builder.scene, options(Integrator::statics));
  world.equilibrium();
  EXPECT_NEAR(world.reaction(1).force.dot(way), 0.0, 1e-12);
  EXPECT_GT(world.reaction(1).force.norm(), 1e-3);
}

TEST(Supports, HoldWhatTheyHoldWhileTheRestSwings) {
  for (SupportKind kind : {SupportKind::pin, SupportKind::clamp, SupportKind::hold_edge}) {
    SceneBuilder builder = testing::hanging_arm();
    builder.scene.supports[0].kind = kind;
    World world(builder.scene, options(Integrator::implicit_midpoint));
    const MatrixX3 before = world.positions();
    world.step(20);
    const MatrixX3 after = world.positions();
    EXPECT_LT((after.row(0) - before.row(0)).norm(), 1e-14);
    EXPECT_GT((after.row(11) - before.row(11)).norm(), 1e-3);
    if (kind == SupportKind::hold_edge) {
      EXPECT_LT((after.row(1) - before.row(1)).norm(), 1e-14);
    } else {
      EXPECT_GT((after.row(1) - before.row(1)).norm(), 1e-7);
    }
  }
}

TEST(Supports, ThatSlideStayOnTheirLine) {
  SceneBuilder builder = testing::hanging_arm();
  const Vector3 way = Vector3(0.6, 0.0, -0.8);
  builder.scene.supports[0].free = way * way.transpose();
  World world(builder.scene, options(Integrator::backward_euler));
  const Vector3 start = world.positions().row(0);
  world.step(20);
  const Vector3 moved = world.positions().row(0).transpose() - start;
  EXPECT_GT(moved.dot(way), 1e-2);
  EXPECT_LT((moved - way * moved.dot(way)).norm(), 1e-14);
}

TEST(Supports, MoveAndTurnTheWholeRodWhereNothingLoadsIt) {
  // A clamp that is carried elsewhere takes a weightless rod along, unstressed.
  for (SupportKind kind : {SupportKind::clamp, SupportKind::hold_edge})
    for (bool planar : {false, true}) {
      SceneBuilder builder;
      testing::RodMaterial material = testing::rubber();
      builder.add_rod(testing::line(Vector3::Zero(), planar ? Vector3(0.2, 0, 0.1) : Vector3(0.2, 0.1, 0.1), 8),
                      material, false, Vector3::UnitY());
      builder.support(kind, {0, 0});
      Options o = options(Integrator::statics, 0.1);
      o.planar = false;
      World world(builder.scene, o);
      const Vector3 to(0.3, planar ? 0.0 : -0.2, 0.1);
      const Matrix3 R = planar ? turn(1.2, Vector3::UnitY()) : turn(1.2, Vector3(1, 2, 2) / 3.0);
      const MatrixX3 before = world.positions();
      const MatrixX9 directors = world.directors(0);
      world.move_support(0, to, R, 1.0);
      world.step(10);
      const MatrixX3 after = world.positions();
      for (int i = 0; i < 8; ++i) {
        const Vector3 expected = to + R * (before.row(i) - before.row(0)).transpose();
        EXPECT_LT((after.row(i).transpose() - expected).norm(), 1e-7) << i;
      }
      const Vector3 d1 = world.directors(0).row(7 - 1).head<3>();
      EXPECT_LT((d1 - R * directors.row(6).head<3>().transpose()).norm(), 1e-6);
      EXPECT_LT(world.reaction(0).force.norm(), 1e-9);
      EXPECT_LT((world.support_position(0) - to).norm(), 1e-15);
      EXPECT_LT((world.support_rotation(0) - R).norm(), 1e-13);
    }
}

TEST(Supports, MoveAlongARampInTime) {
  World world(testing::hanging_arm().scene, options(Integrator::implicit_midpoint, 1e-2));
  const Vector3 from = world.support_position(0), to = from + Vector3(0.05, 0, 0);
  world.move_support(0, to, Matrix3::Identity(), 0.1);
  world.step(5);
  EXPECT_LT((world.positions().row(0).transpose() - 0.5 * (from + to)).norm(), 1e-12);
  world.step(10);
  EXPECT_LT((world.positions().row(0).transpose() - to).norm(), 1e-14);
}

TEST(Supports, FollowWhatTheStepCallbackPrescribes) {
  World world(testing::hanging_arm().scene, options(Integrator::backward_euler, 1e-2));
  const Vector3 from = world.support_position(0);
  const auto at = [&](double t) { return Vector3(from + Vector3(0.02 * std::sin(10.0 * t), 0, 0)); };
  world.set_step_callback([&](World& w, double, double end) { w.prescribe_support(0, at(end), Matrix3::Identity()); });
  for (int k = 1; k <= 10; ++k) {
    world.step();
    EXPECT_LT((world.positions().row(0).transpose() - at(world.time())).norm(), 1e-12);
  }
}

TEST(Supports, CanBeAddedReleasedAndAddedAgain) {
  for (const SceneDescription& scene : {testing::hanging_arm().scene, testing::cantilever().scene}) {
    World world(scene, options(Integrator::implicit_midpoint));
    world.step(10);
    const MatrixX3 before = world.positions();
    const int pin = world.add_support(testing::support(SupportKind::pin, {0, 11}));
    EXPECT_EQ(pin, 1);
    EXPECT_TRUE(testing::same_bits(before, world.positions()));
    world.step(10);
    EXPECT_LT((world.positions().row(11) - before.row(11)).norm(), 1e-14);
    world.remove_support(pin);
    world.step(10);
    EXPECT_GT((world.positions().row(11) - before.row(11)).norm(), 1e-3);
    EXPECT_THROW(world.reaction(pin), std::invalid_argument);
    EXPECT_THROW(world.remove_support(pin), std::invalid_argument);
    EXPECT_THROW(world.move_support(pin, Vector3::Zero(), Matrix3::Identity(), 0.0), std::invalid_argument);
    const int again = world.add_support(testing::support(SupportKind::clamp, {0, 11}));
    EXPECT_EQ(again, pin);  // rows of released supports are taken again, or those who clamp and let go grow for ever
    EXPECT_EQ(world.description().supports.size(), 2u);
    const Vector3 held = world.positions().row(11);
    world.step(5);
    EXPECT_LT((world.positions().row(11).transpose() - held).norm(), 1e-14);
  }
}

TEST(Supports, AddedToARodAtRestExertNothing) {
  for (SupportKind kind : {SupportKind::pin, SupportKind::clamp, SupportKind::hold_edge})
    for (const SceneDescription& scene : {testing::hanging_arm().scene, testing::cantilever().scene}) {
      World world(scene, options(Integrator::statics));
      world.equilibrium();
      const MatrixX3 before = world.positions();
      const int added = world.add_support(testing::support(kind, {0, 11}));
      world.equilibrium();
      EXPECT_LT((world.positions() - before).norm(), 1e-7) << static_cast<int>(kind);
      EXPECT_LT(world.reaction(added).force.norm(), 2e-4 * weight_of(scene));
    }
}

TEST(Supports, OfANodeThatIsHeldAreRefusedAndNothingChanges) {
  World world(testing::hanging_arm().scene, Options{});
  world.step(3);
  const World before(world);
  EXPECT_THROW(world.add_support(testing::support(SupportKind::pin, {0, 0})), std::invalid_argument);
  EXPECT_TRUE(same_state(world, before));
  world.step(2);
}

TEST(Supports, ThatAreReleasedDoNotFlattenASceneThatLeftItsPlane) {
  // Only the tilted slide keeps this scene from being planar; once it has moved, its release must keep the state.
  SceneBuilder builder = testing::cantilever();
  const Vector3 way = Vector3(0, 1, 1).normalized();
  builder.support(SupportKind::pin, {0, 11}, way * way.transpose());
  World world(builder.scene, options(Integrator::backward_euler));
  world.step(10);
  const MatrixX3 before = world.positions();
  ASSERT_GT(std::abs(before(11, 1)), 1e-4);
  world.remove_support(1);
  EXPECT_FALSE(world.plan().planar);
  EXPECT_TRUE(testing::same_bits(before, world.positions()));
}

TEST(Supports, LeaveTwoFramesOfOneNodeAsTheyAre) {
  // Two bent rods pinned to each other at a corner each; a support elsewhere rebuilds the model.
  SceneBuilder builder;
  const Vector3 o = Vector3::Zero();
  const testing::RodMaterial m = testing::rubber();
  builder.add_rod(testing::line(Vector3(-0.2, 0, 0), o, 5), m);
  builder.add_rod(testing::line(o, Vector3(0, 0.2, 0.05), 5), m, false, Vector3(1, 0, 0));
  builder.add_rod(testing::line(Vector3(0.1, -0.2, 0), o, 5), m);
  builder.add_rod(testing::line(o, Vector3(0.05, 0.1, -0.2), 5), m, false, Vector3(1, 0, 0));
  builder.scene.joints.push_back(
      {.clusters = {{{0, 4}, {1, 0}}, {{2, 4}, {3, 0}}}, .bodies = {}, .links = {}, .form = JointForm::frame});
  builder.scene.gravity = Vector3(0, 0, -9.81);
  builder.support(SupportKind::clamp, {0, 0});
  World world(builder.scene, options(Integrator::implicit_midpoint));
  world.step(20);
  const Energy before = world.energy();
  world.add_support(testing::support(SupportKind::pin, {1, 4}));
  const Energy after = world.energy();
  EXPECT_NEAR(after.bend, before.bend, 1e-12 * before.bend);
  EXPECT_NEAR(after.twist, before.twist, 1e-12 * before.bend);
}

TEST(Plane, IsLeftWithoutAJumpWhenSomethingPointsOutOfIt) {
  World world(testing::cantilever().scene, options(Integrator::implicit_midpoint));
  ASSERT_TRUE(world.plan().planar);
  world.step(10);
  const MatrixX3 x = world.positions(), v = world.velocities();
  const MatrixX9 d = world.directors(0);
  const Energy before = world.energy();
  world.set_gravity(Vector3(0, 2.0, -9.81));
  EXPECT_FALSE(world.plan().planar);
  EXPECT_LT((world.positions() - x).norm(), 1e-14);
  EXPECT_LT((world.velocities() - v).norm(), 1e-14);
  EXPECT_LT((world.directors(0) - d).norm(), 1e-12);
  EXPECT_NEAR(world.energy().bend, before.bend, 1e-12 * before.bend);
  world.step(10);
  EXPECT_GT(world.positions()(11, 1), 1e-4);
}

TEST(Plane, IsNotLeftWhereTheUserAskedForIt) {
  Options o;
  o.planar = true;
  World world(testing::cantilever().scene, o);
  const World before(world);
  EXPECT_THROW(world.set_gravity(Vector3(0, 2.0, -9.81)), std::invalid_argument);
  EXPECT_THROW(world.move_support(0, Vector3(0, 0.1, 0), Matrix3::Identity(), 0.0), std::invalid_argument);
  const Vector3 tilted = Vector3(0, 1, 1).normalized();
  EXPECT_THROW(world.add_support(testing::support(SupportKind::pin, {0, 11}, tilted * tilted.transpose())),
               std::invalid_argument);
  EXPECT_TRUE(same_state(world, before));
}

TEST(Plane, GivesTheTrajectoryOfTheSameSceneInSpace) {
  for (Integrator integrator : {Integrator::backward_euler, Integrator::implicit_midpoint}) {
    Options flat = options(integrator), space = flat;
    flat.step_tolerance = space.step_tolerance = 1e-12;
    flat.force_tolerance = space.force_tolerance = 1e-11;
    space.planar = false;
    World a(testing::cantilever().scene, flat), b(testing::cantilever().scene, space);
    a.step(20);
    b.step(20);
    EXPECT_LT((a.positions() - b.positions()).norm(), 1e-9 * 0.3);
    EXPECT_LT((a.reaction(0).moment - b.reaction(0).moment).norm(), 1e-7 * a.reaction(0).moment.norm());
  }
}

TEST(Actuation, RampsReachTheirValueOnTimeAndNotBefore) {
  World world(testing::hanging_arm().scene, options(Integrator::implicit_midpoint, 1e-2));
  MatrixX2 target = world.natural_curvature(0);
  target.setConstant(4.0);
  world.set_natural_curvature(0, target, 0.1);
  world.step(5);
  EXPECT_LT((world.natural_curvature(0) - 0.5 * target).norm(), 1e-12);
  world.step(7);
  EXPECT_EQ((world.natural_curvature(0) - target).norm(), 0.0);
}

TEST(Actuation, GoesThroughARampAgainWhenAStepIsTakenBack) {
  // Whatever error control does inside, after half of the ramp half of it is there.
  Options o = options(Integrator::implicit_midpoint, 0.1);
  o.tolerance = 1e-5;
  o.max_halvings = 20;
  World world(testing::hanging_arm().scene, o);
  MatrixX2 target = world.natural_curvature(0);
  target.setConstant(10.0);
  world.set_natural_curvature(0, target, 0.1);
  std::vector<std::pair<double, double>> seen;  // time and curvature at the start of each attempt
  world.set_step_callback([&](World& w, double, double) { seen.emplace_back(w.time(), w.natural_curvature(0)(0, 0)); });
  world.step();
  ASSERT_GT(world.statistics().rejected_steps, 0);
  for (const auto& [time, curvature] : seen) EXPECT_NEAR(curvature, 10.0 * time / 0.1, 1e-9);
}

TEST(Energy, IsConservedByEnergyMomentumStepsUncut) {
  Options o = options(Integrator::energy_momentum, 5e-3);
  World world(testing::hanging_arm().scene, o);
  const Energy start = world.energy();
  double greatest = 0.0;
  for (int k = 0; k < 100; ++k) {
    world.step();
    greatest = std::max(greatest, world.energy().kinetic);
    EXPECT_LT(std::abs(world.energy().total - start.total), 1e-8 * std::max(greatest, 1e-6));
  }
  EXPECT_EQ(world.statistics().rejected_steps, 0);
}

TEST(Energy, BalancesWorkAndDissipationUnderEnergyMomentumSteps) {
  testing::RodMaterial lossy = testing::rubber();
  lossy.viscous_time = 5e-3;
  lossy.drag = 0.05;
  SceneBuilder builder = testing::hanging_arm(12, lossy);
  builder.load(LoadKind::force, {0, 11}, Vector3(0.02, 0.01, 0), true);
  Options o = options(Integrator::energy_momentum, 1e-2);
  o.force_tolerance = 1e-11;
  o.step_tolerance = 1e-12;
  World world(builder.scene, o);
  const Energy start = world.energy();
  world.move_support(0, world.support_position(0) + Vector3(0.02, 0, 0.03), Matrix3::Identity(), 0.2);
  world.step(40);
  const Energy end = world.energy();
  EXPECT_GT(end.dissipated, 0.0);
  const double scale = end.dissipated + std::abs(end.work) + end.kinetic;
  EXPECT_NEAR(end.total - start.total, end.work - end.dissipated, 1e-7 * scale);
}

TEST(Momentum, OfAFreeRodFallsWithGravityOnly) {
  for (Integrator integrator :
       {Integrator::backward_euler, Integrator::implicit_midpoint, Integrator::energy_momentum}) {
    SceneBuilder builder;
    builder.add_rod(0.15 * testing::helix(10), testing::rubber());
    builder.scene.gravity = Vector3(0, 0, -9.81);
    World world(builder.scene, options(integrator));
    MatrixX3 v(10, 3);
    for (int i = 0; i < 10; ++i) v.row(i) << 0.1 * i, 0.3, -0.05 * i;
    world.set_velocities(v);
    VectorX mass = VectorX::Ones(10);
    mass(0) = mass(9) = 0.5;  // edges of equal length
    const Vector3 before = world.velocities().transpose() * mass;
    world.step(10);
    const Vector3 change = world.velocities().transpose() * mass - before;
    EXPECT_LT((change / mass.sum() - Vector3(0, 0, -9.81 * world.time())).norm(), 1e-6) << static_cast<int>(integrator);
  }
}

TEST(AdaptiveSteps, LeaveTheLastAcceptedStateOnFailure) {
  Options o = options(Integrator::backward_euler, 5e-3);
  o.adaptive = false;
  World world(testing::hanging_arm().scene, o);
  world.step(3);
  const World before(world);
  // A force that no step can take.
  world.set_gravity(Vector3(1e9, 0, 0));
  try {
    world.step();
    FAIL() << "a step under 1e8 g converged";
  } catch (const ConvergenceFailure& failure) {
    EXPECT_EQ(failure.time, before.time());
    EXPECT_EQ(failure.step, 5e-3);
    EXPECT_EQ(failure.rod, 0);
    EXPECT_GE(failure.node, 0);
    EXPECT_LT(failure.node, 12);
    EXPECT_GT(failure.residual, 0.0);
  }
  world.set_gravity(Vector3(0, 0, -9.81));
  EXPECT_TRUE(same_state(world, before));
  World other(before);
  world.step(3);
  other.step(3);
  EXPECT_TRUE(testing::same_bits(world.positions(), other.positions()));
}

TEST(AdaptiveSteps, HalveWhereAWholeStepFailsAndGrowBack) {
  World world(testing::hanging_arm().scene, options(Integrator::backward_euler, 2e-2));
  MatrixX3 v = MatrixX3::Zero(12, 3);
  v.row(11) << 0, 200.0, 0;  // the tip is hit
  world.set_velocities(v);
  world.step(2);
  EXPECT_GT(world.statistics().rejected_steps, 0);
  EXPECT_NEAR(world.time(), 4e-2, 1e-15);
  world.step(30);
  const long steps = world.statistics().steps;
  world.step(10);
  EXPECT_LE(world.statistics().steps - steps, 20);
}

TEST(AdvanceTo, LandsOnItsTimeExactly) {
  World world(testing::hanging_arm().scene, options(Integrator::implicit_midpoint, 7e-3));
  world.advance_to(0.1);
  EXPECT_EQ(world.time(), 0.1);
  EXPECT_EQ(world.statistics().steps, 15);
  EXPECT_THROW(world.advance_to(0.05), std::invalid_argument);
}

TEST(Interrupt, EndsStepAndLeavesAWorldThatGoesOn) {
  World world(testing::hanging_arm().scene, Options{});
  world.interrupt();
  EXPECT_THROW(world.step(), Interrupted);
  world.step();
  EXPECT_GT(world.time(), 0.0);
}

TEST(Interrupt, InAnyIterationLeavesTheLastAcceptedState) {
  // Ramps, moving supports and loads that grow are all under way when the iteration is cut off.
  for (Integrator integrator :
       {Integrator::implicit_midpoint, Integrator::fourth_order, Integrator::backward_euler, Integrator::statics}) {
    SceneBuilder builder = testing::hanging_arm();
    builder.load(LoadKind::moment, {0, 11}, Vector3(0, 1e-4, 0));
    World world(builder.scene, options(integrator));
    world.step();
    world.set_natural_curvature(0, MatrixX2::Constant(10, 2, 4.0), 0.1);
    world.move_support(0, world.support_position(0) + Vector3(0, 0, 0.01), turn(0.3, Vector3::UnitY()), 0.1);
    const World before(world);
    long asked = 0;
    for (long cut = 1; cut < 100; ++cut) {
      asked = 0;
      world.set_poll([&] {
        if (++asked == cut) throw Interrupted();
      });
      try {
        world.step();
        break;
      } catch (const Interrupted&) {
        ASSERT_TRUE(same_state(world, before)) << cut;
        ASSERT_TRUE(testing::same_bits(world.support_position(0), before.support_position(0)));
        ASSERT_EQ(world.load(0), before.load(0));
      }
    }
    EXPECT_GT(asked, 2);
    World fresh(before);
    fresh.step();
    EXPECT_TRUE(same_state(world, fresh));
  }
}

TEST(Equilibrium, OfAFreeRodUnderGravityIsAFailure) {
  SceneBuilder builder;
  builder.add_rod(testing::helix(8));
  builder.scene.gravity = Vector3(0, 0, -9.81);
  World world(builder.scene, options(Integrator::statics));
  EXPECT_THROW(world.equilibrium(), ConvergenceFailure);
}

TEST(BadInput, IsRefusedByName) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  SceneBuilder builder = testing::hanging_arm();
  builder.load(LoadKind::force, {0, 11}, Vector3(0.01, 0, 0));
  EXPECT_THROW(World(builder.scene, options(Integrator::implicit_midpoint, 0.0)), std::invalid_argument);
  EXPECT_THROW(World(builder.scene, options(Integrator::implicit_midpoint, nan)), std::invalid_argument);
  EXPECT_THROW(World(SceneDescription{}, Options{}), std::invalid_argument);
  World world(builder.scene, Options{});
  const World before(world);
  const Matrix3 I = Matrix3::Identity();
  EXPECT_THROW(world.step(-1), std::invalid_argument);
  EXPECT_THROW(world.set_load(1, MatrixX3::Zero(1, 3)), std::invalid_argument);
  EXPECT_THROW(world.set_load(0, Vector3(nan, 0, 0).transpose()), std::invalid_argument);
  EXPECT_THROW(world.set_gravity(Vector3(nan, 0, 0)), std::invalid_argument);
  EXPECT_THROW(world.set_natural_curvature(0, MatrixX2::Zero(3, 2), 0.0), std::invalid_argument);
  EXPECT_THROW(world.set_natural_curvature(1, MatrixX2::Zero(10, 2), 0.0), std::invalid_argument);
  EXPECT_THROW(world.set_natural_curvature(0, MatrixX2::Constant(10, 2, 1e3), 0.0), std::invalid_argument);
  EXPECT_THROW(world.set_natural_curvature(0, MatrixX2::Zero(10, 2), -1.0), std::invalid_argument);
  EXPECT_THROW(world.set_natural_twist(0, VectorX::Constant(10, nan), 0.0), std::invalid_argument);
  EXPECT_THROW(world.move_support(0, Vector3::Zero(), 2.0 * I, 0.0), std::invalid_argument);
  EXPECT_THROW(world.move_support(0, Vector3(nan, 0, 0), I, 0.0), std::invalid_argument);
  EXPECT_THROW(world.move_support(5, Vector3::Zero(), I, 0.0), std::invalid_argument);
  EXPECT_THROW(world.set_velocities(MatrixX3::Zero(3, 3)), std::invalid_argument);
  EXPECT_THROW(world.set_added_mass(VectorX::Constant(12, -1.0)), std::invalid_argument);
  EXPECT_TRUE(same_state(world, before));
}

}  // namespace
}  // namespace withe
