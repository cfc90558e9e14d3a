#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <random>
#include <vector>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/se3.h"
#include "sovo/image/image.h"
#include "support/sine_sum.h"

namespace sovo::test {

/// Uniform number in [0, 1) with the same bits under every standard library.
inline double uniform(std::mt19937& random) { return static_cast<double>(random()) / 4294967296.0; }

inline double uniform(std::mt19937& random, double low, double high) {
  return low + (high - low) * uniform(random);
}

/// Standard normal number (Box-Muller).
inline double normal(std::mt19937& random) {
  const double u = (static_cast<double>(random()) + 1.0) / 4294967297.0;
  return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * M_PI * uniform(random));
}

/// Smooth texture of a plane: a sum of sinusoids with log-uniform wavelengths, squashed by tanh
/// into (0, 255). All derivatives exist everywhere.
class ProceduralTexture {
 public:
  /// Wavelengths in [m]; `waves` sinusoids.
  ProceduralTexture(std::mt19937& random, double min_wavelength, double max_wavelength,
                    int waves = 40) {
    double energy = 0.0;
    for (int i = 0; i < waves; ++i) {
      const double wavelength =
          min_wavelength * std::pow(max_wavelength / min_wavelength, (i + 0.5) / waves);
      const double direction = uniform(random, 0.0, 2.0 * M_PI);
      const double frequency = 2.0 * M_PI / wavelength;
      const double amplitude = std::pow(wavelength, 0.3);
      energy += 0.5 * amplitude * amplitude;
      waves_.add(frequency * std::cos(direction), frequency * std::sin(direction),
                 uniform(random, 0.0, 2.0 * M_PI), amplitude);
    }
    waves_.scale(0.55 / std::sqrt(energy));
  }

  /// Grey level at plane coordinates [m].
  double operator()(double s, double t) const { return 127.5 + 110.0 * std::tanh(waves_(s, t)); }

 private:
  SineSum waves_;
};

/// A closed room of textured planes with two boxes in it, rendered exactly by ray casting. World
/// axes are those of a camera at the origin: x right, y down, z forward. Seen from the origin,
/// depths run from about 1.5 m (boxes) to 7.5 m (slanted back wall). Rays must start inside the
/// room, x in (-4, 4), y in (-1.8, 1.4), z in (-4, 5), and outside the boxes.
class SyntheticScene {
 public:
  explicit SyntheticScene(unsigned seed) {
    std::mt19937 random(seed);
    const auto wall = [&](const Vec3& point, const Vec3& normal, const Vec3& along, double fine) {
      const Vec3 n = normal.normalized();
      const Vec3 s = (along - n * n.dot(along)).normalized();
      walls_.push_back({point, n, s, n.cross(s), ProceduralTexture(random, fine, 2.5)});
    };
    wall({0, 0, 6}, {0.25, 0, -1}, {1, 0, 0}, 0.12);  // back wall, farther to the right
    wall({0, 1.4, 0}, {0, -1, 0}, {1, 0, 0}, 0.25);   // ground
    wall({0, -1.8, 0}, {0, 1, 0}, {1, 0, 0}, 0.25);   // ceiling
    wall({-4, 0, 0}, {1, 0, 0}, {0, 0, 1}, 0.2);      // left
    wall({4, 0, 0}, {-1, 0, 0}, {0, 0, 1}, 0.2);      // right
    wall({0, 0, -4}, {0, 0, 1}, {1, 0, 0}, 0.15);     // behind
    const auto box = [&](const Vec3& center, double yaw, const Vec3& half) {
      const SE3 T_box_world = SE3(SO3::exp(Vec3(0, yaw, 0)), center).inverse();
      boxes_.push_back({T_box_world.rotation_matrix(), T_box_world.translation(), half, {}});
      for (int i = 0; i < 6; ++i) boxes_.back().faces.emplace_back(random, 0.05, 0.8);
    };
    box({-0.75, 0.75, 2.3}, 0.5, {0.45, 0.65, 0.45});
    box({1.2, 0.5, 3.6}, -0.3, {0.5, 0.9, 0.4});
  }

  struct Hit {
    double distance = 0.0;  ///< Along the ray [lengths of its direction].
    double value = 0.0;     ///< Grey level.
  };

  /// First surface along a ray of the world.
  Hit cast(const Vec3& origin, const Vec3& direction) const {
    double best = std::numeric_limits<double>::max();
    const Wall* nearest = nullptr;
    for (const Wall& wall : walls_) {
      const double slope = wall.normal.dot(direction);
      if (slope >= 0.0) continue;
      const double distance = wall.normal.dot(wall.point - origin) / slope;
      if (distance > 0.0 && distance < best) {
        best = distance;
        nearest = &wall;
      }
    }
    std::optional<Hit> box_hit;
    for (const Box& box : boxes_) {
      const auto hit = cast_box(box, origin, direction);
      if (!hit || hit->distance >= best) continue;
      best = hit->distance;
      box_hit = hit;
    }
    if (box_hit) return *box_hit;
    if (nearest == nullptr) return {};
    const Vec3 at = origin + best * direction - nearest->point;
    return {best, nearest->texture(nearest->s.dot(at), nearest->t.dot(at))};
  }

  /// z of the surface that a pixel sees, in the camera frame [m]; through a port, too; 0 where the
  /// camera has no ray.
  double depth(const CameraModel& camera, const SE3& T_world_camera, const Vec2& pixel) const {
    const auto ray = camera.unproject(pixel);
    if (!ray) return 0.0;
    const Vec3 offset = camera.ray_offset(*ray);
    const Hit hit = cast(T_world_camera * offset, T_world_camera.rotation() * *ray);
    return offset.z() + hit.distance * ray->z();
  }

  /// What the camera sees, one ray a pixel centre, without noise; 0 where it has no ray. `depth`
  /// gets z in the camera frame [m].
  ImageF render(const CameraModel& camera, const SE3& T_world_camera,
                ImageF* depth = nullptr) const {
    ImageF image(camera.width, camera.height);
    const Mat3 R_world_camera = T_world_camera.rotation_matrix();
    if (depth != nullptr) depth->resize(camera.width, camera.height);
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const auto ray = camera.unproject(Vec2(x, y));
        const Vec3 offset = ray ? camera.ray_offset(*ray) : Vec3(Vec3::Zero());
        const Hit hit = ray ? cast(R_world_camera * offset + T_world_camera.translation(),
                                   R_world_camera * *ray)
                            : Hit{};
        image.at(x, y) = static_cast<float>(hit.value);
        if (depth != nullptr) {
          depth->at(x, y) = ray ? static_cast<float>(offset.z() + hit.distance * ray->z()) : 0.0F;
        }
      }
    }
    return image;
  }

 private:
  struct Wall {
    Vec3 point, normal, s, t;
    ProceduralTexture texture;
  };
  struct Box {
    Mat3 R_box_world;
    Vec3 world_in_box;
    Vec3 half;
    std::vector<ProceduralTexture> faces;
  };

  static std::optional<Hit> cast_box(const Box& box, const Vec3& origin, const Vec3& direction) {
    const Vec3 o = box.R_box_world * origin + box.world_in_box;
    const Vec3 d = box.R_box_world * direction;
    double enter = -std::numeric_limits<double>::max();
    double leave = std::numeric_limits<double>::max();
    int axis = 0;
    for (int i = 0; i < 3; ++i) {  // slabs
      const double inverse = 1.0 / d[i];
      const double near = (-std::copysign(box.half[i], inverse) - o[i]) * inverse;
      const double far = (std::copysign(box.half[i], inverse) - o[i]) * inverse;
      if (near > enter) {
        enter = near;
        axis = i;
      }
      leave = std::min(leave, far);
    }
    if (enter <= 0.0 || enter > leave) return std::nullopt;
    const Vec3 at = o + enter * d;
    const int face = 2 * axis + (d[axis] < 0.0 ? 1 : 0);
    return Hit{enter,
               box.faces[static_cast<std::size_t>(face)](at[(axis + 1) % 3], at[(axis + 2) % 3])};
  }

  std::vector<Wall> walls_;
  std::vector<Box> boxes_;
};

/// Brightness transfer of an image: gain * value + bias.
inline void apply_brightness(double gain, double bias, ImageF* image) {
  for (std::size_t i = 0; i < image->size(); ++i) {
    image->data()[i] = static_cast<float>(gain * static_cast<double>(image->data()[i]) + bias);
  }
}

/// Adds white noise of standard deviation `sigma` [grey levels].
inline void add_noise(double sigma, unsigned seed, ImageF* image) {
  std::mt19937 random(seed);
  for (std::size_t i = 0; i < image->size(); ++i) {
    image->data()[i] += static_cast<float>(sigma * normal(random));
  }
}

/// Rounds to whole grey levels in [0, 255], as an 8-bit camera does.
inline ImageU8 quantized(const ImageF& image) {
  ImageU8 out(image.width(), image.height());
  for (std::size_t i = 0; i < image.size(); ++i) {
    out.data()[i] =
        static_cast<std::uint8_t>(std::lround(std::min(255.0F, std::max(0.0F, image.data()[i]))));
  }
  return out;
}

}  // namespace sovo::test
