#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "sovo/driver/live/backoff.h"
#include "sovo/driver/live/camera_report.h"
#include "sovo/driver/live/capture_device.h"
#include "sovo/driver/live/device_clock.h"

namespace sovo {

struct CameraWorkerConfig {
  std::string name;                         ///< "camera", "left" or "right".
  std::chrono::milliseconds stall{2000};    ///< Silence after which the device is opened anew.
  std::chrono::milliseconds backoff{100};   ///< First wait between two attempts.
  std::chrono::milliseconds longest{1000};  ///< Longest wait between two attempts.
  double frame_rate = 30.0;     ///< Nominal; counts what was missed while the device was away.
  bool shared_clock = false;    ///< Device stamps of both cameras are of one clock.
  std::uint8_t clock_kind = 0;  ///< As `StereoFrame::clock`.
  DeviceClockConfig clock;
};

/// The right image of a device that gives both sides at once.
struct RightImage {
  SideImage image;  ///< Not valid when there is none.
  ColourImage colour;
};

/// Keeps one camera going on a thread of its own: opens it, hands over its images with UTC stamps,
/// opens it anew when it is lost or silent, and counts.
class CameraWorker {
 public:
  using Open = std::function<Result<std::unique_ptr<CaptureDevice>>()>;
  /// Called on the worker's thread; must not block. `right` is valid for a device of both sides.
  using Deliver = std::function<void(TimedImage image, RightImage right)>;
  /// Called on the worker's thread: stamps of this camera no longer compare with earlier ones.
  using ClockSet = std::function<void()>;

  CameraWorker(CameraWorkerConfig config, Open open, Deliver deliver, ClockSet clock_set);
  ~CameraWorker();
  CameraWorker(const CameraWorker&) = delete;
  CameraWorker& operator=(const CameraWorker&) = delete;

  CameraReport report() const;

  /// Asks for an exposure; it is set before the next image is waited for.
  void request(const Exposure& exposure);

 private:
  using Clock = std::chrono::steady_clock;

  void run();
  std::unique_ptr<CaptureDevice> open_device();
  void stream(CaptureDevice* device);
  void ask_device(CaptureDevice* device, Clock::time_point now);
  void apply_request(CaptureDevice* device);
  void handle_image(Capture* capture);
  void handle_bad(CaptureState state, const Capture& capture);
  void lose(std::uint64_t CameraCounts::*counter, const std::string& message);
  void found();
  bool stopping() const;
  void wait(std::chrono::milliseconds time);
  void measure_rate(Clock::time_point now);

  const CameraWorkerConfig config_;
  const Open open_;
  const Deliver deliver_;
  const ClockSet clock_set_;

  // The worker's own.
  DeviceClock clock_;
  bool ptp_ = false;  ///< Device stamps are of a clock that both cameras share.
  Backoff backoff_;
  std::uint64_t next_sequence_ = 0;
  std::optional<Clock::time_point> last_image_;
  bool first_since_open_ = true;
  Clock::time_point last_asked_{};
  Clock::time_point rate_since_{};
  std::uint64_t rate_images_ = 0;

  mutable std::mutex mutex_;  ///< Guards what follows.
  std::condition_variable wake_;
  bool stop_ = false;
  CameraReport report_;
  std::optional<Exposure> request_;

  std::thread thread_;  ///< Last: it uses the members above.
};

}  // namespace sovo
