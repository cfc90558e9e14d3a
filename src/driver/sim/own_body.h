#pragma once

#include <optional>
#include <vector>

#include "sovo/driver/sim/lamps.h"
#include "sovo/driver/sim/ray_table.h"
#include "sovo/driver/sim/sim_config.h"
#include "sovo/geometry/stereo_rig.h"

namespace sovo::sim {

/// What a camera sees of the vehicle that carries it: the same in every image but for the light
/// that falls on it. It is made of bars, each what is within a radius of a line, whose surfaces
/// have a pattern of their own.
class OwnBody {
 public:
  /// Nothing is seen.
  OwnBody() = default;
  /// As the camera of `rays`, which is `side` of `rig`, sees the body by the vehicle's `lamps`.
  OwnBody(Body body, const StereoRig& rig, Side side, const RayTable& rays, const Lamps& lamps);

  /// The world's light that falls on it.
  struct Daylight {
    Eigen::Vector3f to_sun = Eigen::Vector3f::UnitZ();  ///< In the camera's frame.
    float ambient = 1.0F;
    float sun = 0.0F;
    float factor = 1.0F;  ///< On the light of the lamps too.
  };
  /// Lays it over a picture of the world.
  void draw(const Daylight& daylight, ImageF* picture) const;

  /// Puts its distances into an image of those along the rays [m]: where it covers at least half of
  /// a pixel.
  void cover(ImageF* range) const;

  /// Its distance along the ray of the pixel next to a place of the image [m], where it covers at
  /// least half of that.
  std::optional<float> range_at(const Vec2& pixel) const;

  /// Share of the camera's pixels that it covers.
  double share() const;

 private:
  /// What a pixel shows of it.
  struct Pixel {
    int x = 0;
    int y = 0;
    float covered = 0.0F;  ///< 0 to 1.
    float range = 0.0F;    ///< Mean along the ray [m].
    float reflected = 0.0F;
    Eigen::Vector3f ray, normal;
  };

  Lamps lamps_;
  std::vector<Pixel> pixels_;  ///< Row by row.
  double num_pixels_ = 1.0;    ///< Of the camera.
};

}  // namespace sovo::sim
