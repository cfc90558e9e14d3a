#pragma once

#include <cstdint>

#include "message_traits.h"
#include "sovo/geometry/se3.h"

namespace sovo::bridge {

/// Time of a message; stamps before 1970 have negative seconds.
inline msg::Time to_message(std::int64_t stamp_ns) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::int64_t below = stamp_ns % kSecond < 0 ? 1 : 0;
  const std::int64_t seconds = stamp_ns / kSecond - below;
  return {static_cast<std::int32_t>(seconds),
          static_cast<std::uint32_t>(stamp_ns - seconds * kSecond)};
}

inline std::int64_t stamp_ns(const msg::Time& time) {
  return std::int64_t{time.sec} * 1'000'000'000 + time.nanosec;
}

inline msg::Quaternion to_message(const SO3& rotation) {
  const auto& q = rotation.quaternion();
  return {q.x(), q.y(), q.z(), q.w()};
}

inline msg::Pose to_pose(const SE3& T) {
  const Vec3& t = T.translation();
  return {{t.x(), t.y(), t.z()}, to_message(T.rotation())};
}

inline msg::Transform to_transform(const SE3& T) {
  const Vec3& t = T.translation();
  return {{t.x(), t.y(), t.z()}, to_message(T.rotation())};
}

/// Motion of a pose or transform whose quaternion is not zero (see is_rigid).
template <class Translation>
SE3 to_se3(const Translation& t, const msg::Quaternion& q) {
  return {SO3(Eigen::Quaterniond(q.w, q.x, q.y, q.z)), Vec3(t.x, t.y, t.z)};
}

/// Finite, with a quaternion of length 1 within 1 %.
template <class Translation>
bool is_rigid(const Translation& t, const msg::Quaternion& q) {
  const double norm = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return Vec3(t.x, t.y, t.z).allFinite() && std::abs(norm - 1.0) < 0.01;
}

/// 6x6 covariance, row-major (x, y, z, rotation about x, y, z; fixed axes), as REP-103.
inline void to_message(const Mat6& covariance, double (&out)[36]) {
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c < 6; ++c) out[6 * r + c] = covariance(r, c);
  }
}

}  // namespace sovo::bridge
