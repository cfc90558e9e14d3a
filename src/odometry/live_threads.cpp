#include "sovo/odometry/live_threads.h"

#include <algorithm>
#include <utility>

namespace sovo {

LiveThreads::LiveThreads(std::size_t queue_limit, Callbacks callbacks)
    : queue_limit_(std::max<std::size_t>(1, queue_limit)), callbacks_(std::move(callbacks)) {
  mapping_thread_ = std::thread([this] { run_mapping(); });
  scale_thread_ = std::thread([this] { run_scale(); });
}

LiveThreads::~LiveThreads() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  mapping_thread_.join();
  scale_thread_.join();
}

bool LiveThreads::idle() const {
  return queue_.empty() && !mapping_busy_ && !scale_busy_ && scale_job_ == nullptr &&
         !scale_result_;
}

void LiveThreads::set_segment(MapSegment* segment) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return idle(); });
  segment_ = segment;
  map_failed_ = false;
}

void LiveThreads::drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return idle(); });
}

std::size_t LiveThreads::queue_depth() const {
  const std::lock_guard lock(mutex_);
  return queue_.size();
}

bool LiveThreads::map_failed() const {
  const std::lock_guard lock(mutex_);
  return map_failed_;
}

bool LiveThreads::push(MappingJob job, bool wait) {
  const bool keyframe = job.tracked.wants_keyframe;
  std::unique_lock lock(mutex_);
  if (wait) changed_.wait(lock, [this] { return queue_.size() < queue_limit_; });
  bool complete = true;
  if (queue_.size() >= queue_limit_) {
    const auto plain = std::find_if(queue_.begin(), queue_.end(),
                                    [](const MappingJob& j) { return !j.tracked.wants_keyframe; });
    queue_.erase(plain != queue_.end() ? plain : queue_.begin());
    complete = false;
  }
  queue_.push_back(std::move(job));
  lock.unlock();
  changed_.notify_all();
  // Frames that come faster than life must not run ahead of the keyframe they need.
  if (wait && keyframe) drain();
  return complete;
}

void LiveThreads::run_mapping() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stop_ || scale_result_ || !queue_.empty(); });
    if (stop_) return;
    mapping_busy_ = true;
    MapSegment* segment = segment_;
    if (scale_result_) {
      const ScaleResult result = std::move(*scale_result_);
      scale_result_.reset();
      lock.unlock();
      callbacks_.on_scale(segment->finish_scale(*result.job, result.estimate));
      lock.lock();
    } else {
      const MappingJob job = std::move(queue_.front());
      queue_.pop_front();
      const bool failed = map_failed_;
      lock.unlock();
      changed_.notify_all();
      MappingOutcome outcome;
      if (!failed) {
        outcome = segment->map(job.tracked, job.right ? &*job.right : nullptr);
        callbacks_.on_mapped(outcome);
      }
      lock.lock();
      map_failed_ = failed || outcome.map.failed;
      if (outcome.scale_job) {
        scale_job_ = std::make_unique<ScaleJob>(std::move(*outcome.scale_job));
      }
    }
    mapping_busy_ = false;
    changed_.notify_all();
  }
}

void LiveThreads::run_scale() {
  std::unique_lock lock(mutex_);
  while (true) {
    // A result that mapping has not taken yet must not be overwritten.
    changed_.wait(lock, [this] { return stop_ || (scale_job_ != nullptr && !scale_result_); });
    if (stop_) return;
    scale_busy_ = true;
    auto job = std::move(scale_job_);
    const MapSegment* segment = segment_;
    lock.unlock();
    const ScaleEstimate estimate = segment->estimate_scale(*job);
    lock.lock();
    scale_result_ = ScaleResult{std::move(job), estimate};
    scale_busy_ = false;
    changed_.notify_all();
  }
}

}  // namespace sovo
