#pragma once

#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "sovo/scale/scale_optimizer.h"
#include "support/pyramids.h"
#include "support/synthetic_scene.h"

namespace sovo::test {

/// Right cameras of the tests.
enum class Right { kRectified, kRadtan, kEquidistant };

inline CameraModel left_camera() {
  CameraModel camera;
  camera.width = 320;
  camera.height = 240;
  camera.fx = camera.fy = 260.0;
  camera.cx = 158.7;
  camera.cy = 121.3;
  return camera;
}

/// A rig with a baseline of 0.2 m; the unrectified ones have a turned right camera of another kind.
inline StereoRig make_rig(Right kind) {
  StereoRig rig;
  rig.left = left_camera();
  rig.right = left_camera();
  rig.T_right_left = SE3(SO3(), Vec3(-0.2, 0, 0));
  if (kind == Right::kRectified) return rig;
  rig.T_right_left = SE3(SO3::exp(Vec3(0.012, -0.02, 0.015)), Vec3(-0.2, 0.006, 0.01));
  rig.right.fx = 250.0;
  rig.right.fy = 252.0;
  rig.right.cx = 162.0;
  rig.right.cy = 118.0;
  if (kind == Right::kRadtan) {
    rig.right.distortion = Distortion::kRadtan;
    rig.right.d = {-0.28, 0.07, 2e-4, 2e-5, 0, 0, 0, 0};
  } else {
    rig.right.distortion = Distortion::kEquidistant;
    rig.right.d = {0.0034, 0.0007, -0.002, 0.0002, 0, 0, 0, 0};
    rig.right.fx = rig.right.fy = 230.0;
  }
  rig.right.num_coefficients = 4;
  return rig;
}

/// Both images of a scene.
struct StereoView {
  StereoRig rig;
  ImageF left, right;
};

/// Renders; `render` keeps what it has rendered for the life of the program.
inline StereoView render_view(const SyntheticScene& scene, const StereoRig& rig) {
  return {rig, scene.render(rig.left, SE3()), scene.render(rig.right, rig.T_right_left.inverse())};
}

inline const SyntheticScene& scene(unsigned seed) {
  static std::map<unsigned, SyntheticScene> scenes;
  return scenes.try_emplace(seed, seed).first->second;
}

inline const StereoView& view(Right kind, unsigned seed = 1) {
  static std::map<std::pair<Right, unsigned>, StereoView> views;
  const auto key = std::make_pair(kind, seed);
  const auto found = views.find(key);
  if (found != views.end()) return found->second;
  return views.emplace(key, render_view(scene(seed), make_rig(kind))).first->second;
}

/// How a keyframe's points depart from the truth.
struct PointErrors {
  double log_scale = 0.0;       ///< What the optimizer is to find.
  double relative_noise = 0.0;  ///< Of inverse depth.
  double outliers = 0.0;        ///< Share of points with a depth wrong by 0.6 to 1.7 times.
  int count = 1500;
  unsigned seed = 1;
};

/// Points at sub-pixel positions with gradient, as a keyframe of wrong scale holds them.
inline KeyframeSnapshot make_keyframe(const StereoView& view, const SyntheticScene& scene,
                                      const PointErrors& errors) {
  KeyframeSnapshot keyframe;
  keyframe.camera = view.rig.left;
  keyframe.pyramid = pyramid_of(view.left);
  std::mt19937 random(errors.seed);
  KeyframePoints& points = keyframe.points;
  while (static_cast<int>(points.size()) < errors.count) {
    const double u = uniform(random, 6.0, view.rig.left.width - 7.0);
    const double v = uniform(random, 6.0, view.rig.left.height - 7.0);
    const int x = static_cast<int>(u);
    const int y = static_cast<int>(v);
    const double gradient = std::hypot(view.left.at(x + 1, y) - view.left.at(x - 1, y),
                                       view.left.at(x, y + 1) - view.left.at(x, y - 1)) /
                            2.0;
    if (gradient < 4.0) continue;
    const double depth = scene.depth(view.rig.left, SE3(), Vec2(u, v));
    double factor = 1.0 + errors.relative_noise * normal(random);
    if (uniform(random) < errors.outliers) factor = std::exp(uniform(random, -0.5, 0.5));
    if (factor <= 0.05) continue;
    points.u.push_back(static_cast<float>(u));
    points.v.push_back(static_cast<float>(v));
    const double inverse_depth = factor * std::exp(errors.log_scale) / depth;
    points.inverse_depth.push_back(static_cast<float>(inverse_depth));
    points.sigma.push_back(
        static_cast<float>(std::max(0.01, errors.relative_noise) * inverse_depth));
  }
  return keyframe;
}

}  // namespace sovo::test
