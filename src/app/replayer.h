#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "sovo/app/app_config.h"
#include "sovo/app/vo_follower.h"
#include "sovo/bridge/image_topics.h"
#include "sovo/bridge/raw_writer.h"
#include "sovo/bridge/topic_discovery.h"
#include "sovo/bridge/writer.h"
#include "sovo/io/recording.h"

namespace sovo::app {

/// Publishes a recording as it was: the same bytes and source stamps, at the pace at which they
/// were received, with `/clock`.
class Replayer {
 public:
  using Stop = std::function<bool()>;
  struct State {
    double position_s = 0.0;  ///< Since the recording began.
    double duration_s = 0.0;
    std::uint64_t published = 0;
    std::uint64_t left_out = 0;  ///< Because a live process writes the topic, or as commands.
  };

  /// `rate`: 0 is as fast as the odometry goes.
  static Result<std::unique_ptr<Replayer>> open(const bridge::Participant& participant,
                                                const ReplaySection& config, double rate);

  /// Plays everything once; `progress` is called after each message.
  Result<void> play(const Stop& stop, const std::function<void(const State&)>& progress);
  std::vector<std::string> notes() const { return recording_->notes(); }
  std::size_t num_topics() const { return outputs_.size(); }

 private:
  struct Output {
    std::shared_ptr<bridge::RawWriter> writer;
    bool latched = false;
    bool of_vo = false;   ///< Left out while a live odometry is on the bus.
    bool frames = false;  ///< Of a camera.
  };
  /// A message that is sent before its time.
  struct Introduction {
    std::string topic;
    Bytes data;
    std::int64_t publish_ns = 0;
  };
  using Clock = std::chrono::steady_clock;

  Replayer(const bridge::Participant& participant, const ReplaySection& config, double rate,
           std::unique_ptr<Recording> recording, bridge::TopicDiscovery discovery,
           bridge::Writer<bridge::msg::Clock> clock)
      : participant_(participant),
        config_(config),
        rate_(rate),
        recording_(std::move(recording)),
        discovery_(std::move(discovery)),
        clock_(std::move(clock)) {}

  Result<void> open_outputs();
  Result<void> find_cameras();
  bool is_frame(const RecordedTopic& topic) const;
  void read_introductions();
  void introduce();
  void look_for_vo();
  bool is_heard() const;
  void wait_for_listener(const Stop& stop);
  std::uint64_t first_frame_ns();
  Result<void> publish_latched(std::uint64_t before_ns);
  Result<void> publish(const RecordedMessage& message);
  void follow_vo(const RecordedMessage& message, const Stop& stop);
  std::optional<std::uint64_t> follow_frame(const RecordedMessage& message);
  std::optional<std::uint64_t> follow_image(const RecordedMessage& message);
  void pace(const RecordedMessage& message, const Stop& stop);
  Result<void> tell_time(std::uint64_t log_ns);

  const bridge::Participant& participant_;
  ReplaySection config_;
  double rate_;
  std::unique_ptr<Recording> recording_;
  bridge::TopicDiscovery discovery_;
  bridge::Writer<bridge::msg::Clock> clock_;
  std::map<std::string, Output> outputs_;
  std::optional<bridge::ImageTopics> images_;  ///< Of the cameras in a recording without frames.
  std::vector<Introduction> introductions_;
  std::optional<VoFollower> follower_;
  std::uint64_t followed_session_ = 0;
  std::map<std::int64_t, std::uint64_t> sent_images_;  ///< Numbers of the latest, by their stamp.
  std::uint64_t num_images_ = 0;
  bool vo_is_live_ = false;
  Clock::time_point next_look_{};
  Clock::time_point began_{};
  std::uint64_t from_ns_ = 0;
  std::uint64_t next_clock_ns_ = 0;
  State state_;
};

}  // namespace sovo::app
