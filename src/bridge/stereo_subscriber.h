#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "sovo/bridge/calibration_conversion.h"
#include "sovo/bridge/participant.h"
#include "sovo/bridge/reader.h"
#include "sovo/bridge/session_lock.h"
#include "sovo/bridge/stereo_feed.h"

namespace sovo::bridge {

struct StereoSubscriberConfig {
  int queue = 4;  ///< Frames that may wait for `next`; beyond, the oldest is dropped and counted.

  template <class Visitor>
  void visit(Visitor& v) {
    v("queue", queue, "frames that may wait; beyond, the oldest is dropped and counted");
  }
};

/// Stereo frames from the bus. A thread of its own takes and checks them as they come.
///
///     auto source = StereoSubscriber::open(participant, config);
///     const auto found = (*source)->wait_for_calibration(std::chrono::seconds(5));
///     StereoOdometry odometry(..., (*source)->cameras(), ...);
///     while (running) { auto result = (*source)->next(100ms); ... }
///
/// It follows the first publisher that it hears. A frame that is malformed comes out of `next` as
/// kBadFrame with the reason, a second publisher once likewise, and a followed publisher with
/// another calibration than the first ends the stream with kFailed.
class StereoSubscriber : public StereoFeed {
 public:
  /// `calibration`: when given, it is used and that of the publisher is not asked for.
  static Result<std::unique_ptr<StereoSubscriber>> open(
      const Participant& participant, const StereoSubscriberConfig& config,
      std::optional<StereoCameras> calibration = std::nullopt);
  ~StereoSubscriber() override;

  /// Waits for the calibration of the followed publisher; what is missing when it does not come.
  Result<void> wait_for_calibration(std::chrono::milliseconds timeout) override;
  const StereoCameras& cameras() const override { return *cameras_; }

  SourceResult next(std::chrono::milliseconds timeout) override;

  /// Ends a wait in `next`, the present or the next one; from any thread.
  void wake();

  FeedCounters counters() const override;
  std::int64_t latency_origin_ns() const override { return latency_origin_ns_; }

 private:
  struct Item {
    SourceResult result;
    std::int64_t latency_origin_ns = 0;
  };

  StereoSubscriber(Reader<msg::StereoFrame> frames, Reader<msg::StereoCalibration> calibrations,
                   const StereoSubscriberConfig& config)
      : config_(config), frames_(std::move(frames)), calibrations_(std::move(calibrations)) {}

  void receive();
  void take_calibrations();
  void take_frame(const msg::StereoFrame& message, const dds_sample_info_t& info);
  void accept(const msg::StereoFrame& message, std::int64_t sent_ns);
  void use_calibration_of_followed();
  void push(Item item);
  void report(SourceState state, const std::string& message);
  std::uint64_t publisher_of(const ReaderBase& reader, dds_instance_handle_t writer);
  bool is_alive(std::uint64_t publisher) const;

  StereoSubscriberConfig config_;
  bool calibration_given_ = false;
  std::int64_t latency_origin_ns_ = 0;

  // Of the receiving thread alone.
  Reader<msg::StereoFrame> frames_;
  Reader<msg::StereoCalibration> calibrations_;
  SessionLock lock_;
  GapCounter gaps_;
  std::map<dds_instance_handle_t, std::uint64_t> publishers_;  // by writer
  std::map<std::uint64_t, StereoCameras> heard_;               // calibration by publisher

  mutable std::mutex mutex_;  // of everything below
  std::condition_variable changed_;
  std::deque<Item> queue_;
  FeedCounters counters_;
  std::optional<StereoCameras> cameras_;  // written once
  std::string calibration_error_;
  bool woken_ = false;

  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace sovo::bridge
