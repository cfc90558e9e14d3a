#pragma once

#include <cstdint>
#include <vector>

#include "sovo/vo/keyframe_poses.h"
#include "sovo/vo/monocular_backend.h"

namespace sovo {

/// What a map remembers beyond its window: the poses of all its keyframes, how well the newest
/// one's is known, and the similarities that were applied.
class MapHistory {
 public:
  /// Forgets poses and covariance; the similarities go on counting.
  void clear();

  /// Takes the window's poses (`KeyframePoses::record`).
  void record(const std::vector<WindowPose>& window) { keyframes_.record(window, log_scale()); }

  /// Adds the step from the keyframe before to the newest, as errors independent of those of the
  /// steps before. `step_covariance`: left perturbation of T_newest_before.
  void extend_covariance(const SE3& T_world_newest, const Mat6& step_covariance);

  /// What of a correction is still to be applied: less what was since its snapshot.
  double still_to_apply(const ScaleCorrection& correction) const;

  /// Notes a similarity after `window` was rescaled by it about its newest keyframe.
  void note_similarity(double log_scale, bool first_lock, const std::vector<WindowPose>& window);

  const std::vector<KeyframePose>& keyframes() const { return keyframes_.poses(); }
  double log_scale() const { return epoch_log_scale_.back(); }
  std::uint64_t scale_epoch() const { return epoch_log_scale_.size() - 1; }
  /// Of the newest keyframe's pose, as in `ReferenceKeyframe`.
  const Mat6& covariance() const { return covariance_; }

 private:
  void rescale_covariance(double scale, const Vec3& centre);

  KeyframePoses keyframes_;
  Mat6 covariance_ = Mat6::Zero();
  std::vector<double> epoch_log_scale_{0.0};  ///< The sum of similarities at each epoch.
};

}  // namespace sovo
