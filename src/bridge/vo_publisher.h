#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "sovo/bridge/odometry_conversion.h"
#include "sovo/bridge/participant.h"
#include "sovo/bridge/stage_timings.h"
#include "sovo/bridge/vo_views.h"
#include "sovo/bridge/writer.h"

namespace sovo::bridge {

struct VoPublisherConfig {
  bool publish_tf = true;
  bool publish_odom = true;  ///< False in mode mono, whose lengths are not metric.

  template <class Visitor>
  void visit(Visitor& v) {
    v("publish_tf", publish_tf, "send odom -> base_link to /tf; false beside an EKF that does");
  }
};

/// What an odometry process publishes: `odom`, `scaled_odometry`, `status`, `keyframe`, `path`
/// (1 Hz) and `/tf`, and what is shown beside them (VoViews): `tracked_points`, `points` and
/// `/diagnostics`.
///
///     auto publisher = VoPublisher::open(participant, config, rig.T_base_left);
///     StereoOdometry odometry(odometry_config, cameras, publisher->get(),
///     (*publisher)->timings()); for each frame: (*publisher)->set_feed(status_of_the_feed);
///     odometry.process(frame);
///
/// Nothing goes to `odom`, `/tf` and `path` before the scale is valid, and only `status` speaks of
/// a frame without a pose. A keyframe is written whenever the odometry gives it out, and replaces
/// what was written with its id; `path` shows each as it was written last.
class VoPublisher : public OutputSink {
 public:
  ~VoPublisher() override;

  static Result<std::unique_ptr<VoPublisher>> open(const Participant& participant,
                                                   const VoPublisherConfig& config,
                                                   const SE3& T_base_left);

  /// Stages that are timed are told in `status`.
  StageTimings* timings() { return &timings_; }

  /// `tracked_points` and `points` are silent before this. `tracked`: the undistorted camera
  /// (StereoOdometry::tracked_camera); `raw_left`: as calibrated.
  void set_cameras(const CameraModel& tracked, const CameraModel& raw_left) {
    views_->set_cameras({tracked, raw_left});
  }

  /// What is known about the feed, for the following frames; from any thread.
  void set_feed(const FeedStatus& feed);

  void on_frame(const OdometryOutput& output) override;
  void on_keyframe(const KeyframeOutput& keyframe) override;
  void on_scale(const ScaleRecord& /*record*/) override {}

  /// Writes that failed since the start, and what was wrong with the last.
  std::uint64_t failed_writes() const { return failed_writes_; }
  std::string last_failure() const;
  /// Messages of `tracked_points` and `points` that were made.
  std::uint64_t views_made() const { return views_->made(); }

 private:
  struct Writers;

  VoPublisher();

  void publish_pose(const OdometryOutput& output);
  void publish_transform(const OdometryOutput& output, const BaseMotion& motion);
  void publish_path(const KeyframeOutput& keyframe);
  void check(const Result<void>& written);

  VoPublisherConfig config_;
  SE3 T_base_left_;
  OdometryFrames frames_;
  std::unique_ptr<Writers> writers_;
  std::unique_ptr<VoViews> views_;
  StageTimings timings_;

  mutable std::mutex mutex_;  // of feed_ and failure_
  FeedStatus feed_;
  std::string failure_;

  std::atomic<std::uint64_t> failed_writes_{0};
  std::map<std::uint32_t, msg::PoseStamped> path_;  // by keyframe; only on_keyframe uses it
  Pace path_pace_{std::chrono::seconds(1)};
};

}  // namespace sovo::bridge
