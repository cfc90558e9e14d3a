#pragma once

#include <span>
#include <vector>

#include "sovo/geometry/camera_model.h"
#include "sovo/vo/direct_config.h"
#include "sovo/vo/image_cells.h"
#include "sovo/vo/monocular_backend.h"
#include "sovo/vo/window.h"

namespace sovo {

/// Points of one pyramid level of the tracking reference, one array a quantity.
struct ReferenceLevel {
  CameraModel camera;  ///< Of this level.
  AlignedVector<float> u, v, rho, colour;
  AlignedVector<float> weight;  ///< By their gradients, 1 in the mean.
  std::size_t size() const { return u.size(); }
};

/// What frames are tracked against: the newest keyframe with a semi-dense inverse depth map made
/// of all active points that are visible in it.
struct TrackingReference : ReferenceKeyframe {
  double exposure_s = 0.0;
  Affine affine;
  /// Of the last bundle adjustment: `PhotometricProblem::gradient_scatter`.
  double gradient_scatter = 1.0;
  ViewShift shift;          ///< Of its image.
  ImagePyramidPtr pyramid;  ///< Of the keyframe.
  std::vector<ReferenceLevel> levels;
  double threshold_share = 1.0;  ///< Of thresholds on brightness, see `WeakTextureConfig`.
  ChosenCells co_moving;  ///< Of the image: seen to move along with the camera; empty: nothing is.
  std::size_t num_window_points = 0;  ///< Points that were splatted.
};

/// Weighted inverse depth of a pixel of the newest keyframe: sums of rho * w and of w.
struct SeenPoint {
  int x = 0, y = 0;
  float sum = 0.0F, weight = 0.0F;
};

/// The active points that the newest keyframe sees: those whose residuals into it are inliers, with
/// the weights of their depth information.
std::vector<SeenPoint> active_points(const Window& window);

/// The newest keyframe's own immature points whose depths stereo knows. Who drives fast sees what
/// is near in one frame or two, so that it never becomes active; and only what is near tells how
/// far one went.
std::vector<SeenPoint> matched_points(const Window& window);

/// Builds the reference from such points of the newest keyframe: they are splatted; coarser levels
/// sum 2x2; empty neighbours are filled once (DSO, Sec. 3.1). `gradient_constant`: see
/// `TrackerConfig`.
TrackingReference build_tracking_reference(const Window& window, std::span<const SeenPoint> points,
                                           int num_levels, double gradient_constant);

/// The pixels of the patterns around points of an image, at their depths. Precondition: the points
/// are pixels of it.
ReferenceLevel with_patterns(const ReferenceLevel& points, const ImageF& image);

/// Gradient that a quarter of some pixels remain below [grey levels/px]. Precondition: there are
/// some, and none is at the image's edge.
double lower_gradient(const ImageF& image, std::span<const float> u, std::span<const float> v);

/// What `WeakTextureConfig` leaves of thresholds, least_share to 1, by a reference's gradient and
/// the residuals' RMS, against the full `cutoff` [grey levels]. Precondition: least_share is 0 to
/// 1, to_gradient below from_gradient.
double threshold_share(const WeakTextureConfig& config, double gradient, double cutoff,
                       double rmse);

/// The reference as an image is compared with that was read out row after row: each point lies
/// where it must for its own row in the reference's image, and for the one in which it is seen by
/// `T_current_reference`.
TrackingReference moved_by_shift(const TrackingReference& reference, const ViewShift& rows,
                                 const SE3& T_current_reference);

/// The same reference with all lengths multiplied by `scale`, the newest keyframe's centre fixed.
TrackingReference rescaled(const TrackingReference& reference, double scale);

}  // namespace sovo
