#include "sovo/vo/motion_blur.h"

#include <algorithm>
#include <cmath>

namespace sovo {

namespace {

constexpr float kSpacing = 2.0F;  ///< Of places along a line; pixels are interpolated [px].
constexpr int kMostPlaces = 12;

}  // namespace

Eigen::Vector2f streak(const CameraModel& camera, const Exposed& exposed, float x, float y,
                       float rho) {
  const Exposed& e = exposed;
  const float u = rho * (e[0] - x * e[2]) - x * y * e[3] + (1.0F + x * x) * e[4] - y * e[5];
  const float v = rho * (e[1] - y * e[2]) - (1.0F + y * y) * e[3] + x * y * e[4] + x * e[5];
  return {static_cast<float>(camera.fx) * u, static_cast<float>(camera.fy) * v};
}

double longest_streak(const CameraModel& camera, const Exposed& exposed, double rho) {
  double longest = 0.0;
  for (const int u : {0, camera.width}) {
    for (const int v : {0, camera.height}) {
      const auto x = static_cast<float>((u - camera.cx) / camera.fx);
      const auto y = static_cast<float>((v - camera.cy) / camera.fy);
      for (const double near : {0.0, rho}) {
        const Eigen::Vector2f moved = streak(camera, exposed, x, y, static_cast<float>(near));
        longest = std::max(longest, static_cast<double>(moved.norm()));
      }
    }
  }
  return longest;
}

BlurDifference blur_difference(const Eigen::Vector2f& in_host, const Eigen::Matrix2f& warp,
                               const Eigen::Vector2f& in_target) {
  const Eigen::Vector2f h(warp(0, 0) * in_host.x() + warp(0, 1) * in_host.y(),
                          warp(1, 0) * in_host.x() + warp(1, 1) * in_host.y());
  const Eigen::Vector2f& t = in_target;
  // t t^T - h h^T has the eigenvalues mean +- radius.
  const float xx = t.x() * t.x() - h.x() * h.x();
  const float xy = t.x() * t.y() - h.x() * h.y();
  const float yy = t.y() * t.y() - h.y() * h.y();
  const float mean = 0.5F * (xx + yy);
  const float half = 0.5F * (xx - yy);
  const float radius = std::sqrt(half * half + xy * xy);
  if (radius + std::abs(mean) < kVisibleStreak * kVisibleStreak) return {};
  // Of the eigenvector of the larger one, by half the angle whose cosine is half / radius.
  const float cosine = half / radius;
  const float c = std::sqrt(std::max(0.0F, 0.5F * (1.0F + cosine)));
  const float s = std::copysign(std::sqrt(std::max(0.0F, 0.5F * (1.0F - cosine))), xy);
  BlurDifference out;
  const float lacks = std::sqrt(std::max(0.0F, radius - mean));
  out.target = {-lacks * s, lacks * c};
  const float seen = std::sqrt(std::max(0.0F, radius + mean));
  const float det = warp(0, 0) * warp(1, 1) - warp(0, 1) * warp(1, 0);
  out.host = {seen * (warp(1, 1) * c - warp(0, 1) * s) / det,
              seen * (warp(0, 0) * s - warp(1, 0) * c) / det};
  return out;
}

Smear smear_along(const Eigen::Vector2f& line) {
  const float length = line.norm();
  // Written so that NaN counts as too short.
  if (!(length >= kVisibleStreak)) return {0.0F, 0.0F, 1};
  const float places = std::min(std::ceil(length / kSpacing), static_cast<float>(kMostPlaces));
  return {line.x(), line.y(), std::max(2, static_cast<int>(places))};
}

Eigen::Matrix2f pixel_warp(const PatternWarp& warp) {
  const float iz = 1.0F / warp.centre[2];
  const float u = warp.centre[0] * iz;
  const float v = warp.centre[1] * iz;
  Eigen::Matrix2f out;
  out << (warp.along_x[0] - u * warp.along_x[2]) * iz, (warp.along_y[0] - u * warp.along_y[2]) * iz,
      (warp.along_x[1] - v * warp.along_x[2]) * iz, (warp.along_y[1] - v * warp.along_y[2]) * iz;
  return out;
}

}  // namespace sovo
