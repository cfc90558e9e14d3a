#pragma once

#include <vector>

#include "sovo/vo/bundle_result.h"
#include "sovo/vo/features/feature_config.h"
#include "sovo/vo/features/feature_window.h"

namespace sovo {

/// Bundle adjustment of the newest keyframes of a window and its landmarks' inverse depths by
/// Levenberg-Marquardt on Huber's norm of the reprojection errors. The older keyframes are held,
/// and with them the gauge and the scale; of a window that has none older, the oldest two.
class FeatureAdjuster {
 public:
  explicit FeatureAdjuster(const FeatureConfig& config) : config_(config) {}

  /// Afterwards outliers are marked anew, and the landmarks' information is that of the inliers.
  BundleResult optimize(FeatureWindow* window);

  /// One linearization, for tests: energy, and the system of the free keyframes (6 each) and the
  /// landmarks with depth, before elimination and without damping.
  struct System {
    double energy = 0.0;
    MatX H;                       ///< Of the free keyframes.
    VecX b;                       ///< Negative gradient.
    std::vector<double> H_rho;    ///< A landmark.
    std::vector<double> b_rho;    ///< Negative gradient.
    std::vector<double> damping;  ///< What is added to H_rho.
    MatX H_rho_frame;             ///< A column a landmark,
    /// and which free keyframes have a part in it: few.
    std::vector<std::vector<Eigen::Index>> touched;
  };
  System linearize(const FeatureWindow& window) const;

  /// Index of the first keyframe that is not held.
  std::size_t first_free(const FeatureWindow& window) const;

  /// Takes a step: poses from the left, inverse depths.
  void take_step(const VecX& frames, const VecX& depths, FeatureWindow* window) const;

 private:
  double energy_of(const FeatureWindow& window) const;
  double damping_of(const FeatureLandmark& landmark, double mean_rho) const;
  double mark_outliers(FeatureWindow* window) const;
  void measure_landmarks(FeatureWindow* window) const;
  Mat6 newest_covariance(const FeatureWindow& window) const;

  FeatureConfig config_;
};

}  // namespace sovo
