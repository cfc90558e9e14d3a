#pragma once

#include "sovo/place/keypoint.h"
#include "sovo/place/place_matcher.h"

namespace sovo {

struct RecognitionConfig {
  bool enable = true;  ///< Whether a lost camera looks for what its last keyframes saw.
  /// Share of a keyframe's landmarks in view that are seen again, at least, where the camera can be
  /// by its motion before; where it is likely, `matching.min_inliers` are enough.
  double min_support = 0.15;
  /// The same where nothing is known of that motion, and landmarks that agree.
  double lost_support = 0.25;
  int lost_inliers = 35;
  /// More than loops take: seen from elsewhere few are found again.
  KeypointConfig keypoints{.per_image = 1000};
  PlaceMatcherConfig matching{.min_inliers = 19, .min_shift_px = 2.0};

  template <class Visitor>
  void visit(Visitor& v) {
    v("enable", enable, "whether a lost camera looks for what its last keyframes saw");
    v("min_support", min_support,
      "share of a keyframe's landmarks in view that are seen again, at least, where the motion "
      "before does not make it likely");
    v("lost_support", lost_support, "the same where nothing is known of that motion");
    v("lost_inliers", lost_inliers, "landmarks that agree on one motion, at least, there");
    v("keypoints", keypoints, "what is looked for");
    v("matching", matching, "motion between two views");
  }
};

}  // namespace sovo
