#pragma once

#include <vector>

#include "sovo/image/static_matcher.h"
#include "sovo/place/place.h"

namespace sovo {

/// A stereo pair as an odometry prepared it.
struct StereoView {
  ImagePyramidPtr left;   ///< Undistorted.
  ImagePyramidPtr right;  ///< Raw, of the same instant or another one.
  /// `left`'s camera into where it was when `right` was exposed; a turn of the right camera against
  /// its calibration is in it.
  SE3 T_later_left;
  int halvings = 0;  ///< How often both are smaller than the whole image.
  ImageU8 mask;      ///< Of the size of `left`: 0 where nothing is looked for; may be empty.
};

/// Keypoints of the left image with what static matching knows of their depths, where the whole
/// image has them. `rig`: the undistorted left camera and the raw right one, of whole images.
std::vector<Landmark> find_landmarks(const StereoView& view, const StaticMatcherConfig& matcher,
                                     const StereoRig& rig, const KeypointConfig& keypoints);

/// Where two masks of equal size both allow pixels; an empty one allows all.
ImageU8 both_masks(const ImageU8& a, const ImageU8& b);

}  // namespace sovo
