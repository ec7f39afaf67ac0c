// Every task is done once, whatever the number of threads.

#include <gtest/gtest.h>

#include <atomic>
#include <vector>

#include "common/worker_pool.hpp"

namespace withe {
namespace {

TEST(WorkerPool, DoesEveryTaskOnceForAnyNumberOfWorkers) {
  for (const int workers : {1, 2, 3, 7}) {
    WorkerPool pool(workers);
    for (const std::size_t count : {0U, 1U, 2U, 5U, 100U}) {
      std::vector<std::atomic<int>> times(count);
      pool.run(count, [&](std::size_t i) { ++times[i]; }, {});
      for (const auto& each : times) EXPECT_EQ(each, 1) << workers << " workers, " << count << " tasks";
    }
  }
}

TEST(WorkerPool, SeesWhatItsTasksWroteWhenTheyAreDone) {
  WorkerPool pool(3);
  std::vector<long> sums(50, 0);
  for (int list = 0; list < 200; ++list) pool.run(sums.size(), [&](std::size_t i) { sums[i] += list; }, {});
  for (const long sum : sums) EXPECT_EQ(sum, 200 * 199 / 2);
}

TEST(WorkerPool, RefusesToBeWithoutWorkers) { EXPECT_THROW(WorkerPool(0), std::invalid_argument); }

}  // namespace
}  // namespace withe
