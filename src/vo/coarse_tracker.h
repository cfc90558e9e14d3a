#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sovo/vo/direct_config.h"
#include "sovo/vo/tracking_kernels.h"
#include "sovo/vo/tracking_reference.h"

namespace sovo {

/// How a frame was aligned.
struct TrackingResult : FrameTracking {
  bool as_expected = false;  ///< It fits as well as the last frame lets expect.
  Affine affine;             ///< Of the current frame.
  double view_ratio = 0.0;   ///< Reference pixels that are in view.
  double correlation = 0.0;  ///< Of the brightness of reference pixels in view and image, -1..1.
  /// How sharp the image is at the reference pixels: mean squared gradient over the variance of the
  /// brightness there [1/px^2]. Gain and bias leave it alone, blur takes it away.
  double sharpness = 0.0;
  Mat6 information = Mat6::Zero();  ///< Of T_current_reference (left perturbation), unit noise.
  int hypothesis = 0;               ///< Which motion hypothesis was taken.
};

/// How well the last frame was tracked, and where the motion so far leads.
struct LastTracking {
  double rmse = 0.0;  ///< 0: nothing is known of it.
  double inlier_ratio = 1.0;
  std::optional<SE3> expected = std::nullopt;  ///< T_current_reference of the new frame.
};

/// Residuals above `huber` count linearly, those above `cutoff` a constant [grey levels].
struct RobustNorm {
  double huber = 9.0;
  double cutoff = 20.0;
};

/// Direct image alignment of a frame with the tracking reference: pose (6) and affine brightness
/// (2), Levenberg-Marquardt from the coarsest level to the finest (DSO, Sec. 3.1, "frame
/// tracking").
class CoarseTracker {
 public:
  explicit CoarseTracker(const TrackerConfig& config) : config_(config) {}

  /// Tracks from the first hypothesis on until one is as good as `last` lets expect; the best one
  /// counts. When nothing is known of the last frame, all are tried.
  TrackingResult track(const TrackingReference& reference, const ImagePyramid& pyramid,
                       double exposure_s, const Affine& affine_guess,
                       std::span<const SE3> hypotheses, const LastTracking& last);

  /// Aligns the finest levels alone, for a motion that is known to a pixel or two: where little
  /// texture tells of it, none of that is left on coarser levels, and they lead astray.
  TrackingResult refine(const TrackingReference& reference, const ImagePyramid& pyramid,
                        double exposure_s, const Affine& affine_guess, const SE3& start,
                        const LastTracking& last);

  /// For when nothing is known of the motion: aligns the coarsest level from each hypothesis, or of
  /// many from those that explain it best as they are, and returns the `keep` best motions found,
  /// best first.
  std::vector<SE3> rank(const TrackingReference& reference, const ImagePyramid& pyramid,
                        double exposure_s, const Affine& affine_guess,
                        std::span<const SE3> hypotheses, std::size_t keep);

  /// Those of many motions that leave the least residuals of the second finest level, as they are;
  /// best first. Points that leave the view do not count against one.
  std::vector<SE3> likeliest(const TrackingReference& reference, const ImagePyramid& pyramid,
                             double exposure_s, const Affine& affine_guess,
                             std::span<const SE3> motions, std::size_t keep);

  /// How a motion fits level 0.
  struct Fit {
    double misfits = 0.0;  ///< Share of the points in view whose residual exceeds the cutoff.
    /// Of reference and image, by the weights of the residuals: what does not agree has no say.
    double correlation = 0.0;
    double energy = 0.0;  ///< Robust, mean of a point [grey levels^2].
  };
  Fit fit(const TrackingReference& reference, const ImageF& image, const SE3& T_current_reference,
          const BrightnessTransfer& transfer);

  /// The robust residuals of a pose over some points of level 0, for the share of the variance of
  /// their brightness that it explains [grey levels]. Those residuals alone hardly tell a wrong
  /// place from the right one: what does not agree there counts no more than the cutoff.
  double unexplained(const TrackingReference& reference, const ReferenceLevel& points,
                     const ImageF& image, double exposure_s, TrackingResult pose);

  /// One linearization for tests: 8x8 normal matrix, gradient and mean energy at a level.
  struct Linearization {
    Mat8 H;
    Vec8 b;
    double energy = 0.0;     ///< Mean over the points in view.
    double saturated = 0.0;  ///< Share of them above the cutoff.
    int in_view = 0;
    int inliers = 0;
  };
  Linearization linearize(const TrackingReference& reference, int level, const ImageF& image,
                          const SE3& T_current_reference, const BrightnessTransfer& transfer,
                          const RobustNorm& norm);

 private:
  struct LevelOutcome {
    double rmse = 0.0;
    bool finite = true;
    Linearization last;
  };
  double residuals(const ReferenceLevel& level, const ImageF& image, const SE3& T,
                   const BrightnessTransfer& transfer, const RobustNorm& norm, Linearization* out);
  /// Correlation and sharpness of the result's pose.
  static void compare(const ReferenceLevel& level, const ImageF& image, TrackingResult* result);
  void normal_equations(const BrightnessTransfer& transfer, double reference_b, Linearization* out);
  LevelOutcome align_level(const TrackingReference& reference, int level, const ImageF& image,
                           double exposure_s, RobustNorm* norm, SE3* T, Affine* affine,
                           int max_iterations);
  /// How badly a motion explains a level, as it is or once aligned there; lower is better.
  double score_as_it_is(const TrackingReference& reference, int level, const ImageF& image,
                        double exposure_s, const Affine& affine, const SE3& T);
  double score_aligned(const TrackingReference& reference, int level, const ImageF& image,
                       double exposure_s, Affine affine, SE3* T);
  /// Aligns the `levels` finest levels.
  TrackingResult try_hypothesis(const TrackingReference& reference, const ImagePyramid& pyramid,
                                double exposure_s, const Affine& guess, const SE3& start,
                                int levels);
  /// What is as expected, and what is good enough to be believed.
  void compare_with_last(const TrackingReference& reference, const ImagePyramid& pyramid,
                         const LastTracking& last, TrackingResult* result) const;
  bool is_believed(const TrackingReference& reference, const LastTracking& last,
                   const TrackingResult& found) const;

  TrackerConfig config_;
  WarpedPoints warped_;
  std::vector<double> best_rmse_;  ///< Of the hypotheses tried so far, by level.
};

}  // namespace sovo
