#include "sovo/vo/worker_pool.h"

#include <algorithm>

namespace sovo {

WorkerPool::WorkerPool(int threads) {
  for (int i = 1; i < std::clamp(threads, 1, 64); ++i) workers_.emplace_back([this] { work(); });
}

WorkerPool::~WorkerPool() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  start_.notify_all();
  for (std::thread& w : workers_) w.join();
}

void WorkerPool::drain() {
  for (int i = next_.fetch_add(1); i < n_; i = next_.fetch_add(1)) (*job_)(i);
}

void WorkerPool::run_function(int n, const std::function<void(int)>& job) {
  if (workers_.empty() || n < 2 || occupied_.test_and_set(std::memory_order_acquire)) {
    for (int i = 0; i < n; ++i) job(i);
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    n_ = n;
    job_ = &job;
    next_ = 0;
    busy_ = static_cast<int>(workers_.size());
    ++generation_;
  }
  start_.notify_all();
  drain();
  {
    std::unique_lock lock(mutex_);
    done_.wait(lock, [this] { return busy_ == 0; });
  }
  occupied_.clear(std::memory_order_release);
}

void WorkerPool::work() {
  std::uint64_t seen = 0;
  std::unique_lock lock(mutex_);
  while (true) {
    start_.wait(lock, [&] { return stop_ || generation_ != seen; });
    if (stop_) return;
    seen = generation_;
    lock.unlock();
    drain();
    lock.lock();
    if (--busy_ == 0) done_.notify_one();
  }
}

}  // namespace sovo
