#pragma once

#include <deque>
#include <mutex>
#include <optional>

#include "sovo/odometry/dead_reckoning.h"
#include "sovo/odometry/frame_preparation.h"
#include "sovo/odometry/odometry_output.h"
#include "sovo/odometry/stereo_odometry.h"
#include "sovo/place/landmarks.h"
#include "sovo/place/place_matcher.h"

namespace sovo {

/// Finds where a camera is that has lost its track, by what its last keyframes saw: landmarks
/// of the frame are matched with theirs, wherever in the images these lie.
///
/// Landmarks are sought only when they are asked for; until then a keyframe costs nothing but its
/// images' memory. `note` may run on another thread than `find`.
class RecentPlaces {
 public:
  RecentPlaces(const StereoOdometryConfig& config, const FramePreparation& preparation);

  /// Takes a keyframe as it is given out, if it is new, has metres and both images.
  void note(const KeyframeOutput& keyframe);

  /// Whether there is anything to be recognized.
  bool empty() const;

  /// T_odom_left of a frame that shares enough with one of the keyframes, and is where a camera can
  /// be that moved so before. `left` was halved `halvings` times; `right_turn`: of the right camera
  /// against its calibration.
  std::optional<SE3> find(const MonoFrame& left, const SideImage& right, int halvings,
                          const SO3& right_turn, const DeadReckoning& reckoning);

 private:
  struct Seen {
    StereoView view;
    Place place;
    bool has_landmarks = false;
  };

  struct Recognized {
    SE3 T_odom_left;
    int inliers = 0;         ///< 0: nothing was.
    bool is_likely = false;  ///< By the motion before.

    bool is_better_than(const Recognized& other) const {
      return is_likely != other.is_likely ? is_likely : inliers > other.inliers;
    }
  };

  bool is_believable(const PlaceMatch& match, const Recognized& found,
                     const ReckonedPose& expected) const;
  /// The most believable motion between two places, if one can be believed.
  Recognized recognize(const Place& seen, const Place& here, const ReckonedPose& expected) const;
  std::vector<Landmark> landmarks(const StereoView& view) const;

  const StereoOdometryConfig& config_;
  const FramePreparation& preparation_;
  mutable std::mutex mutex_;
  std::deque<Seen> seen_;  ///< Newest first.
};

}  // namespace sovo
