#pragma once

#include <limits>
#include <optional>
#include <utility>

#include "sovo/geometry/stereo_rig.h"
#include "sovo/image/pyramid.h"

namespace sovo {

struct StaticMatcherConfig {
  double min_depth = 0.3;          ///< Nearest depth searched [m].
  double max_depth = 0.0;          ///< Farthest depth searched [m]; 0 is infinity.
  double min_zncc = 0.8;           ///< Least correlation of an accepted match.
  double min_uniqueness = 0.05;    ///< Least lead in ZNCC over the second-best mode.
  double max_back_error_px = 1.0;  ///< Left-right check, at level 0.
  int coarsest_level = 3;          ///< The search over the whole range is at most this coarse.
  double min_gradient = 2.0;       ///< Least rms gradient along the curve [grey levels / px].

  template <class Visitor>
  void visit(Visitor& v) {
    v("min_depth", min_depth, "nearest depth searched [m]");
    v("max_depth", max_depth, "farthest depth searched [m], 0: infinity");
    v("min_zncc", min_zncc, "least correlation of an accepted match");
    v("min_uniqueness", min_uniqueness, "least lead in correlation over the second-best match");
    v("max_back_error_px", max_back_error_px, "left-right check [px]");
    v("coarsest_level", coarsest_level, "coarsest pyramid level of the search over the range");
    v("min_gradient", min_gradient, "least rms gradient along the curve [grey levels / px]");
  }
};

/// How a search ended.
enum class MatchState {
  kMatched,
  kLowCorrelation,
  kAmbiguous,
  kBackCheck,  ///< The match in the other direction leads elsewhere.
  kOutOfView,  ///< The curve does not enter the right image.
  kNoTexture,
};

struct StaticMatch {
  MatchState state = MatchState::kOutOfView;
  /// 1 / z in the left camera frame [1/m]; sub-pixel refined, not negative unless the range
  /// searched was.
  float inverse_depth = 0.0F;
  float sigma = 0.0F;         ///< Its standard deviation [1/m].
  float disparity_px = 0.0F;  ///< From the image of the point at infinity; negative behind it.
  float zncc = 0.0F;
  float across_px = 0.0F;  ///< Residual displacement across the curve (decalibration).
  /// Standard deviation of `across_px`; infinite where the texture cannot tell, or nobody asked.
  float across_sigma_px = std::numeric_limits<float>::infinity();
};

struct MatchRequest {
  /// [min, max] where something is known; a negative range looks behind infinity, where matches
  /// mean swapped cameras [1/m].
  std::optional<std::pair<float, float>> inverse_depth_range = {};
  /// Part of `min_gradient` that is asked of the patch: less where the image has little texture.
  float gradient_share = 1.0F;
  bool across = false;  ///< Whether the displacement across the curve is wanted, at twice the cost.
};

/// Matches left pixels in the simultaneous right image along the epipolar curve, by correlation,
/// coarse to fine. The left camera is a pinhole, the right one raw with any distortion.
class StaticMatcher {
 public:
  StaticMatcher(const StaticMatcherConfig& config, const StereoRig& rig);

  /// The same for a right image of another instant (StereoRig::moved).
  StaticMatcher moved(const SE3& T_later_left) const { return {config_, rig_.moved(T_later_left)}; }

  /// Inverse depths that are searched where the request tells none: least, greatest [1/m].
  std::pair<float, float> whole_range() const;

  /// Matches one left pixel (level 0, sub-pixel). Thread-safe.
  StaticMatch match(const ImagePyramid& left, const ImagePyramid& right, float u, float v,
                    const MatchRequest& request = {}) const;

 private:
  StaticMatcherConfig config_;
  StereoRig rig_;
};

}  // namespace sovo
