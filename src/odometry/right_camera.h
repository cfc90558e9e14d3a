#pragma once

#include <mutex>

#include "sovo/geometry/stereo_rig.h"
#include "sovo/image/static_matcher.h"
#include "sovo/scale/right_turn.h"

namespace sovo {

/// The right camera of a map as it is: turned against its calibration where keyframes agree that it
/// is. Belongs to the mapping thread, but for `known`.
class RightCamera {
 public:
  /// `rig`: as it was calibrated, of the images' size; `known`: the turn as it is known so far.
  RightCamera(const StaticMatcherConfig& config, const StereoRig& rig, const RightTurn& known);

  const SO3& turn() const { return turn_.turn(); }
  StereoRig rig() const { return calibrated_.turned(turn()); }
  const StaticMatcher& matcher() const { return matcher_; }

  /// What is known of the turn, for other threads too.
  RightTurn known() const;

  /// Takes what a keyframe shows of the turn beyond `given`, which was undone in it, and brings its
  /// scale to the turn that is undone from now on. Where that is quite another one, or the keyframe
  /// shows yet another, its scale is none. Returns by how much the scale of the map changes with
  /// the turn, in log-scale: so much less is known of it.
  double note(const SO3& given, ScaleEstimate* estimate);

 private:
  StaticMatcherConfig config_;
  StereoRig calibrated_;
  RightTurn turn_;
  StaticMatcher matcher_;
  mutable std::mutex mutex_;  ///< Of changes of `turn_`.
};

}  // namespace sovo
