#pragma once

#include <random>
#include <utility>
#include <vector>

#include "sovo/geometry/camera_model.h"
#include "sovo/place/place.h"
#include "support/cameras.h"
#include "support/synthetic_scene.h"

namespace sovo::test {

inline CameraModel place_camera() { return make_camera(640, 480, 450, 455, 318, 241); }

inline BinaryDescriptor random_descriptor(std::mt19937& random) {
  BinaryDescriptor d;
  for (auto& word : d.bits) word = (static_cast<std::uint64_t>(random()) << 32U) | random();
  return d;
}

/// Some bits of a descriptor, changed as another view does.
inline BinaryDescriptor disturbed(BinaryDescriptor d, int bits, std::mt19937& random) {
  for (int i = 0; i < bits; ++i) {
    d.bits[random() % 4] ^= std::uint64_t{1} << (random() % 64);
  }
  return d;
}

/// Points of the world with descriptors, before a camera at its origin.
struct Cloud {
  std::vector<std::pair<Vec3, BinaryDescriptor>> points;

  Cloud(int number, std::mt19937& random) {
    for (int i = 0; i < number; ++i) {
      const double z = uniform(random, 2.0, 9.0);
      const Vec3 p(uniform(random, -0.7, 0.7) * z, uniform(random, -0.5, 0.5) * z, z);
      points.emplace_back(p, random_descriptor(random));
    }
  }

  /// What a camera of 11 cm baseline sees of it: keypoints err by `sigma_px` times a standard
  /// normal number, depths by what a quarter of a pixel of disparity does.
  Place seen_from(const SE3& T_world_camera, double sigma_px, std::mt19937& random) const {
    constexpr double kDisparitySigma = 0.25;
    const CameraModel camera = place_camera();
    Place place;
    place.T_odom_left = T_world_camera;
    for (const auto& [point, descriptor] : points) {
      const Vec3 p = T_world_camera.inverse() * point;
      const auto pixel = camera.project(p);
      if (!pixel || !camera.contains(*pixel)) continue;
      Landmark l;
      l.keypoint.u = static_cast<float>(pixel->x() + sigma_px * normal(random));
      l.keypoint.v = static_cast<float>(pixel->y() + sigma_px * normal(random));
      l.keypoint.descriptor = disturbed(descriptor, 20, random);
      l.sigma = static_cast<float>(kDisparitySigma / (camera.fx * 0.11));
      l.inverse_depth =
          static_cast<float>(1.0 / p.z() + static_cast<double>(l.sigma) * normal(random));
      place.landmarks.push_back(l);
    }
    return place;
  }
};

}  // namespace sovo::test
