#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "sovo/bridge/background_worker.h"
#include "sovo/bridge/odometry_conversion.h"
#include "sovo/bridge/participant.h"
#include "sovo/bridge/writer.h"

namespace sovo::bridge {

/// What an odometry process shows on demand, made on a background thread while somebody reads it:
/// `tracked_points` (5 Hz) and `points` (each new keyframe), and beside them `/diagnostics` (1 Hz),
/// also when no frame comes.
class VoViews {
 public:
  struct Cameras {
    CameraModel tracked;   ///< Undistorted, of the keyframes' points.
    CameraModel raw_left;  ///< As calibrated.
  };

  /// `publish_points`: false when lengths are not metric; `points` then stays silent.
  static Result<std::unique_ptr<VoViews>> open(const Participant& participant,
                                               const OdometryFrames& frames, const SE3& T_base_left,
                                               bool publish_points);
  ~VoViews();

  /// Both point topics are silent before this.
  void set_cameras(const Cameras& cameras);

  // From the odometry's threads; both return at once.
  void offer(const OdometryOutput& output, const FeedStatus& feed);
  void offer(const KeyframeOutput& keyframe);

  /// Messages with points that were made.
  std::uint64_t made() const { return made_; }

 private:
  /// What is shown, as the odometry gave it last.
  struct Newest {
    std::optional<Cameras> cameras;
    OdometryOutput output;
    FeedStatus feed;
    Pace::Clock::time_point arrived{};
    std::shared_ptr<const KeyframeOutput> keyframe;
    bool keyframe_is_new = false;
  };
  struct Writers;

  VoViews();
  void work();
  void show_tracked_points(const Newest& newest);
  void show_points(const Newest& newest);
  void show_diagnostics(const Newest& newest);
  void check(const Result<void>& written);

  OdometryFrames frames_;
  std::string process_name_;
  SE3 T_base_left_;
  bool publish_points_ = true;
  std::unique_ptr<Writers> writers_;
  Pace tracked_pace_;
  Pace diagnostics_pace_;
  std::int64_t shown_stamp_ns_ = 0;
  std::atomic<std::uint64_t> made_{0};
  std::atomic<std::uint64_t> failed_{0};

  std::mutex mutex_;  // of newest_
  Newest newest_;

  std::unique_ptr<BackgroundWorker> worker_;  // the last: stops before what it uses is gone
};

}  // namespace sovo::bridge
