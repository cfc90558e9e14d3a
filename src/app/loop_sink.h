#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "sovo/bridge/background_worker.h"
#include "sovo/loop/loop_closer.h"
#include "sovo/odometry/stereo_odometry.h"

namespace sovo::app {

/// What loop closing needs of a keyframe: all but its points.
KeyframeOutput needed_for_loops(const KeyframeOutput& keyframe);

/// Gives the odometry's keyframes to loop closing: as they come, or, live, on a thread of the
/// lowest priority, where the oldest of too many that wait are dropped and counted.
class LoopSink : public OutputSink {
 public:
  /// The map after a new place: where `odom` lies in it, and the places.
  struct Map {
    std::optional<LoopClosure> closure;  ///< If the place closed a loop.
    SE3 T_map_odom;
    std::vector<TrajectoryPose> places;
  };
  using OnPlace = std::function<void(const Map&)>;

  /// `on_place` is called on the thread that does the work; may be empty.
  LoopSink(const LoopConfig& config, const StaticMatcherConfig& matcher, bool background,
           OnPlace on_place);

  /// Begins with nothing. Before the odometry gets its first frame, and when it begins anew; then
  /// `on_place` is told of a map without places.
  void begin(const StereoOdometry& odometry);

  void on_frame(const OdometryOutput& /*output*/) override {}
  void on_keyframe(const KeyframeOutput& keyframe) override;
  void on_scale(const ScaleRecord& /*record*/) override {}

  /// Waits for the work, and takes the last revisions into account. No keyframes after it.
  void finish();

  std::vector<TrajectoryPose> corrected(std::vector<TrajectoryPose> trajectory) const;
  /// Does not wait for the work.
  LoopCounts counts() const;
  /// Keyframes that there was no time for.
  std::uint64_t dropped() const;

 private:
  void work();
  void take(const KeyframeOutput& keyframe);
  void set_counts(const LoopCounts& counts);

  LoopConfig config_;
  StaticMatcherConfig matcher_;
  OnPlace on_place_;

  mutable std::mutex closer_mutex_;
  std::unique_ptr<LoopCloser> closer_;

  mutable std::mutex queue_mutex_;  // never held while work is done
  std::deque<KeyframeOutput> queue_;
  LoopCounts counts_;  ///< As they were after the last keyframe.
  std::uint64_t dropped_ = 0;

  std::unique_ptr<bridge::BackgroundWorker> worker_;  // last: it uses what stands above
};

}  // namespace sovo::app
