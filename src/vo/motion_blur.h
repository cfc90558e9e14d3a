#pragma once

#include <Eigen/Core>
#include <array>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/types.h"
#include "sovo/image/image.h"
#include "sovo/vo/pattern.h"
#include "sovo/vo/pattern_kernels.h"

namespace sovo {

/// Streaks below this look like the bilinear interpolation that every pattern goes through [px].
inline constexpr float kVisibleStreak = 1.0F;

/// Motion of a camera during an exposure, log(T_later_earlier): translation, rotation.
using Exposed = Eigen::Matrix<float, 6, 1>;

/// How far what is seen at (x, y) of the normalized image, `rho` [1/m] near, moves in the image of
/// a camera that moves so [px].
Eigen::Vector2f streak(const CameraModel& camera, const Exposed& exposed, float x, float y,
                       float rho);

/// The longest streak in an image of what is at most `rho` [1/m] near [px].
double longest_streak(const CameraModel& camera, const Exposed& exposed, double rho);

/// How much two images of a pattern differ in their blur: the lines along which its host and its
/// target have to be smeared until both are blurred alike, each in its own image [px]. Zero: not at
/// all.
struct BlurDifference {
  Eigen::Vector2f host = Eigen::Vector2f::Zero();
  Eigen::Vector2f target = Eigen::Vector2f::Zero();
};

/// From what the exposures did: blur along a line d is the convolution with a kernel of covariance
/// d d^T / 12. The difference of both covariances, in the target's pixels, has one eigenvalue of
/// each sign at most; each side is given the one that it lacks. Zero where nothing would be seen.
///
/// `in_host`, `in_target`: the pattern's streaks [px]; `warp`: d (target pixel) / d (host pixel).
BlurDifference blur_difference(const Eigen::Vector2f& in_host, const Eigen::Matrix2f& warp,
                               const Eigen::Vector2f& in_target);

/// `line` with as many places as it takes: one where it is too short to be seen.
Smear smear_along(const Eigen::Vector2f& line);

/// How a pattern is smeared in its host and in its target. Kept with a residual while that is
/// sampled again and again: it hardly changes meanwhile.
struct PatternBlur {
  alignas(32) std::array<float, kPatternSize> colours{};  ///< Of the host, smeared.
  Smear in_target{0.0F, 0.0F, 1};
  bool known = false;
  bool in_host = false;  ///< Whether `colours` are to be taken.
};

/// How the pixels of a pattern move: d (target pixel) / d (host pixel) at its centre.
Eigen::Matrix2f pixel_warp(const PatternWarp& warp);

}  // namespace sovo
