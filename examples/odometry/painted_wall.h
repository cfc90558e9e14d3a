#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "sovo/geometry/camera_model.h"
#include "sovo/image/stereo_frame.h"

/// A made-up world for the example: a wall two metres ahead, painted at random.
inline constexpr int kWidth = 320;
inline constexpr int kHeight = 240;
inline constexpr double kFocal = 200.0;  // [px]
inline constexpr double kDepth = 2.0;    // of the painted wall [m]

/// Smooth random paint of the wall at (x, y) [m], in grey levels.
inline double paint(double x, double y) {
  const auto corner = [](double i, double j) {
    const double h = 43758.5453 * std::sin(12.9898 * i + 78.233 * j);
    return 255.0 * (h - std::floor(h));
  };
  const double i = std::floor(x * 20.0), u = x * 20.0 - i;
  const double j = std::floor(y * 20.0), v = y * 20.0 - j;
  return (1 - v) * ((1 - u) * corner(i, j) + u * corner(i + 1, j)) +
         v * ((1 - u) * corner(i, j + 1) + u * corner(i + 1, j + 1));
}

/// What a camera at (x, 0, 0) [m] sees of the wall.
inline sovo::SideImage photograph(double x) {
  std::vector<std::uint8_t> pixels(kWidth * kHeight);
  for (int r = 0; r < kHeight; ++r) {
    for (int c = 0; c < kWidth; ++c) {
      pixels[r * kWidth + c] = static_cast<std::uint8_t>(
          paint(x + (c - 159.5) * kDepth / kFocal, (r - 119.5) * kDepth / kFocal));
    }
  }
  return {.valid = true,
          .width = kWidth,
          .height = kHeight,
          .step = kWidth,
          .data = std::make_shared<const std::vector<std::uint8_t>>(std::move(pixels))};
}

/// The camera that takes the photographs.
inline sovo::CameraModel wall_camera() {
  return {.width = kWidth, .height = kHeight, .fx = kFocal, .fy = kFocal, .cx = 159.5, .cy = 119.5};
}
