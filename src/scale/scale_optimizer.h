#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "sovo/geometry/stereo_rig.h"
#include "sovo/image/pyramid.h"
#include "sovo/vo/monocular_odometry.h"

namespace sovo {

/// Which solver finds the scale.
enum class ScaleMethod {
  kRobust,  ///< Over log-scale, weighted, robust, with cold start and variance.
  kPaper,   ///< The paper's plain Gauss-Newton over s (eq. 4-6), for comparison.
};

/// Names in configuration files.
constexpr std::array<std::pair<ScaleMethod, const char*>, 2> enum_names(ScaleMethod) {
  return {{{ScaleMethod::kRobust, "robust"}, {ScaleMethod::kPaper, "paper"}}};
}

/// Why an estimate is, or is not, to be used.
enum class ScaleVerdict : std::uint8_t {
  kAccepted = 0,
  kTooFewPoints,   ///< Not enough points, or not enough of them in view of the right camera.
  kUnobservable,   ///< The information about scale is too small (far or flat scene, no baseline).
  kAmbiguous,      ///< Cold start: a second minimum is nearly as good.
  kTooFewInliers,  ///< Photometric residuals disagree with every scale.
  kOutOfRange,     ///< The optimum lies at the edge of the searched range.
  kInnovation,     ///< Set by the filter: a confident disagreement with the scale so far.
  kNoRightImage,   ///< The right image was missing.
};

/// Name as logs and tables write it: "accepted", "too_few_points", ...
std::string to_string(ScaleVerdict verdict);

struct ScaleOptimizerConfig {
  ScaleMethod method = ScaleMethod::kRobust;
  double min_log_scale = -5.0;  ///< Cold-start grid.
  double max_log_scale = 5.0;
  double tracking_log_range = 0.5;   ///< Largest log-scale found without cold start.
  double sigma_intensity = 10.0;     ///< Noise of a grey-level difference between two cameras.
  double student_nu = 5.0;           ///< Degrees of freedom of the robust weight.
  double min_disparity_px = 0.75;    ///< Points with less are left out.
  double min_relative_sigma = 0.01;  ///< Floor of sigma/inverse depth: caps a near point's say.
  double ambiguity_ratio = 0.8;      ///< (1 - best) / (1 - second) above which nothing is locked.
  double max_step = 0.2;             ///< Of log-scale an iteration.
  double stop_step = 2e-5;
  int max_iterations = 20;  ///< A pyramid level.
  int tracking_level = 2;   ///< Coarsest pyramid level without cold start.
  int cold_level = 3;       ///< Level of the cold start's search.
  int min_points = 200;
  double min_visible = 0.4;  ///< Of the points, in view of the right camera.
  double min_inliers = 0.6;
  double max_sigma_tracking = 0.02;  ///< Of log-scale.
  double max_sigma_cold = 0.05;
  double occlusion_ratio = 0.1;  ///< A point this much behind the nearest in its cell is hidden.
  double variance_factor = 3.0;  ///< kappa: R = kappa / information.
  double sigma_floor = 3e-4;     ///< What calibration and interpolation leave, of log-scale.
  double paper_max_residual = 15.0;  ///< RMSE gate of the paper's method.

  template <class Visitor>
  void visit(Visitor& v) {
    v("method", method, "robust: weighted, over log-scale; paper: the paper's Gauss-Newton");
    v("min_log_scale", min_log_scale, "lower end of the cold start's search");
    v("max_log_scale", max_log_scale, "upper end of the cold start's search");
    v("tracking_log_range", tracking_log_range, "largest log-scale found without a cold start");
    v("sigma_intensity", sigma_intensity, "noise of a grey-level difference [grey levels]");
    v("student_nu", student_nu, "degrees of freedom of the robust weight");
    v("min_disparity_px", min_disparity_px, "points with less disparity are left out [px]");
    v("min_relative_sigma", min_relative_sigma,
      "floor of the relative depth uncertainty: caps the say of near points");
    v("ambiguity_ratio", ambiguity_ratio,
      "a cold start whose second minimum is this nearly as good is not locked");
    v("max_step", max_step, "largest change of log-scale an iteration");
    v("stop_step", stop_step, "change of log-scale at which the iteration ends");
    v("max_iterations", max_iterations, "iterations a pyramid level, at most");
    v("tracking_level", tracking_level, "coarsest pyramid level without a cold start");
    v("cold_level", cold_level, "pyramid level of the cold start's search");
    v("min_points", min_points, "fewest points with disparity");
    v("min_visible", min_visible, "least share of the points in view of the right camera");
    v("min_inliers", min_inliers, "least share of visible points that agree with the scale");
    v("max_sigma_tracking", max_sigma_tracking, "largest standard deviation of log-scale");
    v("max_sigma_cold", max_sigma_cold, "largest standard deviation of a cold start");
    v("occlusion_ratio", occlusion_ratio,
      "a point this much behind the nearest one at the same place is hidden");
    v("variance_factor", variance_factor, "variance = factor / information");
    v("sigma_floor", sigma_floor, "standard deviation of log-scale that no data removes");
    v("paper_max_residual", paper_max_residual,
      "method paper: largest accepted root mean square residual [grey levels]");
  }
};

/// A turn of the right camera against its calibration, as one keyframe shows it.
struct RightTurnEstimate {
  bool valid = false;
  Vec3 turn = Vec3::Zero();           ///< [rad]
  Vec3 sigma = Vec3::Zero();          ///< Standard deviations, of independent residuals [rad].
  Vec3 scale_by_turn = Vec3::Zero();  ///< d log-scale / d turn [1/rad].
  /// By how much more parts of the image disagree than `sigma` explains, as of a lens that is
  /// described badly [rad].
  Vec3 disagreement = Vec3::Zero();
  /// The keyframe's image hardly fits the map, whose depths may then be wrong, too: said by who
  /// tracked it.
  bool doubtful = false;
};

/// Result of one scale optimization.
struct ScaleEstimate {
  double log_scale = 0.0;  ///< Lengths of the snapshot are to be multiplied by exp(log_scale).
  double sigma = 0.0;      ///< Standard deviation of log_scale.
  double residual = 0.0;   ///< Robust RMS of the photometric residual [grey levels].
  double gain = 1.0;       ///< Brightness between the cameras: I_right ~ gain * I_left + bias.
  double bias = 0.0;
  double ambiguity = 0.0;  ///< Of a cold start; 0 is unambiguous, 1 a tie.
  /// Turn of the right camera, about its own centre and in its own frame, with which the images
  /// would agree best, beyond the one that was given; a log-scale that fits to it may differ.
  RightTurnEstimate turn;
  int num_points = 0;  ///< Used at the finest level.
  double inlier_ratio = 0.0;
  int iterations = 0;  ///< Over all levels.
  ScaleVerdict verdict = ScaleVerdict::kTooFewPoints;
  /// There are points enough, but at this scale too few of them lie in the right image.
  bool out_of_view = false;
};

class RightProjection;
struct ScaleWorkspace;

/// Finds the metric scale of a keyframe's points by aligning them photometrically with the right
/// image (paper, Sec. III-B). The result depends on the inputs of the call alone; storage is kept
/// from call to call, so one optimizer serves one thread at a time.
class ScaleOptimizer {
 public:
  /// `rig.left` must be the undistorted camera of the snapshots; `rig.right` is the raw right
  /// camera with its distortion: the right image is never rectified.
  ScaleOptimizer(const ScaleOptimizerConfig& config, const StereoRig& rig);
  ~ScaleOptimizer();
  ScaleOptimizer(ScaleOptimizer&& other) noexcept;
  ScaleOptimizer& operator=(ScaleOptimizer&& other) noexcept;

  /// Estimates the log-scale. `cold_start`: search all of the configured range first, else start
  /// from log-scale 0. `right`: raw right image, photometrically corrected. Both pyramids' level 0
  /// must have the size that their camera says. Where the verdict is kAccepted or kAmbiguous the
  /// estimate is a number with a sigma; else it must not be used. `T_later_left`: the left camera
  /// at the keyframe's instant into where it was when `right` was exposed, in the keyframe's unit
  /// of length; the identity when both were exposed together. `turn`: how the right camera is
  /// turned about its own centre, against the rig.
  ScaleEstimate estimate(const KeyframeSnapshot& keyframe, const ImagePyramid& right,
                         bool cold_start, const SE3& T_later_left = SE3(),
                         const SO3& turn = SO3()) const;

 private:
  ScaleOptimizerConfig config_;
  StereoRig rig_;
  std::unique_ptr<RightProjection> projection_;
  std::unique_ptr<ScaleWorkspace> workspace_;
  std::unique_ptr<ScaleWorkspace> sparse_workspace_;
};

}  // namespace sovo
