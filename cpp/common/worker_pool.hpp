#pragma once
/// Threads that wait for lists of like tasks.

#include <cstddef>
#include <functional>
#include <memory>

namespace withe {

/// Does lists of tasks with several threads, of which the one that calls is one. The others are made at the first list
/// that needs them, sleep between lists, and end with the pool. A process that was forked from one with a pool makes
/// threads of its own.
class WorkerPool {
 public:
  explicit WorkerPool(int workers);  ///< at least 1, this thread counted
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  int workers() const { return workers_; }

  /// Calls work(i) once for every i below `count`, in any order, and returns when all are done. While the calling
  /// thread has nothing left to do and waits for the others, it calls `waiting` about every 20 ms. Neither may throw.
  void run(std::size_t count, const std::function<void(std::size_t)>& work, const std::function<void()>& waiting);

 private:
  struct Crew;
  void dismiss() noexcept;
  int workers_;
  std::unique_ptr<Crew> crew_;
};

}  // namespace withe
