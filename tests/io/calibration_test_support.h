#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <string>

#include "io/io_test_support.h"
#include "sovo/geometry/stereo_rig.h"
#include "sovo/io/calibration.h"

namespace sovo {

/// Two different cameras, turned against each other.
inline StereoRig some_rig() {
  StereoRig rig;
  rig.name = "bench";
  rig.left = {
      640, 480, 402.5, 401.25, 322.0, 238.5, Distortion::kRadtan, {-0.28, 0.07, 1e-4, -2e-4}, 4};
  rig.right = {
      656, 492, 410.0, 411.0, 330.0, 244.0, Distortion::kEquidistant, {0.01, -0.02, 0.003, -0.001},
      4};
  Vec6 x;
  x << -0.12, 0.004, -0.003, 0.02, -0.03, 0.015;
  rig.T_right_left = SE3::exp(x);
  x << 0.3, -0.1, 0.2, 0.1, 0.2, -0.3;
  rig.T_base_left = SE3::exp(x) * body_from_optical();
  return rig;
}

/// The same in water, behind ports.
inline StereoRig rig_behind_ports() {
  StereoRig rig = some_rig();
  rig.left.port = {.distance = 0.02, .thickness = 0.008, .centre = -0.01};
  rig.right.port = {.distance = 0.03, .glass = 1.52, .centre = -0.012};
  return rig;
}

inline void expect_same_camera(const CameraModel& a, const CameraModel& b) {
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.fx, b.fx);
  EXPECT_EQ(a.fy, b.fy);
  EXPECT_EQ(a.cx, b.cx);
  EXPECT_EQ(a.cy, b.cy);
  EXPECT_EQ(a.distortion, b.distortion);
  EXPECT_EQ(a.d, b.d);
}

inline double distance(const SE3& a, const SE3& b) { return (a.inverse() * b).log().norm(); }

inline std::string load_error(const std::string& path, const CalibrationOptions& options = {}) {
  const auto loaded = load_calibration(path, options);
  return loaded ? "" : loaded.error();
}

/// `text` with the first `from` replaced by `to`.
inline std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

}  // namespace sovo
