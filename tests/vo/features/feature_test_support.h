#pragma once

#include <random>

#include "sovo/vo/features/feature_window.h"
#include "sovo/vo/features/reprojection.h"
#include "support/cameras.h"
#include "support/synthetic_scene.h"

namespace sovo::test {

inline CameraModel feature_camera() { return make_camera(640, 480, 400, 402, 318.2, 241.7); }

/// T_camera_world of a camera that goes aside and on, turning a little.
inline SE3 feature_pose(int i) {
  const double s = 0.1 * i;
  return SE3(SO3::exp(Vec3(0.02 * std::sin(s), 0.05 * s, 0.01)), Vec3(-s, 0.1 * s, -0.6 * s));
}

/// A window of `keyframes` at their true poses whose landmarks, at 2 to 10 m, are seen in all that
/// have them in view, with normal errors of `noise` px.
inline FeatureWindow true_window(int keyframes, int landmarks, double noise, std::uint32_t seed) {
  std::mt19937 random(seed);
  FeatureWindow window;
  window.camera = feature_camera();
  for (int i = 0; i < keyframes; ++i) {
    window.keyframes.push_back(
        {static_cast<std::uint32_t>(i), 50'000'000LL * i, nullptr, feature_pose(i), {}});
  }
  for (int n = 0; n < landmarks; ++n) {
    FeatureLandmark l;
    l.id = static_cast<std::uint64_t>(n);
    l.host_id = static_cast<std::uint32_t>(n % std::max(1, keyframes - 1));
    l.u = static_cast<float>(uniform(random, 20.0, 620.0));
    l.v = static_cast<float>(uniform(random, 20.0, 460.0));
    l.ray = ray_of(window.camera, l.u, l.v);
    l.rho = 1.0 / uniform(random, 2.0, 10.0);
    l.has_depth = true;
    for (int k = 0; k < keyframes; ++k) {
      const auto id = static_cast<std::uint32_t>(k);
      Vec2 pixel;
      if (id == l.host_id ||
          !reproject(window.camera, window.T_target_host(id, l.host_id), l.ray, l.rho, &pixel) ||
          !window.camera.contains(pixel)) {
        continue;
      }
      const Vec2 error(normal(random), normal(random));
      l.observations.push_back({id, pixel + noise * error, std::max(noise, 0.1), true});
    }
    if (!l.observations.empty()) window.landmarks.push_back(std::move(l));
  }
  return window;
}

}  // namespace sovo::test
