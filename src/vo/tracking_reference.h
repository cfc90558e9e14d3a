#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "sovo/geometry/camera_model.h"
#include "sovo/vo/window.h"

namespace sovo {

/// Points of one pyramid level of the tracking reference, one array a quantity.
struct ReferenceLevel {
  CameraModel camera;  ///< Of this level.
  AlignedVector<float> u, v, rho, colour;
  std::size_t size() const { return u.size(); }
};

/// What frames are tracked against: the newest keyframe with a semi-dense inverse depth map made
/// of all active points that are visible in it. Immutable once built; shared between threads.
struct TrackingReference {
  std::uint32_t keyframe_id = 0;
  std::int64_t stamp_ns = 0;
  double exposure_s = 0.0;
  Affine affine;
  double log_scale = 0.0;  ///< Sum of the similarities applied before it was built.
  SE3 T_world_camera;      ///< Of the keyframe when it was built.
  /// Of that pose, since the map began: (translation, rotation) in world axes, carried to the
  /// origin (geometry/pose_covariance.h). Without what errors of scale add.
  Mat6 covariance = Mat6::Zero();
  /// Of the last bundle adjustment: `PhotometricProblem::gradient_scatter`.
  double gradient_scatter = 1.0;
  double mean_rho = 1.0;  ///< Mean inverse depth of the level-0 points [1/m].
  std::vector<ReferenceLevel> levels;
  std::size_t num_window_points = 0;  ///< Points that were splatted.
  /// Poses T_world_camera of all keyframes of the window, by id: earlier frames hang on them.
  std::vector<std::pair<std::uint32_t, SE3>> keyframe_poses;
};

/// Builds the reference from the newest keyframe of the window: every point whose residual into
/// it is an inlier is splatted with the weight of its depth information; coarser levels sum 2x2;
/// empty neighbours are filled once (DSO, Sec. 3.1).
TrackingReference build_tracking_reference(const Window& window, int num_levels);

/// The same reference with all lengths multiplied by `scale`, the newest keyframe's centre fixed.
TrackingReference rescaled(const TrackingReference& reference, double scale);

}  // namespace sovo
