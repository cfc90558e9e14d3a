#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sovo/geometry/camera_model.h"
#include "sovo/image/image.h"

namespace sovo::sim {

/// A bundle of rays: all within `angle` of `axis`.
struct RayCone {
  float axis[3] = {0.0F, 0.0F, 1.0F};
  float cos_angle = -1.0F;
  float sin_angle = 0.0F;
  bool empty = true;  ///< The camera sees nothing here.
};

/// The rays of all pixels of a camera, in its frame, grouped in square tiles. Pixels of a tile are
/// stored one after the other; those beyond the image, and those that see nothing, have ray zero.
class RayTable {
 public:
  static constexpr int kTile = 16;  ///< Side of a tile [px].
  static constexpr int kTilePixels = kTile * kTile;
  static constexpr int kBlock = 4;  ///< Side of a block of tiles.

  explicit RayTable(const CameraModel& camera);

  const CameraModel& camera() const { return camera_; }
  int tiles_x() const { return tiles_x_; }
  int tiles_y() const { return tiles_y_; }
  int num_tiles() const { return tiles_x_ * tiles_y_; }

  /// Components of the unit rays of a tile, `kTilePixels` each.
  const float* dx(int tile) const { return dx_.data() + offset(tile); }
  const float* dy(int tile) const { return dy_.data() + offset(tile); }
  const float* dz(int tile) const { return dz_.data() + offset(tile); }
  /// Angle between the rays of neighbouring pixels [rad].
  const float* pixel_angle(int tile) const { return angle_.data() + offset(tile); }

  const RayCone& cone(int tile) const { return cones_[static_cast<std::size_t>(tile)]; }
  /// Cone of the block of tiles that begins at tile (kBlock * bx, kBlock * by).
  const RayCone& block_cone(int bx, int by) const {
    return blocks_[static_cast<std::size_t>(by * blocks_x() + bx)];
  }
  int blocks_x() const { return (tiles_x_ + kBlock - 1) / kBlock; }
  int blocks_y() const { return (tiles_y_ + kBlock - 1) / kBlock; }

  /// Whether rays depend on how far away things are, for the camera is behind a port.
  bool bends() const { return camera_.port.has_value(); }
  /// Lets the rays of a row of tiles meet what lies `range` from the camera's origin, which is
  /// given in the order of the arrays from tile 0 on [m]; null: infinitely far. Precondition:
  /// `bends`.
  void bend(int tile_row, const float* range);

  /// Place of pixel (x, y) in the arrays that begin at tile 0.
  std::size_t index(int x, int y) const {
    const int tile = (y / kTile) * tiles_x_ + x / kTile;
    return offset(tile) + static_cast<std::size_t>((y % kTile) * kTile + x % kTile);
  }
  Eigen::Vector3f ray(int x, int y) const {
    const std::size_t i = index(x, y);
    return {dx_[i], dy_[i], dz_[i]};
  }
  /// How a change of the ray moves the pixel, for the pixels of a tile: elements k of d x / d ray,
  /// and from k = 3 on of d y / d ray; zero where the camera sees nothing.
  const float* pixel_step(int tile, std::size_t k) const { return steps_[k].data() + offset(tile); }
  /// Change of the ray from pixel to pixel along x and y; the image's edge repeats its neighbours.
  Eigen::Vector3f ray_step_x(int x, int y) const;
  Eigen::Vector3f ray_step_y(int x, int y) const;

 private:
  void store_ray(std::size_t i, const Eigen::Vector3f& ray);
  static std::size_t offset(int tile) { return static_cast<std::size_t>(tile) * kTilePixels; }
  void store_pixel_step(int x, int y);
  RayCone cone_of(int x0, int y0, int side) const;

  CameraModel camera_;
  int tiles_x_;
  int tiles_y_;
  AlignedVector<float> dx_, dy_, dz_, angle_;
  /// Behind a port: directions of rays, and how far from the origin they pass the port's normal.
  std::vector<Eigen::Vector3f> direction_;
  std::vector<float> offset_;
  std::array<AlignedVector<float>, 6> steps_;
  std::vector<RayCone> cones_;
  std::vector<RayCone> blocks_;
};

}  // namespace sovo::sim
