#pragma once

#include <chrono>
#include <cstdint>

#include "sovo/bridge/camera_publisher.h"
#include "sovo/bridge/dds_config.h"

namespace sovo::app {

/// Says a camera's calibration again where it can be lost: in shared memory, what is latched passes
/// a reader by that the daemon is just matching. On any other transport it is silent.
class CalibrationReminder {
 public:
  /// What `publisher` has said once, stamped `stamp_ns`. All must outlive it.
  CalibrationReminder(bridge::Transport transport, const bridge::Participant& participant,
                      bridge::CameraPublisher& publisher, const StereoCameras& cameras,
                      std::int64_t stamp_ns)
      : enabled_(transport == bridge::Transport::kShm),
        participant_(participant),
        publisher_(publisher),
        cameras_(cameras),
        stamp_ns_(stamp_ns) {}

  /// Twice a second at most.
  void remind();

  /// For as long as a new listener may miss it. Call now and then.
  void remind_new_listeners();

 private:
  using Clock = std::chrono::steady_clock;

  bool enabled_;
  const bridge::Participant& participant_;
  bridge::CameraPublisher& publisher_;
  const StereoCameras& cameras_;
  std::int64_t stamp_ns_;
  Clock::time_point said_ = Clock::now();
  Clock::time_point came_ = Clock::now();  ///< The last listener.
  std::uint32_t listeners_ = 0;
};

}  // namespace sovo::app
