#pragma once

#include <cstdint>
#include <string>

#include "sovo/geometry/stereo_rig.h"
#include "sovo/image/pyramid.h"
#include "sovo/vo/monocular_odometry.h"

namespace sovo {

/// Which solver finds the scale.
enum class ScaleMethod {
  kRobust,  ///< Over log-scale, weighted, robust, with cold start and variance.
  kPaper,   ///< The paper's plain Gauss-Newton over s (eq. 4-6), for comparison.
};

/// Why an estimate is, or is not, to be used.
enum class ScaleVerdict : std::uint8_t {
  kAccepted = 0,
  kTooFewPoints,   ///< Not enough points with disparity in view of the right camera.
  kUnobservable,   ///< The information about scale is too small (far or flat scene, no baseline).
  kAmbiguous,      ///< Cold start: a second minimum is nearly as good.
  kTooFewInliers,  ///< Photometric residuals disagree with every scale.
  kOutOfRange,     ///< The optimum lies at the edge of the searched range.
  kInnovation,     ///< Set by the filter: a confident disagreement with the scale so far.
  kNoRightImage,   ///< The right image was missing.
};

std::string to_string(ScaleVerdict verdict);

struct ScaleOptimizerConfig {
  ScaleMethod method = ScaleMethod::kRobust;
  double min_log_scale = -5.0;  ///< Cold-start grid.
  double max_log_scale = 5.0;
  double sigma_intensity = 5.0;    ///< Noise of a grey-level difference.
  double student_nu = 5.0;         ///< Degrees of freedom of the robust weight.
  double min_disparity_px = 0.75;  ///< Points with less are left out.
  double ambiguity_ratio = 0.8;    ///< (1 - best) / (1 - second) above which nothing is locked.
  double max_step = 0.2;           ///< Of log-scale an iteration.
  double stop_step = 2e-5;
  int max_iterations = 20;  ///< A pyramid level.
  int min_points = 200;
  double min_visible = 0.4;  ///< Of the points, in view of the right camera.
  double min_inliers = 0.6;
  double max_sigma_tracking = 0.02;  ///< Of log-scale.
  double max_sigma_cold = 0.05;
  double occlusion_ratio = 0.1;  ///< A point this much behind the nearest in its cell is hidden.
  double variance_factor = 3.0;  ///< kappa: R = kappa / information.
  double paper_max_residual = 15.0;  ///< RMSE gate of the paper's method.

  template <class Visitor>
  void visit(Visitor& v);
};

/// Result of one scale optimization.
struct ScaleEstimate {
  double log_scale = 0.0;  ///< Lengths of the snapshot are to be multiplied by exp(log_scale).
  double sigma = 0.0;      ///< Standard deviation of log_scale.
  double residual = 0.0;   ///< Robust RMS of the photometric residual [grey levels].
  double gain = 1.0;       ///< Brightness between the cameras: I_right ~ gain * I_left + bias.
  double bias = 0.0;
  double ambiguity = 0.0;    ///< Of a cold start; 0 is unambiguous, 1 a tie.
  double epipolar_px = 0.0;  ///< Median residual displacement across the epipolar curve.
  int num_points = 0;        ///< Used at the finest level.
  double inlier_ratio = 0.0;
  int iterations = 0;  ///< Over all levels.
  ScaleVerdict verdict = ScaleVerdict::kTooFewPoints;
};

/// Finds the metric scale of a keyframe's points by aligning them photometrically with the right
/// image (paper, Sec. III-B). A pure function of its inputs: no state.
class ScaleOptimizer {
 public:
  /// `rig.left` must be the undistorted camera of the snapshots; `rig.right` is the raw right
  /// camera with its distortion: the right image is never rectified.
  ScaleOptimizer(const ScaleOptimizerConfig& config, const StereoRig& rig);

  /// Estimates the log-scale. `cold_start`: search all of the configured range first, else start
  /// from log-scale 0. `right`: raw right image, photometrically corrected.
  ScaleEstimate estimate(const KeyframeSnapshot& keyframe, const ImagePyramid& right,
                         bool cold_start) const;

 private:
  ScaleOptimizerConfig config_;
  StereoRig rig_;
};

}  // namespace sovo
