#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "sovo/bridge/participant.h"
#include "sovo/bridge/reader.h"
#include "sovo/bridge/stereo_feed.h"
#include "sovo/bridge/stereo_pairing.h"

namespace sovo::bridge {

struct RosStereoConfig {
  std::string left;            ///< Image topic of the left camera, e.g. "/cam/left/image_raw".
  std::string right;           ///< That of the right camera.
  double tolerance_s = 0.005;  ///< Largest difference of the stamps of a pair.
  int queue = 4;               ///< Pairs that may wait for `next`; beyond, the oldest is dropped.
};

/// Stereo frames from the image topics of any ROS 2 driver, two `sensor_msgs/Image`, and the
/// calibration from `camera_info` beside each of them. A thread of its own takes, checks and pairs
/// them.
///
/// Intrinsics are those of `k` and `d`, or of `p` when the topic's name says that its images are
/// rectified ("rect"); the extrinsics follow from `r` and `p` of both. The mounting on the vehicle
/// is not known to CameraInfo: the base frame lies in the left camera. The first calibration is the
/// one of the whole run.
///
/// Each side follows its first publisher until that one is gone. An image that cannot be used comes
/// out of `next` as kBadFrame with the reason, the same reason once.
class RosStereoSubscriber : public StereoFeed {
 public:
  /// `calibration`: when given, CameraInfo is not asked for.
  static Result<std::unique_ptr<RosStereoSubscriber>> open(
      const Participant& participant, const RosStereoConfig& config,
      std::optional<StereoCameras> calibration = std::nullopt);
  ~RosStereoSubscriber() override;

  Result<void> wait_for_calibration(std::chrono::milliseconds timeout) override;
  const StereoCameras& cameras() const override { return *cameras_; }
  SourceResult next(std::chrono::milliseconds timeout) override;
  FeedCounters counters() const override;
  std::int64_t latency_origin_ns() const override { return latency_origin_ns_; }

 private:
  struct Side;
  struct Item {
    SourceResult result;
    std::int64_t latency_origin_ns = 0;
  };

  RosStereoSubscriber(const Participant& participant, const RosStereoConfig& config);

  Result<void> open_side(bool is_left);
  void receive();
  void work();
  void take_images(bool is_left);
  void take_image(bool is_left, const msg::Image& image, const dds_sample_info_t& info);
  void take_calibration();
  void fall_back_to_best_effort(Side& side, bool is_left);
  void hand_out_pairs();
  void push(Item item);
  void report_once(const std::string& text);
  Side& side(bool is_left) const { return is_left ? *left_ : *right_; }

  const Participant& participant_;
  RosStereoConfig config_;
  bool calibration_given_ = false;
  std::int64_t latency_origin_ns_ = 0;

  // Of the receiving thread alone.
  std::unique_ptr<Side> left_;
  std::unique_ptr<Side> right_;
  StereoPairing pairing_;
  std::uint64_t session_ = 0;
  std::uint64_t sequence_ = 0;
  std::int64_t newest_sent_ns_ = 0;
  std::map<std::string, bool> reported_;

  mutable std::mutex mutex_;  // of everything below
  std::condition_variable changed_;
  std::deque<Item> queue_;
  FeedCounters counters_;
  std::optional<StereoCameras> cameras_;  // written once
  std::string missing_;                   ///< What the calibration waits for.

  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace sovo::bridge
