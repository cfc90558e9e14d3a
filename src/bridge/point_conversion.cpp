#include "sovo/bridge/point_conversion.h"

#include <bit>
#include <cmath>
#include <cstring>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/ros_conversion.h"

namespace sovo::bridge {
namespace {

static_assert(std::endian::native == std::endian::little, "is_bigendian is written as false");

/// Point i in the keyframe's left camera [m].
Vec3 point_of(const KeyframeOutput& keyframe, std::size_t i, const CameraModel& tracked) {
  const Vec3 ray((keyframe.u[i] - tracked.cx) / tracked.fx,
                 (keyframe.v[i] - tracked.cy) / tracked.fy, 1.0);
  return ray / keyframe.inverse_depth[i] + tracked.ray_offset(ray);
}

}  // namespace

PointsInView points_in_view(const OdometryOutput& output, const KeyframeOutput& keyframe,
                            const CameraModel& tracked, const CameraModel& raw_left) {
  PointsInView result;
  if (!output.pose_valid || output.segment != keyframe.segment) return result;
  const SE3 T_now_keyframe = output.T_odom_left.inverse() * keyframe.T_odom_left;
  // A correction leaves the newest keyframe's camera where it is, and its points move away from it.
  const double growth = std::exp(output.log_scale - keyframe.log_scale);
  for (std::size_t i = 0; i < keyframe.u.size(); ++i) {
    if (!(keyframe.inverse_depth[i] > 0.0F)) continue;
    const Vec3 point = T_now_keyframe * (growth * point_of(keyframe, i, tracked));
    const auto pixel = raw_left.project(raw_left.direction_of(point));
    if (!pixel || !raw_left.contains(*pixel)) continue;
    result.u.push_back(static_cast<float>(pixel->x()));
    result.v.push_back(static_cast<float>(pixel->y()));
    result.inverse_depth.push_back(static_cast<float>(1.0 / point.z()));
  }
  return result;
}

PointCloudMessage::PointCloudMessage(const KeyframeOutput& keyframe, const CameraModel& tracked,
                                     const SE3& T_base_left, const OdometryFrames& frames) {
  constexpr std::size_t kFloats = 4;
  constexpr std::size_t kPointStep = kFloats * sizeof(float);
  const SE3 T_odom_left = T_base_left * keyframe.T_odom_left;
  data_.reserve(keyframe.u.size() * kPointStep);
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < keyframe.u.size(); ++i) {
    if (!(keyframe.inverse_depth[i] > 0.0F)) continue;
    const Vec3 p = T_odom_left * point_of(keyframe, i, tracked);
    const float point[kFloats] = {static_cast<float>(p.x()), static_cast<float>(p.y()),
                                  static_cast<float>(p.z()),
                                  static_cast<float>(keyframe.intensity[i])};
    data_.resize(data_.size() + kPointStep);
    std::memcpy(data_.data() + count * kPointStep, point, kPointStep);
    ++count;
  }
  std::uint32_t offset = 0;
  for (const char* name : {"x", "y", "z", "intensity"}) {
    fields_.push_back({borrow(name), offset, MessageTraits<msg::PointField>::FLOAT32, 1});
    offset += sizeof(float);
  }
  message_.header = {to_message(keyframe.stamp_ns), borrow(frames.odom)};
  message_.height = 1;
  message_.width = count;
  borrow(message_.fields, fields_);
  message_.point_step = kPointStep;
  message_.row_step = count * kPointStep;
  borrow(message_.data, data_);
  message_.is_dense = true;
}

}  // namespace sovo::bridge
