#pragma once

#include <vector>

#include "sovo/geometry/types.h"

namespace sovo {

/// Inverse depth that is known at a pixel.
struct SurfaceSample {
  float u = 0.0F, v = 0.0F;  ///< [px]
  float rho = 0.0F;          ///< [1/m]
  float variance = 0.0F;     ///< Of rho, over its square.
};

/// How inverse depth changes over the image at a point: by this share of it a pixel.
struct SurfaceSlope {
  float u = 0.0F, v = 0.0F;  ///< [1/px]
};

/// What is known beside a place, as seen from it.
struct SlopeNeighbour {
  Vec3 place;           ///< (1, du, dv) [px].
  double value = 0.0;   ///< Its inverse depth over that of the place, less 1.
  double weight = 0.0;  ///< Inverse variance of that.
};

/// The slopes of surfaces in an image, from the depths that are known around a place. On a plane
/// inverse depth is linear in the pixel: so three numbers say all of a surface that is flat over
/// some twenty pixels, as ground and walls are.
class SurfaceSlopes {
 public:
  /// `width`, `height`: of the image [px]; `known`: places in it.
  SurfaceSlopes(int width, int height, std::vector<SurfaceSample> known);

  /// Slope of the surface that `at` lies on; none (0, 0) where too few depths are known around it,
  /// or not most of them lie on one plane with it.
  SurfaceSlope at(const SurfaceSample& at);

 private:
  void look_around(const SurfaceSample& at);

  int columns_;
  int rows_;
  std::vector<SurfaceSample> known_;  ///< By cell.
  std::vector<std::size_t> first_;    ///< Of each cell, and one past the last.
  std::vector<SlopeNeighbour> near_;  ///< Of the place looked at last.
};

}  // namespace sovo
