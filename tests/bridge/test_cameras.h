#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "sovo/image/stereo_frame.h"
#include "sovo/odometry/stereo_odometry.h"

namespace sovo::bridge {

/// A stereo pair with different cameras, one of them photometrically calibrated.
inline StereoCameras test_cameras() {
  StereoCameras cameras;
  cameras.rig.name = "cam";
  cameras.rig.left = {
      752, 480, 458.6, 457.3, 367.2, 248.4, Distortion::kRadtan, {-0.28, 0.07, 1e-4, 2e-5}, 4};
  cameras.rig.right = {
      640, 400, 300.0, 301.0, 320.5, 200.5, Distortion::kEquidistant, {0.01, -0.002, 0.003, 0.0},
      4};
  cameras.rig.T_right_left =
      SE3::exp((Vec6() << -0.11, 0.001, 0.002, 0.01, -0.02, 0.003).finished());
  cameras.rig.T_base_left = SE3(body_from_optical().rotation(), Vec3(0.3, 0.05, 0.1));
  for (int i = 0; i < 256; ++i) {
    cameras.left_photometric.inverse_response.push_back(static_cast<float>(i * i) / 255.0F);
  }
  cameras.left_photometric.vignette = ImageF(752, 480);
  for (int y = 0; y < 480; ++y) {
    for (int x = 0; x < 752; ++x) {
      cameras.left_photometric.vignette.at(x, y) = 1.0F - 0.0005F * static_cast<float>(x + y);
    }
  }
  return cameras;
}

inline SideImage test_side(int width, int height, int seed) {
  auto data = std::make_shared<std::vector<std::uint8_t>>(static_cast<std::size_t>(width) * height);
  for (std::size_t i = 0; i < data->size(); ++i) {
    (*data)[i] = static_cast<std::uint8_t>(i * 7 + static_cast<std::size_t>(seed));
  }
  SideImage side;
  side.valid = true;
  side.width = width;
  side.height = height;
  side.step = width;
  side.data = data;
  side.exposure_s = 0.005F;
  side.gain_db = 3.0F;
  side.stamp_offset_ns = 1000 * seed;
  side.dropped = static_cast<std::uint64_t>(seed);
  return side;
}

inline StereoFrame test_frame(std::uint64_t sequence, std::uint64_t session = 7) {
  StereoFrame frame;
  frame.stamp_ns = 1'700'000'000'123'456'789 + static_cast<std::int64_t>(sequence) * 50'000'000;
  frame.session = session;
  frame.sequence = sequence;
  frame.clock = 1;
  frame.stamp_sigma_s = 1e-5;
  frame.pair_error_s = 2e-4;
  frame.left = test_side(752, 480, 1);
  frame.right = test_side(640, 400, 2);
  return frame;
}

}  // namespace sovo::bridge
