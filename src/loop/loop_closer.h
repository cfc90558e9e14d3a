#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "sovo/geometry/stereo_rig.h"
#include "sovo/image/static_matcher.h"
#include "sovo/loop/place_index.h"
#include "sovo/loop/pose_graph.h"
#include "sovo/odometry/odometry_output.h"
#include "sovo/place/landmarks.h"
#include "sovo/place/place.h"
#include "sovo/place/place_matcher.h"

namespace sovo {

struct LoopConfig {
  bool enabled = false;     ///< Whether places are recognized and `map` is published.
  double place_step = 0.1;  ///< Way from one place to the next, of the scene's median depth.
  double place_turn_deg = 8.0;
  int min_gap = 20;            ///< Places between those of a loop, at least.
  int min_votes = 12;          ///< Keypoints that name a place before it is looked at closely.
  double lost_support = 0.25;  ///< Share of landmarks seen again where no covariance is a guard.
  int max_candidates = 3;      ///< Places that are looked at closely, for each new one.
  int max_places = 3000;       ///< The oldest ones are forgotten.
  KeypointConfig keypoints;
  PlaceMatcherConfig matching;

  template <class Visitor>
  void visit(Visitor& v) {
    v("enabled", enabled, "recognize places and correct the trajectory in frame map");
    v("place_step", place_step, "way from one place to the next, of the scene's median depth");
    v("place_turn_deg", place_turn_deg, "turn from one place to the next [deg]");
    v("min_gap", min_gap, "places between those of a loop, at least");
    v("min_votes", min_votes, "keypoints that name a place before it is looked at closely");
    v("lost_support", lost_support,
      "share of a place's landmarks seen again that makes a loop between two segments");
    v("max_candidates", max_candidates, "places looked at closely for each new one, at most");
    v("max_places", max_places, "places kept; the oldest are forgotten");
    v("keypoints", keypoints, "what places are recognized by");
    v("matching", matching, "motion between two views of a place");
  }
};

/// A place that was seen again.
struct LoopClosure {
  std::int64_t older_stamp_ns = 0;
  std::int64_t newer_stamp_ns = 0;
  SE3 T_older_newer;  ///< Of the left cameras, as their images have it.
  int inliers = 0;
  double moved_m = 0.0;  ///< What the newest pose in `map` was corrected by.
};

/// What loop closing has done so far.
struct LoopCounts {
  std::uint64_t places = 0;
  std::uint64_t matched = 0;   ///< Pairs of views between which a motion was found.
  std::uint64_t refused = 0;   ///< Of them, those that the odometry's covariance rules out.
  std::uint64_t closures = 0;  ///< Of them, those that a second one confirmed.
};

/// Recognizes places that the camera has been to before, and corrects the trajectory by what that
/// tells: keyframes become places, their poses a graph whose edges are the odometry's steps, with
/// its covariance, and the loops. The odometry itself never moves: `map` is where its world `odom`
/// lies after all corrections.
///
/// A loop counts when its motion lies within what the odometry's covariance allows, and a second
/// loop near it says the same. Where a segment ended nothing is known of the motion, and a loop
/// alone connects the two.
///
/// Not thread-safe. Deterministic: the answers depend on the keyframes and their order only.
class LoopCloser {
 public:
  /// `rig`: the tracked pinhole camera and the raw right one; `mask`: 0 where the left image must
  /// not be used, may be empty.
  LoopCloser(const LoopConfig& config, const StaticMatcherConfig& matcher, const StereoRig& rig,
             ImageU8 mask);

  /// Takes a keyframe as the odometry gives it out, new or revised. Those without metres or images
  /// are no places. The loop that it closes, if any.
  std::optional<LoopClosure> add(const KeyframeOutput& keyframe);

  /// Takes what has come since the last optimization into account.
  void finish();

  /// The odometry's world, where the newest place has it, in the corrected one.
  SE3 T_map_odom() const;

  /// The places, where they are after all corrections; ascending stamps in each segment.
  std::vector<TrajectoryPose> corrected_places() const;

  /// A trajectory of the odometry with its corrections: each frame between two places is moved as
  /// they are. Without a loop it stays as it is, to the bit.
  std::vector<TrajectoryPose> corrected(std::vector<TrajectoryPose> trajectory) const;

  const LoopCounts& counts() const { return counts_; }

 private:
  /// A motion between two places that their images told.
  struct Loop {
    std::uint32_t older = 0, newer = 0;
    PlaceMatch match;
    bool closed = false;  ///< Another one says the same.
  };
  struct Node {
    Place place;
    std::optional<SE3> T_odom_refined;
    SE3 T_map_left;
  };

  bool is_place(const KeyframeOutput& keyframe) const;
  /// Of images that were halved so often.
  const ImageU8& mask(int halvings);
  Node make_node(const KeyframeOutput& keyframe);
  void revise(const KeyframeOutput& keyframe);
  std::optional<std::uint32_t> nearest_place(const Node& from, std::uint32_t end) const;
  std::vector<std::uint32_t> candidates(std::uint32_t newer) const;
  void find_loops(std::uint32_t newer);
  bool is_possible(const Loop& loop) const;
  bool agree(const Loop& a, const Loop& b) const;
  std::optional<LoopClosure> close(std::uint32_t newer);
  void bring_segment_home(const Loop& loop);
  void optimize();
  void forget_oldest();

  Node& node(std::uint32_t number) { return nodes_[number - first_]; }
  const Node& node(std::uint32_t number) const { return nodes_[number - first_]; }
  std::uint32_t end() const { return first_ + static_cast<std::uint32_t>(nodes_.size()); }
  GraphEdge step_edge(std::uint32_t from) const;

  LoopConfig config_;
  StaticMatcherConfig matcher_config_;
  StereoRig rig_;
  ImageU8 mask_;
  std::map<int, ImageU8> masks_;  ///< By the number of halvings.

  std::uint32_t first_ = 0;  ///< Number of the oldest place.
  std::deque<Node> nodes_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> numbers_;  ///< By keyframe.
  PlaceIndex index_;
  std::vector<Loop> loops_;
  std::size_t new_loops_ = 0;  ///< Closed since the last optimization.
  bool revised_ = false;       ///< Poses were, since then.
  LoopCounts counts_;
};

}  // namespace sovo
