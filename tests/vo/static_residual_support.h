#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <utility>
#include <vector>

#include "sovo/vo/static_residual.h"
#include "vo/window_test_support.h"

namespace sovo::test {

/// The small camera, and beside it another one with a lens, turned a little.
inline StereoRig bent_rig() {
  StereoRig rig;
  rig.left = small_camera();
  rig.right = make_camera(220, 160, 166, 167.5, 108.2, 79.3, Distortion::kRadtan,
                          {-0.21, 0.05, 0.0012, -0.0007});
  rig.T_right_left = SE3(SO3::exp(Vec3(0.012, -0.02, 0.015)), Vec3(-0.12, 0.004, 0.006));
  return rig;
}

inline constexpr int kStereoKeyframes = 4;
inline constexpr int kStride = 6;

/// What the right cameras of the keyframes see, made once a program.
inline const std::vector<ImageF>& right_views() {
  static const std::vector<ImageF> views = [] {
    const SyntheticScene scene(3);
    const StereoRig rig = bent_rig();
    std::vector<ImageF> out;
    for (int i = 0; i < kStereoKeyframes; ++i) {
      const SE3 pose = keyframe_pose(i) * rig.T_right_left.inverse();
      out.push_back(blurred(blurred(scene.render(rig.right, pose))));
    }
    return out;
  }();
  return views;
}

/// Changes the grey levels of a right image: keyframe, pixel, level as seen.
using Grey = std::function<float(int keyframe, int x, int y, float seen)>;
inline float as_seen(int /*keyframe*/, int /*x*/, int /*y*/, float seen) { return seen; }

/// `scene_window` with the right images of its keyframes.
inline Window stereo_window(const Grey& grey = as_seen, StaticScale scale = StaticScale::kHeld) {
  Window window = scene_window(kStereoKeyframes, kStride, 1);
  window.set_rig(bent_rig(), scale);
  for (int i = 0; i < window.size(); ++i) {
    ImageF image = right_views()[static_cast<std::size_t>(i)];
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) image.at(x, y) = grey(i, x, y, image.at(x, y));
    }
    window[i].right = pyramid_of(std::move(image));
    window[i].right_brightness = fit_right_brightness(*window.rig(), window[i], {});
    for (Point& p : window[i].points) p.static_state = ResidualState::kIn;
  }
  window.update_scale_held();
  return window;
}

/// Length of the window's way over the true one.
inline double scale_of(const Window& window) {
  const auto centre = [&](int i) { return window[i].T_world_camera().translation(); };
  const int newest = window.size() - 1;
  return (centre(newest) - centre(0)).norm() /
         (keyframe_pose(newest).translation() - keyframe_pose(0).translation()).norm();
}

/// As of a window that is adjusted three times; the newest keyframe stays the newest.
inline double adjusted_scale(Window* window, BundleResult* result = nullptr) {
  WorkerPool pool(1);
  const BundleAdjuster proto(WindowConfig(), &pool);
  for (int i = 0; i < 3; ++i) {
    BundleAdjuster adjuster = proto;
    const BundleResult one = adjuster.optimize(window);
    EXPECT_TRUE(one.finite);
    if (result != nullptr) *result = one;
  }
  return scale_of(*window);
}

}  // namespace sovo::test
