#pragma once

#include <memory>
#include <string>

#include "sovo/bridge/calibration_conversion.h"
#include "sovo/bridge/camera_views.h"
#include "sovo/bridge/participant.h"
#include "sovo/bridge/writer.h"
#include "sovo/image/stereo_frame.h"

namespace sovo::bridge {

/// What a camera process publishes: `stereo`, latched `calibration` and `/tf_static`, and the
/// images of both sides for those who want them (CameraViews).
///
///     auto publisher = CameraPublisher::open(participant, cameras, stamp_ns);
///     publisher->publish(frame);
///
/// The pace is the source's.
class CameraPublisher {
 public:
  /// Publishes calibration and static transforms, stamped `stamp_ns`. Frames are named after
  /// `cameras.rig.name` ("cam" when it has none).
  static Result<CameraPublisher> open(const Participant& participant, const StereoCameras& cameras,
                                      std::int64_t stamp_ns);

  /// Publishes calibration and static transforms again, which `open` has done once: in shared
  /// memory they can get lost while a reader is being found.
  Result<void> publish_static(const Participant& participant, const StereoCameras& cameras,
                              std::int64_t stamp_ns);

  /// Publishes a frame; its empty `frame_id` becomes the left optical frame of this publisher.
  /// Pixels are serialized from where they lie. `colour`: of the frame, where it was kept.
  Result<void> publish(const StereoFrame& frame, const StereoColour& colour = {});

  /// Whether frames should come with their colour: somebody reads it.
  bool wants_colour() const { return views_->wants_colour(); }

  /// Left optical frame, e.g. "cam_left_camera_optical_frame".
  const std::string& left_optical_frame() const { return left_frame_; }
  ViewCounters view_counters() const { return views_->counters(); }
  /// Odometry processes and others that listen now.
  std::uint32_t num_readers() const { return stereo_.num_readers(); }

 private:
  CameraPublisher(Writer<msg::StereoFrame> stereo, Writer<msg::StereoCalibration> calibration,
                  Writer<msg::TFMessage> tf_static, std::unique_ptr<CameraViews> views,
                  std::string left_frame)
      : stereo_(std::move(stereo)),
        calibration_(std::move(calibration)),
        tf_static_(std::move(tf_static)),
        views_(std::move(views)),
        left_frame_(std::move(left_frame)) {}

  Writer<msg::StereoFrame> stereo_;
  Writer<msg::StereoCalibration> calibration_;
  Writer<msg::TFMessage> tf_static_;
  std::unique_ptr<CameraViews> views_;
  std::string left_frame_;
};

}  // namespace sovo::bridge
