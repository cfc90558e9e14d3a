#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/se3.h"
#include "sovo/image/pyramid.h"
#include "sovo/vo/epipolar_pose.h"
#include "sovo/vo/patch_tracker.h"
#include "sovo/vo/pixel_selector.h"
#include "sovo/vo/two_view_refinement.h"

namespace sovo {

struct TwoViewInitializerConfig {
  int wanted_points = 2000;          ///< Pixels selected in the first frame.
  int min_matches = 60;              ///< Fewest followed patches.
  double min_parallax_deg = 0.8;     ///< Median angle left after the best rotation [deg].
  double min_inlier_share = 0.7;     ///< Of the followed patches, on one epipolar geometry.
  double max_direction_deg = 0.25;   ///< Standard deviation of the translation's direction [deg].
  double max_depth_error = 0.03;     ///< Median relative error of inverse depth per 0.5 px.
  double rotation_cost_ratio = 4.0;  ///< Rotation alone must cost this times as much.
  double min_in_front = 0.9;         ///< Share of inliers with positive depth.
  double max_rms = 14.0;             ///< Of the photometric residual after refinement [grey].
  double max_energy = 144.0;         ///< A point's mean robust squared residual [grey^2].
  double min_points_share = 0.3;     ///< Of the selected pixels, with a depth.
  int max_frames = 40;               ///< Failed when not ready after so many frames.
  int max_lost_frames = 5;           ///< Failed after so many frames with too few matches.
  PatchTrackerConfig tracker;
  EpipolarPoseConfig epipolar;
  TwoViewRefinementConfig refinement;

  template <class Visitor>
  void visit(Visitor& v) {
    v("wanted_points", wanted_points, "pixels selected in the first frame");
    v("min_matches", min_matches, "fewest followed patches");
    v("min_parallax_deg", min_parallax_deg, "median angle left after the best rotation [deg]");
    v("min_inlier_share", min_inlier_share, "of the patches, on one epipolar geometry");
    v("max_direction_deg", max_direction_deg, "deviation of the translation's direction [deg]");
    v("max_depth_error", max_depth_error, "median relative depth error for half a pixel");
    v("rotation_cost_ratio", rotation_cost_ratio, "rotation alone must cost this times as much");
    v("min_in_front", min_in_front, "share of inliers with positive depth");
    v("max_rms", max_rms, "photometric residual after refinement [grey levels]");
    v("max_energy", max_energy, "mean robust squared residual of a point [grey levels^2]");
    v("min_points_share", min_points_share, "share of the selected pixels with a depth");
    v("max_frames", max_frames, "failed when not ready after so many frames");
    v("max_lost_frames", max_lost_frames, "failed after so many frames with too few matches");
    v("tracker", tracker, "patch tracking");
    v("epipolar", epipolar, "relative pose from the patches");
    v("refinement", refinement, "photometric adjustment");
  }
};

/// A point of the first frame with the depth that two views gave it.
struct InitialPoint {
  float u = 0.F, v = 0.F;     ///< In the first frame's level 0 [px].
  float inverse_depth = 1.F;  ///< 1 / z; the mean over all points is 1.
  float sigma = 0.F;          ///< Its standard deviation: the images' noise alone.
};

/// What the two views gave.
struct TwoViewResult {
  std::int64_t first_stamp_ns = 0;
  std::int64_t newest_stamp_ns = 0;
  SE3 T_newest_first;       ///< In units in which the points' mean inverse depth is 1.
  double a = 1.0, b = 0.0;  ///< Brightness: I_newest = a I_first + b.
  double rms = 0.0;         ///< Photometric residual [grey levels].
  std::vector<InitialPoint> points;
};

/// The start of a monocular odometry from two views: a first frame, and the earliest later one
/// that shows enough parallax.
///
/// Corner-like pixels are followed from the first frame by patch alignment; rotation alone is
/// fitted to them, and as soon as much is left unexplained, a robust epipolar geometry. Only when
/// that explains the patches far better, its translation direction and depths being well
/// determined, are pose, brightness and the inverse depths of *all* selected pixels adjusted
/// photometrically. The direct initialization of DSO solves for everything from the first frame
/// on instead; its depths and translation start from nothing and it must wait and see, where a
/// violently shaken camera has long left the basin. Tracked patches have a basin of tens of pixels,
/// need no guess of depth, and their geometry tells by itself when parallax suffices.
class TwoViewInitializer {
 public:
  enum class Status {
    kNotYet,  ///< Feed the next frame.
    kReady,   ///< `result()` is valid.
    kFailed,  ///< Begin again from a newer first frame; `reason()` tells why.
  };

  explicit TwoViewInitializer(const TwoViewInitializerConfig& config = {});

  /// Begins at a frame. `pinhole`: camera of the pyramid's level 0, without distortion. `mask` may
  /// be null. False when the frame has too little texture.
  bool set_first(std::int64_t stamp_ns, ImagePyramidPtr pyramid, const CameraModel& pinhole,
                 const ImageU8* mask, PixelSelector* selector);

  /// Feeds the next frame.
  Status track(std::int64_t stamp_ns, const ImagePyramidPtr& pyramid);

  /// Valid after `track` returned kReady.
  const TwoViewResult& result() const { return result_; }

  /// What still misses, or why it failed.
  const std::string& reason() const { return reason_; }

 private:
  SO3 predict_rotation(const ImagePyramid& pyramid) const;
  void collect_matches();
  bool geometry_suffices(double rotation_cost, double parallax_px);
  bool make_points(const ImagePyramid& pyramid);
  void give_depths(const ImagePyramid& pyramid, const TwoViewState& state,
                   std::vector<TwoViewPoint>* points) const;
  bool finish(double rms, const TwoViewState& state, const std::vector<TwoViewPoint>& points);
  Status give_up_or_wait();

  TwoViewInitializerConfig config_;
  CameraModel camera_;
  ImageU8 mask_;
  ImagePyramidPtr first_, last_;
  std::vector<SelectedPixel> pixels_;
  PatchTracker tracker_;
  int frames_ = 0;
  int lost_frames_ = 0;
  SO3 R_last_first_;
  SO3 R_last_step_;   // rotation between the two newest frames
  SE3 T_last_first_;  // unit translation, zero while unknown
  std::vector<Correspondence> matches_;
  std::vector<PatchTracker::Position> match_positions_;  // in the first frame
  EpipolarPose pose_;
  TwoViewResult result_;
  std::string reason_;
};

}  // namespace sovo
