#pragma once

#include <array>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "sovo/driver/frame_source.h"
#include "sovo/driver/live/auto_exposure.h"
#include "sovo/driver/live/camera_worker.h"
#include "sovo/driver/live/stereo_pairer.h"

namespace sovo {

/// One device of a stereo camera.
struct LiveCamera {
  CameraWorkerConfig config;
  CameraWorker::Open open;
};

struct LiveSourceConfig {
  std::int64_t pair_tolerance_ns = 8'000'000;  ///< Of two devices.
  std::size_t max_waiting = 5;                 ///< See `StereoPairer`.
  std::optional<AutoExposureConfig> auto_exposure;
  ColourWanted colour_wanted;  ///< Of the devices; null when they have no colour.
};

/// Frames of real cameras: one device that gives both sides, or two. Each device is captured on a
/// thread of its own, which never waits for the caller: when he is slow the oldest frame is dropped
/// and counted. `session` is left for the caller to set; `sequence` is the left device's count.
class LiveSource : public FrameSource {
 public:
  /// `cameras`: one, or left and right.
  LiveSource(StereoRig rig, const LiveSourceConfig& config, std::vector<LiveCamera> cameras);
  ~LiveSource() override;
  LiveSource(const LiveSource&) = delete;
  LiveSource& operator=(const LiveSource&) = delete;

  const StereoRig& rig() const override { return rig_; }
  SourceResult next(std::chrono::milliseconds timeout) override;

  /// Asks the devices to keep colour, or not to; those without colour take no notice.
  void want_colour(bool wanted);

  /// Colour of the frame that `next` gave last, where it was kept. For the thread that calls
  /// `next`.
  const StereoColour& colour() const { return colour_; }

  LiveReport report() const;

 private:
  static constexpr std::size_t kQueue = 4;

  struct Queued {
    StereoFrame frame;
    StereoColour colour;
  };

  static Queued to_queued(StereoPair pair);
  void take_both(TimedImage image, RightImage right);
  void take_side(CameraSide side, TimedImage image);
  void push(StereoPair pair);
  void control_exposure(const StereoFrame& frame);

  const StereoRig rig_;
  const ColourWanted colour_wanted_;
  StereoColour colour_;                        ///< The caller's.
  std::optional<AutoExposure> auto_exposure_;  ///< Guarded by `mutex_`, as is what follows.

  mutable std::mutex mutex_;
  std::condition_variable arrived_;
  StereoPairer pairer_;
  std::array<Queued, kQueue> queue_;
  std::size_t head_ = 0;
  std::size_t count_ = 0;
  LiveReport report_;

  std::vector<std::unique_ptr<CameraWorker>> workers_;  ///< Last: they use the members above.
};

}  // namespace sovo
