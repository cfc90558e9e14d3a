#pragma once

#include <vector>

#include "sovo/geometry/camera_model.h"
#include "sovo/vo/monocular_backend.h"
#include "sovo/vo/window.h"

namespace sovo {

/// Points of one pyramid level of the tracking reference, one array a quantity.
struct ReferenceLevel {
  CameraModel camera;  ///< Of this level.
  AlignedVector<float> u, v, rho, colour;
  std::size_t size() const { return u.size(); }
};

/// What frames are tracked against: the newest keyframe with a semi-dense inverse depth map made
/// of all active points that are visible in it.
struct TrackingReference : ReferenceKeyframe {
  double exposure_s = 0.0;
  Affine affine;
  /// Of the last bundle adjustment: `PhotometricProblem::gradient_scatter`.
  double gradient_scatter = 1.0;
  RowShift rows;  ///< Of its image.
  std::vector<ReferenceLevel> levels;
  std::size_t num_window_points = 0;  ///< Points that were splatted.
};

/// Builds the reference from the newest keyframe of the window: every point whose residual into
/// it is an inlier is splatted with the weight of its depth information; coarser levels sum 2x2;
/// empty neighbours are filled once (DSO, Sec. 3.1).
TrackingReference build_tracking_reference(const Window& window, int num_levels);

/// The reference as an image is compared with that was read out row after row: each point lies
/// where it must for its own row in the reference's image, and for the one in which it is seen by
/// `T_current_reference`.
TrackingReference moved_by_rows(const TrackingReference& reference, const RowShift& rows,
                                const SE3& T_current_reference);

/// The same reference with all lengths multiplied by `scale`, the newest keyframe's centre fixed.
TrackingReference rescaled(const TrackingReference& reference, double scale);

}  // namespace sovo
