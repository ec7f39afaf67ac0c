#include "common/worker_pool.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

#include "common/check.hpp"

namespace withe {

namespace {

// Polls before a thread sleeps, some 50 us: lists often follow each other faster than a sleeping thread wakes.
constexpr int kPolls = 1500;

/// Polls until a condition holds; false if it does not hold in time.
template <class Condition>
bool poll(const Condition& condition) {
  for (int i = 0; i < kPolls; ++i) {
    if (condition()) return true;
#if defined(__x86_64__)
    __builtin_ia32_pause();
#endif
  }
  return false;
}

}  // namespace

struct WorkerPool::Crew {
  explicit Crew(int others) {
    threads.reserve(static_cast<std::size_t>(others));
    try {
      for (int i = 0; i < others; ++i) threads.emplace_back([this] { serve(); });
    } catch (...) {
      end();
      throw;
    }
  }
  ~Crew() { end(); }
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;

  /// Works on a new list: every thread takes the next task until none is left.
  void begin(std::size_t tasks, const std::function<void(std::size_t)>& what) {
    {
      const std::lock_guard lock(mutex);
      count = tasks;
      work = &what;
      next = 0;
      busy = threads.size();
      ++list;
    }
    wake.notify_all();
    take();
  }

  /// True if every thread has come to the end of the list within 20 ms.
  bool finished() {
    if (poll([this] { return busy == 0; })) return true;
    std::unique_lock lock(mutex);
    return done.wait_for(lock, std::chrono::milliseconds(20), [this] { return busy == 0; });
  }

  const pid_t process = getpid();

 private:
  void take() {
    for (std::size_t i = next++; i < count; i = next++) (*work)(i);
  }

  void serve() {
    long seen = 0;
    for (;;) {
      poll([&] { return ending || list != seen; });
      std::unique_lock lock(mutex);
      // A wait without an end would ask for a newer library than wheels promise.
      while (!wake.wait_for(lock, std::chrono::hours(1), [&] { return ending || list != seen; })) {
      }
      if (ending) return;
      seen = list;
      lock.unlock();
      take();
      lock.lock();
      if (--busy == 0) done.notify_one();
    }
  }

  void end() {
    {
      const std::lock_guard lock(mutex);
      ending = true;
    }
    wake.notify_all();
    for (std::thread& thread : threads) thread.join();
  }

  std::mutex mutex;
  std::condition_variable wake, done;
  std::atomic<std::size_t> next{0};
  std::size_t count = 0;
  const std::function<void(std::size_t)>* work = nullptr;
  // Written under the mutex, and polled without it.
  std::atomic<std::size_t> busy{0};
  std::atomic<long> list{0};
  std::atomic<bool> ending{false};
  std::vector<std::thread> threads;
};

WorkerPool::WorkerPool(int workers) : workers_(workers) {
  require(workers >= 1, "workers must be at least 1, got ", workers);
}

WorkerPool::~WorkerPool() { dismiss(); }

/// The threads of a parent process are not here to be ended.
void WorkerPool::dismiss() noexcept {
  if (crew_ && crew_->process != getpid()) {
    [[maybe_unused]] const Crew* gone = crew_.release();
    return;
  }
  crew_.reset();
}

void WorkerPool::run(std::size_t count, const std::function<void(std::size_t)>& work,
                     const std::function<void()>& waiting) {
  if (workers_ == 1 || count <= 1) {
    for (std::size_t i = 0; i < count; ++i) work(i);
    return;
  }
  if (crew_ && crew_->process != getpid()) dismiss();
  if (!crew_) crew_ = std::make_unique<Crew>(workers_ - 1);
  crew_->begin(count, work);
  while (!crew_->finished())
    if (waiting) waiting();
}

}  // namespace withe
