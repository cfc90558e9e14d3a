#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "sovo/vo/direct_config.h"
#include "sovo/vo/features/feature_adjustment.h"
#include "sovo/vo/features/feature_tracker.h"
#include "sovo/vo/features/feature_window.h"
#include "sovo/vo/map_history.h"
#include "sovo/vo/monocular_backend.h"
#include "sovo/vo/motion_model.h"

namespace sovo {

/// Monocular odometry by features: corners are followed by patch alignment, poses and inverse
/// depths are those of the least reprojection errors, in each frame and over a window of keyframes.
/// It has no static residuals.
class FeatureOdometry final : public MonocularBackend {
 public:
  /// `keyframe`: the weights of motion that make keyframes. `camera`: pinhole without distortion.
  /// `mask`: 0 where pixels must not be used (may be empty).
  FeatureOdometry(const FeatureConfig& config, const KeyframeConfig& keyframe,
                  const CameraModel& camera, const ImageU8& mask, WorkerPool* pool);

  void use_static_residuals(const StereoRig& rig, StaticScale scale) override;
  int wanted_points() const override { return config_.features; }
  std::vector<SelectedPixel> select_pixels(const MonoFrame& frame, int wanted) override;
  void begin(const MonoFrame& frame, const SE3& T_world_camera,
             const std::vector<StartPoint>& points, const ImagePyramidPtr& right) override;
  TrackedFrame track(const MonoFrame& frame, double max_acceleration) override;
  TrackedFrame track_again(const MonoFrame& frame, const TrackedFrame& before) override;
  TrackedFrame track_from(const MonoFrame& frame, const SE3& T_current_reference) override;
  void take_back() override { motion_ = motion_kept_; }
  MapResult map(const TrackedFrame& tracked, const KeyframeStereo& stereo,
                const MapTimer& timer) override;
  const std::optional<KeyframeSnapshot>& snapshot() const override { return snapshot_; }
  double apply(const ScaleCorrection& correction) override;
  std::vector<KeyframeState> window_keyframes() const override;
  const std::vector<KeyframePose>& keyframes() const override { return history_.keyframes(); }
  std::uint32_t oldest_in_window() const override { return window_.keyframes.front().id; }
  int num_active_points() const override { return window_.num_with_depth(); }
  double log_scale() const override { return history_.log_scale(); }
  std::shared_ptr<const ReferenceKeyframe> reference() const override {
    return tracking_reference();
  }

  const FeatureWindow& window() const { return window_; }
  std::shared_ptr<const FeatureReference> tracking_reference() const;

 private:
  TrackedFrame track_against(const MonoFrame& frame,
                             std::shared_ptr<const FeatureReference> reference,
                             const MotionModel::Forecast& forecast);
  FeatureTracking align(const FeatureReference& reference, const MonoFrame& frame,
                        const MotionModel::Forecast& forecast) const;
  std::vector<SE3> turned_motions(const MonoFrame& frame,
                                  const MotionModel::Forecast& forecast) const;
  bool wants_keyframe(const FeatureReference& reference, const FeatureTracking& tracked) const;

  void insert_keyframe(const TrackedFrame& tracked, const SE3& T_world_camera);
  void give_depths();
  std::vector<KeyframeState> drop_oldest();
  void drop_unseen();
  std::vector<SelectedPixel> select_free_corners(const MonoFrame& frame, int wanted);
  void add_landmarks(const MonoFrame& frame, const DepthProposer& proposer, const MapTimer& timer);
  void add_landmark(const SelectedPixel& pixel, const DepthProposal& depth,
                    const FeatureKeyframe& host);
  void publish_reference();
  void take_snapshot();
  void keep_point(const FeatureLandmark& landmark, KeyframePoints* points) const;

  FeatureConfig config_;
  KeyframeConfig keyframe_config_;
  CameraModel camera_;
  ImageU8 mask_;

  // Mapping side.
  FeatureWindow window_;
  FeatureAdjuster adjuster_;
  MapHistory history_;
  std::uint32_t next_keyframe_ = 0;
  std::uint64_t next_landmark_ = 0;
  std::optional<KeyframeSnapshot> snapshot_;

  // Shared: the reference.
  mutable std::mutex reference_mutex_;
  std::shared_ptr<const FeatureReference> reference_;

  // Tracking side.
  FeatureTracker tracker_;
  MotionModel motion_;
  MotionModel motion_before_;  ///< As the frame tracked last found it.
  MotionModel motion_kept_;    ///< As the last `track_from` found it.
  ImagePyramidPtr last_pyramid_;
};

}  // namespace sovo
