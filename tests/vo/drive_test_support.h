#pragma once

#include <cmath>

#include "sovo/vo/monocular_backend.h"
#include "vo/window_test_support.h"

namespace sovo::test {

/// The scene as `small_camera` sees it from a pose, at 20 Hz.
inline MonoFrame frame_at(const SyntheticScene& scene, const SE3& T_world_camera, int index) {
  MonoFrame frame;
  frame.stamp_ns = 1'000'000'000LL + 50'000'000LL * index;
  frame.pyramid = scene_view(scene, small_camera(), T_world_camera);
  return frame;
}

/// Poses of a drive: forward and to the side, turning a little.
inline SE3 drive(int i) {
  const double s = 0.035 * i;
  return {SO3::exp(Vec3(0.01 * std::sin(3 * s), -0.03 * s, 0.0)),
          Vec3(1.1 * s, 0.05 * std::sin(4 * s), 0.5 * s)};
}

}  // namespace sovo::test
