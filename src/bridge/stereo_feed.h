#pragma once

#include <chrono>
#include <cstdint>

#include "sovo/driver/frame_source.h"
#include "sovo/odometry/stereo_odometry.h"

namespace sovo::bridge {

/// What became of the frames that were published.
struct FeedCounters {
  std::uint64_t received = 0;        ///< Well-formed frames of the followed publisher.
  std::uint64_t lost_transport = 0;  ///< Missing in its sequence, or images without their partner.
  std::uint64_t dropped_queue = 0;   ///< Given up because `next` was not called in time.
  std::uint64_t rejected = 0;        ///< Malformed frames.
  std::uint64_t foreign = 0;         ///< Frames of a second publisher.
};

/// Stereo frames from the bus with their calibration, whichever messages carry them.
class StereoFeed : public FrameSource {
 public:
  /// Waits for the calibration; what is missing when it does not come.
  virtual Result<void> wait_for_calibration(std::chrono::milliseconds timeout) = 0;

  /// Precondition: wait_for_calibration has succeeded.
  virtual const StereoCameras& cameras() const = 0;
  const StereoRig& rig() const override { return cameras().rig; }

  virtual FeedCounters counters() const = 0;

  /// Time that the latency of the last frame of `next` counts from [ns, UTC]: its stamp, or for
  /// frames of a recording, whose stamps are history, when it was sent.
  virtual std::int64_t latency_origin_ns() const = 0;
};

}  // namespace sovo::bridge
