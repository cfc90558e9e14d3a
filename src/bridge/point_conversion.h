#pragma once

#include <cstdint>
#include <vector>

#include "message_traits.h"
#include "sovo/bridge/odometry_conversion.h"
#include "sovo/geometry/camera_model.h"

namespace sovo::bridge {

/// Points in view of a frame, as TrackedPoints has them.
struct PointsInView {
  std::vector<float> u, v;           ///< In the raw left image [px].
  std::vector<float> inverse_depth;  ///< 1 / z in the left camera of the frame [1/m].
};

/// The points of `keyframe` as the left camera sees them in the frame of `output`: moved by the
/// pose, grown by the scale corrections since the keyframe, and projected with the distortion of
/// `raw_left`. `tracked`: the undistorted camera of the keyframe's points. Empty when the frame has
/// no pose or belongs to another segment.
PointsInView points_in_view(const OdometryOutput& output, const KeyframeOutput& keyframe,
                            const CameraModel& tracked, const CameraModel& raw_left);

/// Points of a keyframe in the axes of odom as a PointCloud2 (x, y, z [m] and intensity, all
/// float32), with the memory that it borrows (borrow.h); `frames` must outlive it.
class PointCloudMessage {
 public:
  PointCloudMessage(const KeyframeOutput& keyframe, const CameraModel& tracked,
                    const SE3& T_base_left, const OdometryFrames& frames);
  PointCloudMessage(const PointCloudMessage&) = delete;
  PointCloudMessage& operator=(const PointCloudMessage&) = delete;

  const msg::PointCloud2& message() const { return message_; }

 private:
  std::vector<msg::PointField> fields_;
  std::vector<std::uint8_t> data_;
  msg::PointCloud2 message_{};
};

}  // namespace sovo::bridge
