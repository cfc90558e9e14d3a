#include "sovo/odometry/recent_places.h"

#include <memory>
#include <utility>

namespace sovo {

namespace {

/// The newest keyframe may have been blurred, or may have been the first that was wrong.
constexpr std::size_t kKept = 3;

}  // namespace

RecentPlaces::RecentPlaces(const StereoOdometryConfig& config, const FramePreparation& preparation)
    : config_(config), preparation_(preparation) {}

void RecentPlaces::note(const KeyframeOutput& keyframe) {
  if (!config_.recognition.enable || keyframe.revised || !keyframe.scale_valid) return;
  if (!keyframe.left || !keyframe.right) return;
  Seen seen;
  seen.view = {keyframe.left, keyframe.right, keyframe.T_later_left, keyframe.halvings,
               preparation_.left_mask(keyframe.halvings)};
  if (keyframe.co_moving_mask) {
    seen.view.mask = both_masks(seen.view.mask, *keyframe.co_moving_mask);
  }
  seen.place.T_odom_left = keyframe.T_odom_left;
  const std::lock_guard lock(mutex_);
  seen_.push_front(std::move(seen));
  if (seen_.size() > kKept) seen_.pop_back();
}

bool RecentPlaces::empty() const {
  const std::lock_guard lock(mutex_);
  return seen_.empty();
}

std::vector<Landmark> RecentPlaces::landmarks(const StereoView& view) const {
  return find_landmarks(view, config_.matcher, preparation_.rig(), config_.recognition.keypoints);
}

bool RecentPlaces::is_believable(const PlaceMatch& match, const Recognized& found,
                                 const ReckonedPose& expected) const {
  const RecognitionConfig& config = config_.recognition;
  if (!expected.knows_motion) {
    return match.support >= config.lost_support && match.inliers >= config.lost_inliers;
  }
  if (!expected.is_possible(found.T_odom_left)) return false;
  return found.is_likely || match.support >= config.min_support;
}

RecentPlaces::Recognized RecentPlaces::recognize(const Place& seen, const Place& here,
                                                 const ReckonedPose& expected) const {
  const PlaceMatcherConfig& config = config_.recognition.matching;
  const CameraModel& camera = preparation_.rig().left;
  Recognized best;
  const auto take = [&](const std::optional<PlaceMatch>& match) {
    if (!match) return;
    Recognized found{seen.T_odom_left * match->T_a_b, match->inliers};
    found.is_likely = expected.is_likely(found.T_odom_left);
    if (is_believable(*match, found, expected) && found.is_better_than(best)) best = found;
  };
  take(match_places(camera, seen, here, config));
  const SE3 T_seen_here = seen.T_odom_left.inverse() * expected.T_odom_left;
  take(match_places_near(camera, seen, here, T_seen_here, config));
  return best;
}

std::optional<SE3> RecentPlaces::find(const MonoFrame& left, const SideImage& right, int halvings,
                                      const SO3& right_turn, const DeadReckoning& reckoning) {
  const SE3& T_right_left = preparation_.rig().T_right_left;
  const SE3 turn = T_right_left.inverse() * SE3(right_turn, Vec3::Zero()) * T_right_left;
  const SE3 T_later_odom = reckoning.at(left.stamp_ns + right.stamp_offset_ns).inverse();
  auto right_pyramid = std::make_shared<ImagePyramid>();
  preparation_.prepare_right(right, halvings, left, right_pyramid.get());
  Place here;
  here.landmarks = landmarks({left.pyramid, std::move(right_pyramid),
                              turn * T_later_odom * reckoning.at(left.stamp_ns), halvings,
                              preparation_.left_mask(halvings)});
  const ReckonedPose expected = reckoning.reckon(left.stamp_ns);
  const std::lock_guard lock(mutex_);
  Recognized best;
  for (Seen& seen : seen_) {
    if (!std::exchange(seen.has_landmarks, true)) seen.place.landmarks = landmarks(seen.view);
    const Recognized found = recognize(seen.place, here, expected);
    if (found.is_better_than(best)) best = found;
  }
  if (best.inliers == 0) return std::nullopt;
  return best.T_odom_left;
}

}  // namespace sovo
