#pragma once

#include <memory>
#include <vector>

#include "sovo/vo/features/feature_config.h"
#include "sovo/vo/features/feature_pose.h"
#include "sovo/vo/monocular_backend.h"
#include "sovo/vo/patch_alignment.h"
#include "sovo/vo/worker_pool.h"

namespace sovo {

/// A landmark that lies in the newest keyframe's view.
struct ReferenceFeature {
  std::uint64_t id = 0;
  ImagePyramidPtr host;
  float u = 0.0F, v = 0.0F;  ///< In the host's level 0 [px].
  SE3 T_reference_host;
  Vec3 ray;                ///< Of that pixel at the host's instant, z = 1.
  double rho = 0.0;        ///< [1/m]; a guess where there is no depth.
  double rho_sigma = 0.0;  ///< [1/m]
  bool has_depth = false;
  bool seen = true;  ///< By the newest keyframe; others may be hidden.
};

/// What frames are tracked against: the landmarks of the newest keyframe.
struct FeatureReference : ReferenceKeyframe {
  std::vector<ReferenceFeature> features;
};

/// Where a landmark was found in a frame.
struct FeatureView {
  std::uint64_t id = 0;
  Vec2 pixel;          ///< At the frame's instant.
  double sigma = 1.0;  ///< Of each coordinate [px].
};

/// Those that agree with the frame's pose, or have no depth yet; by ascending id.
struct FeatureViewList : FrameViews {
  std::vector<FeatureView> views;
};

/// A frame tracked by its features.
struct FeatureTracking {
  FrameTracking tracking;
  Mat6 covariance = Mat6::Zero();  ///< Of T_current_reference, left perturbation.
  double followed = 0.0;           ///< Share of what the reference saw that was found.
  std::shared_ptr<FeatureViewList> views;
};

/// Tracks a frame by its features: each landmark's patch is looked for where a motion puts it, the
/// pose follows from those that agree, and what was not found, or elsewhere, is looked for anew
/// around where that pose puts it.
class FeatureTracker {
 public:
  FeatureTracker(const FeatureConfig& config, const CameraModel& camera, WorkerPool* pool)
      : config_(config), camera_(camera), pool_(pool) {}

  /// From a motion that is expected. `levels`: of the pyramid, which bound how far off it may be.
  FeatureTracking track(const FeatureReference& reference, const MonoFrame& frame,
                        const SE3& expected, int levels) const;

  /// The motion that most of a few features agree with.
  SE3 best_of(const FeatureReference& reference, const MonoFrame& frame,
              const std::vector<SE3>& motions) const;

  /// Adds views of what the reference did not see, but should be in view at the pose that was
  /// found.
  void find_unseen(const FeatureReference& reference, const MonoFrame& frame,
                   FeatureTracking* tracked) const;

 private:
  std::vector<PatchMatch> follow(const FeatureReference& reference, const MonoFrame& frame,
                                 const SE3& T_current_reference, const std::vector<bool>& wanted,
                                 int levels) const;
  Vec2 shift_displacement(const ViewShift& shift, const SE3& T_current_host,
                          const ReferenceFeature& feature, const Vec2& pixel) const;
  FeaturePose pose_of(const FeatureReference& reference, const std::vector<PatchMatch>& matches,
                      const SE3& start) const;
  bool is_in_view(const SE3& T_current_reference, const ReferenceFeature& feature) const;

  FeatureConfig config_;
  CameraModel camera_;
  WorkerPool* pool_;
};

}  // namespace sovo
