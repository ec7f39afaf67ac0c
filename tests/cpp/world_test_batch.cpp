// Many worlds in one call: the same bits as alone, whatever the threads; one that fails holds up nobody.

#include <gtest/gtest.h>

#include <memory>
#include <numeric>

#include "world/batch.hpp"
#include "worlds.hpp"

namespace withe {
namespace {

using testing::options;
using testing::same_state;
using Worlds = std::vector<std::unique_ptr<World>>;

/// Arms that differ by how they are bent.
Worlds arms(int count, const Options& how = options(Integrator::implicit_midpoint)) {
  Worlds out;
  for (int i = 0; i < count; ++i) {
    out.push_back(std::make_unique<World>(testing::hanging_arm().scene, how));
    out.back()->set_natural_curvature(0, MatrixX2::Constant(1, 2, 0.7 * i - 1.0), 0.05);
  }
  return out;
}

std::vector<World*> pointers(const Worlds& worlds) {
  std::vector<World*> out;
  for (const auto& world : worlds) out.push_back(world.get());
  return out;
}

std::vector<int> all_of(const Batch& batch) {
  std::vector<int> out(static_cast<std::size_t>(batch.size()));
  std::iota(out.begin(), out.end(), 0);
  return out;
}

TEST(Batch, StepsToTheSameBitsAsEachWorldAloneForAnyNumberOfWorkers) {
  const Worlds alone = arms(5);
  for (const auto& world : alone) world->step(40);
  for (const int workers : {1, 2, 3}) {
    const Worlds lanes = arms(5);
    Batch batch(pointers(lanes), workers);
    for (int k = 0; k < 20; ++k) batch.step(all_of(batch), 2, {});
    for (std::size_t i = 0; i < lanes.size(); ++i) EXPECT_TRUE(same_state(*alone[i], *lanes[i])) << workers;
  }
}

TEST(Batch, StepsOnlyTheLanesThatAreNamed) {
  const Worlds lanes = arms(4);
  Batch batch(pointers(lanes), 2);
  batch.step(std::vector{1, 3}, 3, {});
  EXPECT_EQ(lanes[0]->time(), 0.0);
  EXPECT_GT(lanes[1]->time(), 0.0);
  EXPECT_EQ(lanes[2]->time(), 0.0);
  EXPECT_EQ(lanes[3]->time(), lanes[1]->time());
  EXPECT_THROW(batch.step(std::vector{1, 1}, 1, {}), std::invalid_argument);
  EXPECT_THROW(batch.step(std::vector{4}, 1, {}), std::invalid_argument);
}

TEST(Batch, PassesOverALaneThatFailedUntilItIsForgiven) {
  const Worlds lanes = arms(3), alone = arms(3);
  Batch batch(pointers(lanes), 2);
  batch.step(all_of(batch), 2, {});
  const std::string before = lanes[1]->snapshot();
  bool hopeless = true;
  lanes[1]->set_step_callback([&hopeless](World& world, double, double) {
    if (hopeless) throw ConvergenceFailure("no solution", world.time(), 5e-3, 0, 3, 1.0);
  });
  const double time = lanes[1]->time();
  for (int k = 0; k < 3; ++k) batch.step(all_of(batch), 1, {});
  ASSERT_TRUE(batch.failure(1).has_value());
  EXPECT_EQ(lanes[1]->time(), time);
  for (const std::size_t i : {0U, 2U}) {
    EXPECT_FALSE(batch.failure(static_cast<int>(i)).has_value());
    alone[i]->step(5);
    EXPECT_TRUE(same_state(*alone[i], *lanes[i]));
  }
  hopeless = false;
  const std::string* const back = &before;
  batch.restore(std::vector{1}, {&back, 1});
  batch.step(all_of(batch), 3, {});
  alone[1]->step(5);
  EXPECT_TRUE(same_state(*alone[1], *lanes[1]));
}

TEST(Batch, EndsWithinAStepWhatACheckThrowsAndLeavesEveryLaneWhereItWas) {
  // which come to rest: however far they get by then, none of them swings until its few edges fold
  const Worlds lanes = arms(4, options(Integrator::backward_euler));
  for (const int workers : {1, 3}) {
    Batch batch(pointers(lanes), workers);
    int asked = 0;
    const auto check = [&asked] {
      if (++asked == 2) throw std::domain_error("enough");
    };
    EXPECT_THROW(batch.step(all_of(batch), 100'000'000, check), std::domain_error);
    for (const auto& world : lanes) world->step(1);
  }
}

TEST(Batch, ReadsEveryLaneIntoOneArray) {
  const Worlds lanes = arms(3);
  Batch batch(pointers(lanes), 1);
  batch.step(all_of(batch), 5, {});
  std::vector<double> out(3 * batch.readout_size(LaneReadout::curvatures, 0));
  batch.read(LaneReadout::curvatures, 0, out.data());
  for (std::size_t i = 0; i < 3; ++i) {
    const MatrixX2 wanted = lanes[i]->curvatures(0);
    const Eigen::Map<const MatrixX2> found(out.data() + i * static_cast<std::size_t>(wanted.size()), wanted.rows(), 2);
    EXPECT_EQ(found, wanted);
  }
}

TEST(Batch, RefusesWorldsOfAnotherShapeAndTheSameOneTwice) {
  const Worlds lanes = arms(2);
  World longer(testing::hanging_arm(13).scene, options(Integrator::implicit_midpoint));
  EXPECT_THROW(Batch({lanes[0].get(), &longer}, 1), std::invalid_argument);
  EXPECT_THROW(Batch({lanes[0].get(), lanes[0].get()}, 1), std::invalid_argument);
  EXPECT_THROW(Batch({}, 1), std::invalid_argument);
  EXPECT_THROW(Batch(pointers(lanes), 0), std::invalid_argument);
}

}  // namespace
}  // namespace withe
