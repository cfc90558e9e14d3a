#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>

#include "sovo/bridge/background_worker.h"
#include "sovo/bridge/camera_health.h"
#include "sovo/bridge/participant.h"
#include "sovo/bridge/writer.h"
#include "sovo/driver/live/colour.h"
#include "sovo/image/stereo_frame.h"
#include "sovo/odometry/stereo_odometry.h"

namespace sovo::bridge {

/// What became of the views of a camera.
struct ViewCounters {
  std::uint64_t made = 0;     ///< Images compressed, rectified or copied out, of both sides.
  std::uint64_t skipped = 0;  ///< Frames left out because the worker was late.
  std::uint64_t failed = 0;   ///< Images that could not be compressed or written.
};

/// The images of a camera process in ROS's own types, for both sides: `image_raw`, `image_rect`,
/// `image_color` (of cameras that have colour), `image_raw/compressed`, `camera_info`,
/// `preview/compressed` (640 px wide, 5 Hz) and `preview_small/compressed` (320 px, 2 Hz). Each is
/// made only while somebody reads it, on a background thread; when that is late frames are skipped
/// here, and nothing waits. The same thread writes `/diagnostics` (1 Hz).
///
/// All messages of a frame have its stamp, those of the right side too, so that they can be paired
/// by equal stamps.
class CameraViews {
 public:
  /// `left_frame`, `right_frame`: names of the optical frames.
  static Result<std::unique_ptr<CameraViews>> open(const Participant& participant,
                                                   const StereoCameras& cameras,
                                                   const std::string& left_frame,
                                                   const std::string& right_frame);
  ~CameraViews();

  /// Takes a frame, and its colour where that was kept; shares their pixels and returns at once.
  void offer(const StereoFrame& frame, const StereoColour& colour = {});

  /// Whether somebody reads colour, as it was at the last frame or half a second ago.
  bool wants_colour() const { return wants_colour_; }

  ViewCounters counters() const;

 private:
  struct Side;

  CameraViews(Writer<msg::DiagnosticArray> diagnostics, CameraHealth health);
  struct Offered {
    StereoFrame frame;
    StereoColour colour;
  };

  void work();
  void show(const Offered& offered);
  void show_diagnostics();

  std::unique_ptr<Side> left_;
  std::unique_ptr<Side> right_;
  Pace preview_pace_;
  Pace small_pace_;
  Pace diagnostics_pace_;
  Writer<msg::DiagnosticArray> diagnostics_;
  CameraHealth health_;
  ColourReader colour_reader_;  // the worker's, of both sides
  std::atomic<bool> wants_colour_{false};

  mutable std::mutex mutex_;  // of the two below
  std::deque<Offered> queue_;
  std::uint64_t skipped_ = 0;

  std::unique_ptr<BackgroundWorker> worker_;  // the last: stops before what it uses is gone
};

}  // namespace sovo::bridge
