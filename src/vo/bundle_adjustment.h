#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "sovo/vo/bundle_result.h"
#include "sovo/vo/direct_config.h"
#include "sovo/vo/normal_equations.h"
#include "sovo/vo/photometric_problem.h"
#include "sovo/vo/window.h"
#include "sovo/vo/worker_pool.h"

namespace sovo {

/// Weights of the absolute priors on one keyframe's states (translation, rotation, a, b).
struct FramePrior {
  Vec8 weight = Vec8::Zero();
  Vec8 error = Vec8::Zero();  ///< Present value less the value that the prior pulls to.
};

/// Prior of a keyframe: the first of a map holds the gauge, each holds its brightness near zero.
FramePrior frame_prior(const Keyframe& keyframe, const WindowConfig& config);

/// Less scatter of gradients is not believed.
inline constexpr double kLeastScatter = 0.3;

/// What a keyframe's covariance for residuals of unit noise is to be multiplied with [grey levels
/// squared], from their RMS and `PhotometricProblem::gradient_scatter`: neighbouring pixels err
/// alike, as measured, and so do a point's keyframes, which share its host's pixels.
inline double keyframe_variance(double rmse, double gradient_scatter) {
  constexpr double kSharedHost = 5.0;
  return kSharedHost * std::max(gradient_scatter, kLeastScatter) * std::max(rmse * rmse, 1.0);
}

/// The same of a frame's alignment, whose finest levels look at one pixel of each point.
inline double frame_variance(double rmse, double gradient_scatter) {
  constexpr double kSharedReference = 2.0;
  return kSharedReference * std::max(gradient_scatter, kLeastScatter) * std::max(rmse * rmse, 1.0);
}

/// Photometric bundle adjustment over the sliding window by Levenberg-Marquardt: poses,
/// brightnesses and inverse depths; the intrinsics stay.
class BundleAdjuster {
 public:
  BundleAdjuster(const WindowConfig& config, WorkerPool* pool)
      : config_(config), problem_(config, pool) {}

  /// Optimizes, moves the newest keyframe's linearization point to its result, then drops the
  /// residuals that are outliers or out of view.
  BundleResult optimize(Window* window);

  /// Energy of the marginalization prior and the frame priors.
  double prior_energy(const Window& window) const;

  /// Gauss-Newton step of the poses (8 a keyframe) for the linearization at hand, without
  /// changing anything. `remove_gauge` takes the unobservable directions out of the step.
  VecX solve(const Window& window, const NormalEquations& system, double lambda,
             bool remove_gauge) const;

  /// Covariance as in `BundleResult`, for residuals of unit noise. Zero when the system does not
  /// tell it.
  Mat6 newest_covariance(const Window& window, const NormalEquations& system) const;

  /// What is known of the place of each keyframe but the newest, seen from that one: the inverse of
  /// its total variance for residuals of unit noise and a known scale; 0 where nothing is.
  std::vector<double> place_information(const Window& window, const NormalEquations& system) const;

  /// Orthonormal basis of the seven gauge directions (motion and scale of the world; of six where
  /// static residuals hold the scale) at the linearization points, in states divided by
  /// `state_units`.
  static MatX gauge_basis(const Window& window, const VecX& state_units);

  /// The directions that a step may lose: all gauge directions, or, while the first keyframe with
  /// its prior is in the window, scale about its centre alone, if static residuals do not hold it.
  static MatX removable_gauge(const Window& window, const VecX& state_units);

  /// Units that make the states comparable: translation half the mean depth, rotation 1, a 10,
  /// b 1000.
  static VecX state_units(const Window& window);

 private:
  /// Poses and brightnesses alone, the depths eliminated, with the priors on them: H x = -b.
  struct ReducedSystem {
    MatX H;
    VecX b;
  };
  ReducedSystem reduced(const Window& window, const NormalEquations& system, double lambda) const;
  /// Covariance of the `wanted` states of a window whose reduced system has this H, as seen from
  /// the keyframe `anchor`, of which only its brightness may be among them, and for a known scale.
  static MatX covariance_beside(const Window& window, MatX H, int anchor,
                                const std::vector<Eigen::Index>& wanted);
  // The two above of a reduced system that has this H.
  static Mat6 newest_covariance(const Window& window, const MatX& H);
  std::vector<double> place_information(const Window& window, MatX H) const;
  /// Takes back what steps moved the whole world by. `before`: T_world_camera of all keyframes;
  /// `H`: of the last reduced system.
  void hold_world(const std::vector<SE3>& before, const MatX& H, Window* window) const;
  /// Sets the newest keyframe's outlier threshold from the energies of the residuals into it.
  void update_outlier_threshold(const WindowLinearization& linearized, Window* window) const;
  /// Applies the step to poses and, by back-substitution, to depths. True when all are small.
  bool apply_step(const VecX& dx, double lambda, Window* window);
  /// Levenberg-Marquardt iterations from `now_`, which follows the accepted estimate. Returns the
  /// last system that was solved.
  NormalEquations iterate(Window* window, BundleResult* result);
  void drop_bad_residuals(Window* window) const;
  /// What static residuals of a free scale agree about is no more than that scale: a Gauss-Newton
  /// step of its logarithm, the depths held. What is left of them in `now_` is their part.
  void refine_static_scale(Window* window);
  bool tells_lens(const Window& window) const;
  /// For residuals of unit noise. Before linearization points move.
  std::optional<LensEvidence> lens_evidence(const Window& window);
  /// What static residuals that are inliers tell of the logarithm of a common factor of all inverse
  /// depths: H, and H times its derivative by a common addend to them [m].
  struct ScaleInformation {
    double information = 0.0;
    double of_offset = 0.0;
  };
  static ScaleInformation scale_information(const WindowLinearization& at,
                                            const std::vector<PointRef>& points);
  /// Where static residuals hold the scale: how well.
  void tell_scale(const Window& window, double noise, BundleResult* result) const;

  /// An estimate to come back to.
  struct Backup {
    std::vector<Vec8> x;
    std::vector<double> rho;
    void take(const Window& window, const std::vector<PointRef>& points);
    void restore(Window* window, const std::vector<PointRef>& points) const;
  };

  WindowConfig config_;
  // For their memory alone: each bundle adjustment begins anew.
  PhotometricProblem problem_;
  WindowLinearization now_, next_;
  Backup backup_;
};

}  // namespace sovo
