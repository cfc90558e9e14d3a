#pragma once

#include <array>
#include <vector>

#include "sovo/image/pyramid.h"
#include "sovo/scale/right_projection.h"
#include "sovo/scale/scale_optimizer.h"
#include "sovo/scale/scale_points.h"

namespace sovo {

/// Brightness between the cameras: I_right ~ gain * I_left + bias.
struct CameraBrightness {
  float gain = 1.0F;
  float bias = 0.0F;
};

/// What the right image shows at the projections of one pyramid level, one array a quantity.
struct ScaleSamples {
  AlignedVector<float> value;     ///< I_1 at the projection.
  AlignedVector<float> gradient;  ///< J: d I_1 / d log-scale.
  AlignedVector<float> across;    ///< d I_1 along the unit normal of the epipolar curve [1/px].
  AlignedVector<float> mask;      ///< 1 where the sample enters the sums, else 0.
  int in_view = 0;                ///< Visible points inside the right image.
  int used = 0;                   ///< Those of them with disparity.

  void resize(int padded);
};

/// Sums over the samples at one log-scale. W: weight; e: residual over its expected deviation.
struct ScaleSums {
  double H = 0.0;        ///< sum W J^2
  double b = 0.0;        ///< sum W J r
  double W_e2 = 0.0;     ///< sum of the robust weight times e^2
  double inliers = 0.0;  ///< |e| < 3
  double count = 0.0;
};

/// A Gauss-Newton step of log-scale and of a turn of the right camera about its own centre, in its
/// own frame [rad].
struct TurnStep {
  double log_scale = 0.0;
  Vec3 turn = Vec3::Zero();
  Mat3 covariance = Mat3::Zero();  ///< Of `turn`, log-scale being unknown [rad^2].
  /// By how much more parts of the image disagree about `turn` than noise explains, as standard
  /// deviations: a lens that is described badly is no turn [rad].
  Vec3 disagreement = Vec3::Zero();
  Vec3 scale_by_turn = Vec3::Zero();  ///< d (best log-scale) / d turn [1/rad].
};

/// The normal equations of a step, of the samples in one part of the right image.
struct TurnEquations {
  Eigen::Matrix4d H = Eigen::Matrix4d::Zero();
  Eigen::Vector4d b = Eigen::Vector4d::Zero();
};

/// Everything that an alignment stores; kept between calls to save the allocation.
struct ScaleWorkspace {
  ScalePoints points;
  ScalePoints turned;
  std::array<ScaleProjections, 3> turned_projections;
  ScaleProjections projections;
  ScaleSamples samples;
  std::vector<int> nearest;  ///< z-buffer: index of the nearest point of a cell.
};

/// Photometric alignment of a keyframe's points with the right image over log-scale
/// sigma = ln s, level by level. r = I_1(pi_1(e^sigma X' + t)) - (gain I_0 + bias).
///
/// A sample's expected variance is that of its errors in both variables,
/// sigma_I^2 + (J sigma_rho / rho)^2, times a factor `dispersion` found along with the scale;
/// Student-t weights on top make it robust.
class ScaleAlignment {
 public:
  ScaleAlignment(const ScaleOptimizerConfig& config, const RightProjection& projection,
                 const ImagePyramid& left, const ImagePyramid& right, ScaleWorkspace* workspace);

  /// Forgets brightness and dispersion, before another start.
  void restart();

  /// Chooses the pyramid level of what follows.
  void set_level(int level);

  /// Marks points that nearer ones hide from the right camera at log-scale `sigma`. Points share a
  /// cell of the right image, but not of the left one, with what hides them.
  void find_occlusions(double sigma);

  /// Projects and samples, with gradients, at log-scale `sigma`.
  void linearize(double sigma);

  /// Closed form brightness: equal first and second moments of both sides, robustly reweighted.
  void fit_brightness();

  /// How much larger residuals are than expected, by the sums at the last linearization.
  void fit_dispersion(const ScaleSums& sums);

  /// Sums at the last linearization.
  ScaleSums sums() const;

  /// Gauss-Newton on the current level from `sigma`. False when too few points are left.
  bool minimize(double stop, double* sigma, int* iterations);

  /// Variance of the minimum: the sandwich sum (psi J)^2 / (sum psi' J^2)^2, which holds whatever
  /// the distribution of the residuals, times kappa, and no less than the floor.
  double variance() const;

  /// The step from the last linearization, at the current level: of log-scale and of the right
  /// camera's turn, which together lower the weighted residuals most.
  TurnStep turn_step() const;

  /// Zero-mean normalized cross-correlation of left and right values at log-scale `sigma`; -1 when
  /// fewer than `min_count` points are in view.
  double correlation(double sigma, int min_count);

  /// Hides the points that move by less than `min_shift` px of level 0 in a unit of log-scale, as
  /// seen at `sigma`; `find_occlusions` brings them back.
  void hide_unmoved(double sigma, double min_shift);

  /// Root mean square of |d position / d log-scale| over points in view, after `correlation` [px].
  double mean_shift() const { return mean_shift_; }

  const CameraBrightness& brightness() const { return brightness_; }
  int in_view() const { return workspace_->samples.in_view; }
  int used() const { return workspace_->samples.used; }
  /// Robust root mean square residual of the last linearization [grey levels].
  double residual() const;
  int level() const { return level_; }

 private:
  /// The points as they lie where the right camera is turned a little about each of its axes, at
  /// the last linearization: by differences, whatever the lens.
  void project_turned() const;

  static constexpr int kTurnColumns = 4;
  static constexpr int kTurnRows = 3;
  using TurnCells = std::array<TurnEquations, std::size_t{kTurnColumns * kTurnRows}>;
  /// Of each part of the right image.
  TurnCells turn_equations() const;
  TurnEquations* cell_at(float x, float y, TurnCells* cells) const;

  const ScaleOptimizerConfig& config_;
  const RightProjection& projection_;
  const ImagePyramid& left_;
  const ImagePyramid& right_;
  ScaleWorkspace* workspace_;
  CameraBrightness brightness_;
  double dispersion_ = 1.0;
  double mean_shift_ = 0.0;
  double linearized_at_ = 0.0;  ///< Log-scale.
  int level_ = 0;
};

}  // namespace sovo
