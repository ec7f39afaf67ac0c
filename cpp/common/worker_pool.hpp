#pragma once
/// Threads that wait for lists of like tasks.

#include <cstddef>
#include <functional>
#include <memory>

namespace withe {

/// Runs lists of tasks with several threads, including the calling thread. The other threads are created at the first
/// list that needs them. They sleep between lists, and end with the pool. A process that is forked from a process with
/// a pool creates its own threads.
class WorkerPool {
 public:
  explicit WorkerPool(int workers);  ///< at least 1, including this thread
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  int workers() const { return workers_; }

  /// Calls work(i) once for every i below `count`, in any order, and returns when all calls have ended. While the
  /// calling thread waits for the others, it calls `waiting` about every 20 ms. Neither function may throw.
  void run(std::size_t count, const std::function<void(std::size_t)>& work, const std::function<void()>& waiting = {});

 private:
  struct Crew;
  void dismiss() noexcept;
  int workers_;
  std::unique_ptr<Crew> crew_;
};

}  // namespace withe
