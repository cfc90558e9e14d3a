#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace sovo {

/// A few threads that share loops. Which thread runs which index is left to chance, so a loop body
/// must write only to what belongs to its index; results are then reduced in order by the caller,
/// and the number of threads changes no bit. (Own code because ThreadSanitizer cannot see into the
/// distributed TBB library.)
class WorkerPool {
 public:
  /// `threads` run a loop, the caller's among them; 1 keeps everything on the caller's thread.
  explicit WorkerPool(int threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  int threads() const { return static_cast<int>(workers_.size()) + 1; }

  /// Runs job(0) ... job(n - 1) and returns when all are done. While one caller's loop runs,
  /// another caller runs its own alone. Allocates no memory, whatever the job holds.
  template <class Job>
  void run(int n, const Job& job) {
    run_function(n, std::cref(job));
  }

 private:
  void run_function(int n, const std::function<void(int)>& job);
  void work();
  void drain();

  std::atomic_flag occupied_;  ///< By a caller's loop.
  std::mutex mutex_;
  std::condition_variable start_;
  std::condition_variable done_;
  std::uint64_t generation_ = 0;
  int busy_ = 0;
  bool stop_ = false;
  int n_ = 0;
  const std::function<void(int)>* job_ = nullptr;
  std::atomic<int> next_{0};
  std::vector<std::thread> workers_;
};

}  // namespace sovo
