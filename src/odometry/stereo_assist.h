#pragma once

#include "sovo/scale/scale_optimizer.h"

namespace sovo {

struct StereoAssistConfig {
  double few_points = 0.25;    ///< Active points, of those wanted, below which it is called.
  double enough_points = 0.4;  ///< And above which it may go.
  double min_inliers = 0.65;   ///< Share of pixels that agree, below which it is called.
  int disagreements = 2;       ///< Scales in a row that disagree, which call it.
  int good_keyframes = 3;      ///< In a row, after which it goes.
  bool hold_scale = true;      ///< Static residuals where no scale is measured.

  template <class Visitor>
  void visit(Visitor& v) {
    v("few_points", few_points, "active points, of those wanted, below which it is called");
    v("enough_points", enough_points, "and above which it may go");
    v("min_inliers", min_inliers, "share of pixels that agree, below which it is called");
    v("disagreements", disagreements, "scales in a row that disagree, which call it");
    v("good_keyframes", good_keyframes, "good keyframes in a row after which it goes");
    v("hold_scale", hold_scale,
      "mode scale, direct, unless depth_init is temporal: where scale optimization sees too few "
      "points or disagrees, new keyframes get static residuals");
  }
};

/// Tells when the monocular odometry fails and stereo matching must help it (the future work of the
/// paper): while too few points find their depth in later images, tracking fits badly or the scale
/// jumps, new pixels get their depths from the right image at once. And where points leave the view
/// so soon that too few are left for scale optimization, or what it finds is no scale that the map
/// can have come to, static residuals hold the scale: moving light bends the depths of a map, which
/// the right image, taken in the same light, does not share.
class StereoAssist {
 public:
  explicit StereoAssist(const StereoAssistConfig& config) : config_(config) {}

  /// Whether the next keyframe's pixels are to be matched.
  bool wanted() const { return wanted_; }

  /// Whether the next keyframe is to have static residuals.
  bool holds_scale() const { return holds_scale_; }

  /// A keyframe was mapped: active points, of those wanted, and the share of pixels that agreed.
  void on_keyframe(double points, double inliers) {
    const bool fails = points < config_.few_points || inliers < config_.min_inliers ||
                       disagreed_ >= config_.disagreements;
    const bool good = !fails && points > config_.enough_points;
    good_ = good ? good_ + 1 : 0;
    if (fails) wanted_ = true;
    if (good_ >= config_.good_keyframes) wanted_ = false;
  }

  /// What came of the search for a keyframe's scale.
  void on_scale(ScaleVerdict verdict) {
    disagreed_ = verdict == ScaleVerdict::kInnovation ? disagreed_ + 1 : 0;
    measured_ = verdict == ScaleVerdict::kAccepted ? measured_ + 1 : 0;
    const bool fails =
        verdict == ScaleVerdict::kTooFewPoints || verdict == ScaleVerdict::kInnovation;
    if (fails) holds_scale_ = config_.hold_scale;
    if (measured_ >= config_.good_keyframes) holds_scale_ = false;
  }

 private:
  StereoAssistConfig config_;
  bool wanted_ = false;
  int good_ = 0;
  int disagreed_ = 0;
  bool holds_scale_ = false;
  int measured_ = 0;  ///< Scales in a row that were accepted.
};

}  // namespace sovo
