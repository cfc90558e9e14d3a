#pragma once

#include <array>

#include "sovo/image/pyramid.h"

namespace sovo {

/// A square of pixels of a view, as it looks in another one, with what its alignment needs. The
/// values lie half a pixel beside its centre, to either side.
struct AlignmentPatch {
  static constexpr int kSide = 8;
  static constexpr int kSize = kSide * kSide;
  static constexpr float kReach = 0.5F * (kSide - 1);  ///< Of the values, from the centre [px].

  float norm = 0.F;                              ///< Of the values less their mean.
  float min_eigenvalue = 0.F;                    ///< Least mean squared gradient in any direction.
  std::array<float, 3> inverse_hessian{};        ///< Of the squared gradients: xx, xy, yy.
  std::array<float, kSize> value{}, gx{}, gy{};  ///< Less their means.
};

/// How a patch's surroundings are mapped into another view: d pixel' / d pixel, by rows.
using PatchWarp = std::array<float, 4>;
inline constexpr PatchWarp kNoWarp = {1.0F, 0.0F, 0.0F, 1.0F};

/// Takes the patch around (x, y) of an image as a view sees it into which `warp` maps. False where
/// it leaves the image, or has too little texture to be aligned.
bool make_patch(const ImageF& image, float x, float y, const PatchWarp& warp,
                AlignmentPatch* patch);

struct PatchAlignmentConfig {
  int levels = 4;           ///< Of the pyramid, of which the coarsest is looked at first.
  int max_iterations = 10;  ///< A level.
  float min_zncc = 0.8F;    ///< Least correlation of a patch that is found.
};

/// Where a patch was found.
struct PatchMatch {
  bool found = false;
  float u = 0.F, v = 0.F;  ///< In level 0 [px].
  float zncc = 0.F;        ///< Correlation with the first view.
  float contrast = 0.F;    ///< Of this view, relative to the first.
  int finest_level = 0;    ///< Of this view, in which it was compared.
};

/// A position of level 0 of a view.
struct PatchOrigin {
  const ImagePyramid* pyramid = nullptr;
  float u = 0.F, v = 0.F;
};

/// Looks for a patch of another view around (u, v) of level 0, coarse to fine: alignment of
/// position, gain and bias (Lucas, Kanade) with the gradients of the first view, which is warped
/// once a level (Baker, Matthews 2004). Where the warp enlarges, this view's coarser levels are
/// looked at, where it makes smaller, the first view's.
PatchMatch find_patch(const PatchOrigin& origin, const ImagePyramid& pyramid, const PatchWarp& warp,
                      float u, float v, const PatchAlignmentConfig& config);

}  // namespace sovo
