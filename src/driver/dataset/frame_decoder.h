#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "sovo/driver/frame_source.h"

namespace sovo {

/// Decodes the frames 0 .. count-1 in order on a thread of its own, at most `kAhead` of them ahead
/// of the reader, so that decoding does not stall the odometry.
class FrameDecoder {
 public:
  static constexpr std::size_t kAhead = 4;

  /// `decode` gives frame n; it is called from the thread only.
  FrameDecoder(std::size_t count, std::function<SourceResult(std::size_t)> decode);
  ~FrameDecoder();
  FrameDecoder(const FrameDecoder&) = delete;
  FrameDecoder& operator=(const FrameDecoder&) = delete;

  /// The next frame, waiting until `deadline` at most: `kEndOfStream` after the last one,
  /// `kTimeout` when it is not yet decoded.
  SourceResult next(std::chrono::steady_clock::time_point deadline);

 private:
  void run();

  const std::size_t count_;
  const std::function<SourceResult(std::size_t)> decode_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<SourceResult> ready_;
  std::size_t given_ = 0;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace sovo
