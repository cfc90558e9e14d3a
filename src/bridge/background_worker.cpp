#include "sovo/bridge/background_worker.h"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <exception>

namespace sovo::bridge {
namespace {

/// On Linux a thread has a nice value of its own; where it cannot be set the work goes on as it is.
void lower_priority() {
  constexpr int kNicest = 19;
  (void)setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNicest);
}

}  // namespace

BackgroundWorker::BackgroundWorker(const std::string& name, std::chrono::milliseconds period,
                                   std::function<void()> work)
    : period_(period), work_(std::move(work)), thread_([this, name] { run(name); }) {}

BackgroundWorker::~BackgroundWorker() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void BackgroundWorker::wake() {
  {
    const std::lock_guard lock(mutex_);
    woken_ = true;
  }
  changed_.notify_all();
}

void BackgroundWorker::run(const std::string& name) {
  pthread_setname_np(pthread_self(), name.c_str());
  lower_priority();
  while (true) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, period_, [this] { return woken_ || stopping_; });
      if (stopping_) return;
      woken_ = false;
    }
    try {
      work_();
    } catch (const std::exception&) {
      ++failures_;
    }
  }
}

}  // namespace sovo::bridge
