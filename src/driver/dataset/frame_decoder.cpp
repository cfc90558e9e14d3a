#include "sovo/driver/dataset/frame_decoder.h"

#include <utility>

namespace sovo {

FrameDecoder::FrameDecoder(std::size_t count, std::function<SourceResult(std::size_t)> decode)
    : count_(count), decode_(std::move(decode)), thread_([this] { run(); }) {}

FrameDecoder::~FrameDecoder() {
  {
    const std::scoped_lock lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

SourceResult FrameDecoder::next(std::chrono::steady_clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  SourceResult result;
  if (given_ == count_) {
    result.state = SourceState::kEndOfStream;
    return result;
  }
  if (!changed_.wait_until(lock, deadline, [this] { return !ready_.empty(); })) return result;
  result = std::move(ready_.front());
  ready_.pop_front();
  ++given_;
  lock.unlock();
  changed_.notify_all();
  return result;
}

void FrameDecoder::run() {
  for (std::size_t n = 0; n < count_; ++n) {
    SourceResult result = decode_(n);
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return stop_ || ready_.size() < kAhead; });
    if (stop_) return;
    ready_.push_back(std::move(result));
    lock.unlock();
    changed_.notify_all();
  }
}

}  // namespace sovo
