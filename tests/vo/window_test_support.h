#pragma once

#include <cmath>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "sovo/vo/bundle_adjustment.h"
#include "sovo/vo/epipolar_search.h"
#include "sovo/vo/linearization.h"
#include "sovo/vo/photometric_problem.h"
#include "sovo/vo/point_sights.h"
#include "sovo/vo/window.h"
#include "support/cameras.h"
#include "support/pyramids.h"
#include "support/synthetic_scene.h"

namespace sovo::test {

/// Small enough to be rendered in milliseconds.
inline CameraModel small_camera() { return make_camera(208, 156, 170, 171, 103.2, 78.6); }

/// Grey levels as a function of the pixel, with all derivatives: long waves only, so that the
/// interpolation of the sampled image is exact to 1e-4.
struct WaveImage {
  double phase = 0.0;
  double operator()(double u, double v) const {
    return 125.0 + 45.0 * std::sin(0.016 * u + 0.007 * v + phase) +
           50.0 * std::cos(0.006 * u - 0.014 * v + 1.3 * phase) +
           25.0 * std::sin(0.011 * u + 0.012 * v - 2.0 * phase);
  }
  ImageF sampled(int width, int height) const {
    ImageF image(width, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) image.at(x, y) = static_cast<float>((*this)(x, y));
    }
    return image;
  }
};

/// A keyframe with its linearization point at the given pose and no points.
inline std::unique_ptr<Keyframe> make_keyframe(std::uint32_t id, ImagePyramidPtr pyramid,
                                               const SE3& T_world_camera,
                                               const Affine& affine = {}) {
  auto k = std::make_unique<Keyframe>();
  k->id = id;
  k->stamp_ns = 1'000'000'000LL * (id + 1);
  k->pyramid = std::move(pyramid);
  k->frozen_T_camera_world = T_world_camera.inverse();
  k->frozen_affine = affine;
  k->set_x(Vec8::Zero());
  k->outlier_threshold = 1e9;
  return k;
}

/// A point of `image` at a pixel, with its pattern.
inline Point make_point(const ImageF& image, int u, int v, double rho) {
  ImmaturePoint immature;
  const WindowConfig config;
  make_immature_point(image, static_cast<float>(u), static_cast<float>(v), 1, PointConfig(),
                      config.gradient_constant, &immature);
  Point p = point_of(immature);
  p.rho = rho;
  return p;
}

inline PointSights sights_in_newest(const Window& window) {
  PointSights sights;
  find_sights_in_newest(window, &sights);
  return sights;
}

/// A lens that is not quite sharp: binomial blur, so that bilinear interpolation loses nothing.
inline ImageF blurred(const ImageF& image) {
  const int w = image.width();
  const int h = image.height();
  ImageF rows(w, h);
  ImageF out(w, h);
  const auto mix = [](float a, float b, float c) { return 0.25F * a + 0.5F * b + 0.25F * c; };
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      rows.at(x, y) =
          mix(image.at(std::max(x - 1, 0), y), image.at(x, y), image.at(std::min(x + 1, w - 1), y));
    }
  }
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      out.at(x, y) =
          mix(rows.at(x, std::max(y - 1, 0)), rows.at(x, y), rows.at(x, std::min(y + 1, h - 1)));
    }
  }
  return out;
}

/// What the small camera sees of the scene.
inline ImagePyramidPtr scene_view(const SyntheticScene& scene, const CameraModel& camera,
                                  const SE3& T_world_camera) {
  return pyramid_of(blurred(blurred(scene.render(camera, T_world_camera))));
}

/// Poses of a camera that moves about half a metre and turns a little, none of them alike.
inline SE3 keyframe_pose(int i) {
  const double s = i;
  return {SO3::exp(Vec3(0.012 * std::sin(1.7 * s), -0.02 * s, 0.015 * std::cos(s) - 0.015)),
          Vec3(0.11 * s, 0.04 * std::sin(1.3 * s), 0.05 * s * (1.0 - 0.1 * s))};
}

/// Pixels of a keyframe with gradient whose depth is the same in their surroundings, so that no
/// pattern straddles an edge, and that stay in view of all `poses` well inside the image.
inline std::vector<Point> scene_points(const SyntheticScene& scene, const CameraModel& camera,
                                       const ImageF& image, const std::vector<SE3>& poses, int host,
                                       int stride) {
  std::vector<Point> points;
  const SE3& T_world_host = poses[static_cast<std::size_t>(host)];
  for (int v = 10 + host % stride; v < camera.height - 10; v += stride) {
    for (int u = 10 + (2 * host) % stride; u < camera.width - 10; u += stride) {
      const double gradient = std::hypot(image.at(u + 1, v) - image.at(u - 1, v),
                                         image.at(u, v + 1) - image.at(u, v - 1)) /
                              2.0;
      if (gradient < 3.0) continue;
      const Vec2 pixel(u, v);
      const double depth = scene.depth(camera, T_world_host, pixel);
      const Vec3 ray = *camera.unproject(pixel);
      const Vec3 p = T_world_host * (ray * (depth / ray.z()));
      bool good = true;
      for (const Vec2& d : {Vec2(-5, 0), Vec2(5, 0), Vec2(0, -5), Vec2(0, 5)}) {
        good = good && std::abs(scene.depth(camera, T_world_host, pixel + d) / depth - 1) < 0.1;
      }
      for (const SE3& pose : poses) {
        const Vec3 seen = pose.inverse() * p;
        const auto at = camera.project(seen);
        good = good && at && at->x() > 8 && at->y() > 8 && at->x() < camera.width - 9 &&
               at->y() < camera.height - 9;
        good = good && std::abs(scene.depth(camera, pose, *at) / seen.z() - 1) < 0.01;
      }
      if (good) points.push_back(make_point(image, u, v, 1.0 / depth));
    }
  }
  return points;
}

/// What a keyframe of the scene is made of.
struct SceneView {
  ImagePyramidPtr pyramid;
  std::vector<Point> points;
};

/// The views of `n` keyframes, made once a program.
inline const std::vector<SceneView>& scene_views(int n, int stride) {
  static std::map<std::pair<int, int>, std::vector<SceneView>> made;
  std::vector<SceneView>& views = made[{n, stride}];
  if (!views.empty()) return views;
  const SyntheticScene scene(3);
  const CameraModel camera = small_camera();
  std::vector<SE3> poses;
  for (int i = 0; i < n; ++i) poses.push_back(keyframe_pose(i));
  for (int i = 0; i < n; ++i) {
    views.push_back({scene_view(scene, camera, poses[static_cast<std::size_t>(i)]), {}});
    if (i + 1 == n) continue;
    views.back().points =
        scene_points(scene, camera, views.back().pyramid->level(0), poses, i, stride);
  }
  return views;
}

/// A window of one keyframe at the origin, which hosts points at the scene's true depths.
inline Window window_of_one(const SyntheticScene& scene, const Affine& affine = {}) {
  const CameraModel camera = small_camera();
  Window window(camera);
  Keyframe& k = window.insert(make_keyframe(1, scene_view(scene, camera, SE3()), SE3(), affine));
  k.points = scene_points(scene, camera, k.image(), {SE3()}, 0, 4);
  for (Point& p : k.points) p.hessian = 1e4;
  window.update_geometry();
  return window;
}

/// A window of `n` keyframes of the synthetic scene at their true poses; each but the newest hosts
/// points at their true depths, with residuals into all others. The states of the residuals are
/// those of the first linearization.
inline Window scene_window(int n, int stride = 7, std::uint32_t first_id = 0) {
  Window window(small_camera());
  const std::vector<SceneView>& views = scene_views(n, stride);
  for (int i = 0; i < n; ++i) {
    const SceneView& view = views[static_cast<std::size_t>(i)];
    Keyframe& k = window.insert(
        make_keyframe(first_id + static_cast<std::uint32_t>(i), view.pyramid, keyframe_pose(i)));
    k.points = view.points;
  }
  for (int h = 0; h < n; ++h) {
    for (Point& p : window[h].points) {
      for (int t = 0; t < n; ++t) {
        if (t == h) continue;
        p.residuals[static_cast<std::size_t>(window[t].slot)].state = ResidualState::kIn;
      }
    }
  }
  window.update_geometry();
  return window;
}

/// All residuals of a window at its present estimate.
inline WindowLinearization linearized(const WindowConfig& config, Window* window) {
  WorkerPool pool(1);
  PhotometricProblem problem(config, collect_points(window), window, &pool);
  WindowLinearization out;
  problem.linearize(problem.stored(), {}, &out);
  return out;
}

/// Displacements away from the linearization points, of the size that a window sees; the keyframe
/// with id 0 is the world and stays.
inline void displace(double size, unsigned seed, Window* window) {
  std::mt19937 random(seed);
  Vec8 unit;
  unit << Vec3::Constant(0.004), Vec3::Constant(0.001), 0.01, 0.5;
  for (int i = 0; i < window->size(); ++i) {
    Vec8 x;
    for (int k = 0; k < 8; ++k) x[k] = size * unit[k] * uniform(random, -1.0, 1.0);
    (*window)[i].set_x((*window)[i].id == 0 ? Vec8(Vec8::Zero()) : x);
  }
  window->update_geometry();
}

/// A positive definite prior over all states, of the size of what residuals say.
inline void set_random_prior(unsigned seed, Window* window) {
  std::mt19937 random(seed);
  const Eigen::Index n = 8 * window->size();
  MatX root(n, n);
  VecX b(n);
  Vec8 unit;
  unit << Vec3::Constant(300.0), Vec3::Constant(1000.0), 300.0, 3.0;
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) root(i, j) = unit[i % 8] * normal(random);
    b[i] = unit[i % 8] * normal(random);
  }
  window->prior() = {root * root.transpose(), b};
}

}  // namespace sovo::test
