#pragma once

#include <initializer_list>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/stereo_rig.h"

namespace sovo::test {

inline CameraModel make_camera(int width, int height, double fx, double fy, double cx, double cy,
                               Distortion distortion = Distortion::kNone,
                               std::initializer_list<double> coefficients = {}) {
  CameraModel camera;
  camera.width = width;
  camera.height = height;
  camera.fx = fx;
  camera.fy = fy;
  camera.cx = cx;
  camera.cy = cy;
  camera.distortion = distortion;
  for (const double k : coefficients) {
    camera.d[static_cast<std::size_t>(camera.num_coefficients++)] = k;
  }
  return camera;
}

/// The left camera of EuRoC MAV: radial-tangential, 752x480.
inline CameraModel euroc_left() {
  return make_camera(752, 480, 458.654, 457.296, 367.215, 248.375, Distortion::kRadtan,
                     {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05});
}

/// The left camera of TUM-VI at half resolution: fisheye of about 190 degrees, 512x512.
inline CameraModel tumvi_left() {
  return make_camera(
      512, 512, 190.40521435680378, 190.40597089713538, 254.89732652420363, 256.9152315269253,
      Distortion::kEquidistant,
      {0.010171079892421483, -0.010816440029919381, 0.005942781769412756, -0.001662284667857643});
}

/// The right camera of TUM-VI.
inline CameraModel tumvi_right() {
  return make_camera(
      512, 512, 189.6434942131518, 189.63291871107262, 252.53333516187035, 254.89204808827034,
      Distortion::kEquidistant,
      {0.01371679169245271, -0.015567360615942622, 0.00905043103315326, -0.002347858896562788});
}

}  // namespace sovo::test
