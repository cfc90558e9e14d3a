#include "sovo/app/replayer.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <thread>

#include "sovo/bridge/cdr_codec.h"
#include "sovo/bridge/frame_number.h"
#include "sovo/bridge/offered_qos.h"
#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/ros_names.h"
#include "sovo/bridge/topics.h"

namespace sovo::app {
namespace {

using namespace std::chrono_literals;
namespace topics = bridge::topics;

constexpr auto kReplayPatience = 5s;
constexpr auto kLookPeriod = 200ms;
constexpr auto kReplaySlice = 20ms;
constexpr std::uint64_t kClockPeriodNs = 10'000'000;
constexpr std::uint64_t kImagesAhead = 4;  // so that one without its partner is tracked alone
constexpr std::size_t kImagesKnown = 64;
constexpr char kFrameType[] = "sovo_msgs/msg/StereoFrame";

/// What an odometry process writes.
constexpr std::array kOfVo = {
    topics::kOdometry, topics::kScaledOdometry, topics::kStatus,  topics::kKeyframe,
    "tracked_points",  topics::kPath,           topics::kMapPath, "points",
    topics::kTf};
/// What must not happen again only because it was recorded.
constexpr std::array kOfUsers = {topics::kCommand, topics::kRecordCommand, topics::kRecordStatus};

template <std::size_t N>
bool is_one_of(const std::array<const char*, N>& names, const std::string& topic) {
  return std::any_of(names.begin(), names.end(), [&](const std::string& name) {
    return name.starts_with('/') ? topic == name : topic.ends_with("/" + name);
  });
}

}  // namespace

Result<std::unique_ptr<Replayer>> Replayer::open(const bridge::Participant& participant,
                                                 const ReplaySection& config, double rate) {
  auto recording = Recording::open(config.path);
  if (!recording) return recording.failure();
  if ((*recording)->messages() == 0) return Error{config.path + " holds no messages"};
  if (config.start < 0.0 || config.start > (*recording)->duration_s()) {
    return Error{"--start is not within the recording's " +
                 std::to_string((*recording)->duration_s()) + " s"};
  }
  auto discovery = bridge::TopicDiscovery::open(participant);
  if (!discovery) return discovery.failure();
  auto clock =
      bridge::Writer<bridge::msg::Clock>::open(participant, topics::kClock, topics::kClockQos);
  if (!clock) return clock.failure();
  std::unique_ptr<Replayer> replayer(new Replayer(participant, config, rate, std::move(*recording),
                                                  std::move(*discovery), std::move(*clock)));
  if (auto opened = replayer->open_outputs(); !opened) return opened.failure();
  return replayer;
}

/// In a bag of another system the frames are the images of two cameras.
Result<void> Replayer::find_cameras() {
  const auto& all = recording_->topics();
  const bool has_frames = std::any_of(all.begin(), all.end(), [](const auto& topic) {
    return topic.second.type == kFrameType && topic.second.messages > 0;
  });
  if (has_frames) return {};
  auto images = bridge::find_image_topics(*recording_, config_.left, config_.right);
  if (images) {
    images_ = std::move(*images);
  } else if (!config_.left.empty()) {
    return images.failure();
  }
  return {};
}

/// Whether a message of the topic begins a stereo frame.
bool Replayer::is_frame(const RecordedTopic& topic) const {
  return topic.type == kFrameType || (images_ && topic.topic == images_->left);
}

Result<void> Replayer::open_outputs() {
  if (auto found = find_cameras(); !found) return found;
  for (const auto& [name, topic] : recording_->topics()) {
    if (topic.messages == 0 || name == topics::kClock) continue;
    if (!config_.all && is_one_of(kOfUsers, name)) continue;
    const bridge::TopicQos qos = bridge::parse_offered_qos(topic.offered_qos, bridge::reliable(10));
    const bridge::MessageSchema* known = bridge::find_schema(topic.type);
    const bridge::MessageSchema schema = {
        topic.type, bridge::dds_type(topic.type),
        topic.type_hash.empty() && known != nullptr ? known->type_hash : topic.type_hash,
        topic.definition};
    auto writer = bridge::RawWriter::open(participant_, name, schema, qos);
    if (!writer) return writer.failure();
    outputs_[name] = {std::make_shared<bridge::RawWriter>(std::move(*writer)), qos.latched,
                      is_one_of(kOfVo, name), is_frame(topic)};
  }
  return {};
}

/// Whether another process writes an odometry's status now.
void Replayer::look_for_vo() {
  const auto now = Clock::now();
  if (now < next_look_) return;
  next_look_ = now + kLookPeriod;
  const auto found = discovery_.topics();
  if (!found) return;
  const std::string status = participant_.topic(topics::kStatus);
  const bool live = std::any_of(found->begin(), found->end(), [&](const auto& topic) {
    return topic.name == status && topic.writers > 0;
  });
  if (live && !vo_is_live_ && !config_.all) {
    spdlog::info("an odometry process is on the bus: its topics are left out (--all plays them)");
  }
  vo_is_live_ = live;
}

/// Whether somebody reads the frames, or, in a recording without any, another topic.
bool Replayer::is_heard() const {
  const bool frames = std::any_of(outputs_.begin(), outputs_.end(),
                                  [](const auto& output) { return output.second.frames; });
  return std::any_of(outputs_.begin(), outputs_.end(), [frames](const auto& output) {
    return output.second.frames == frames && output.second.writer->num_readers() > 0;
  });
}

/// The first frames would go unheard while the processes find each other, and unpaced while the
/// odometry's status is not found.
void Replayer::wait_for_listener(const Stop& stop) {
  const auto begin = Clock::now();
  const bool follow = rate_ == 0.0;
  while (!stop() && Clock::now() - begin < kReplayPatience) {
    look_for_vo();
    if (is_heard() && (vo_is_live_ || !follow)) return;
    introduce();
    std::this_thread::sleep_for(kReplaySlice);
  }
  if (!is_heard()) {
    spdlog::warn("nobody listens after {} s; publishing all the same", kReplayPatience.count());
  } else if (follow) {
    spdlog::warn("no odometry after {} s; publishing without waiting for one",
                 kReplayPatience.count());
  }
}

/// An odometry that waits for camera_info tells its state only when it has heard it.
void Replayer::read_introductions() {
  introductions_.clear();
  if (!images_) return;
  for (const std::string& image : {images_->left, images_->right}) {
    const std::string info = bridge::info_topic(image);
    if (!outputs_.contains(info)) continue;
    recording_->seek(from_ns_, [&](const RecordedTopic& topic) { return topic.topic == info; });
    if (const auto message = recording_->next()) {
      introductions_.push_back({info, Bytes(message->data.begin(), message->data.end()),
                                static_cast<std::int64_t>(message->publish_ns)});
    }
  }
}

void Replayer::introduce() {
  if (rate_ != 0.0) return;
  for (const Introduction& introduction : introductions_) {
    bridge::RawWriter& writer = *outputs_.at(introduction.topic).writer;
    if (writer.num_readers() > 0) (void)writer.write(introduction.data, introduction.publish_ns);
  }
}

/// When the first frame from the start on was recorded; the start in a recording without frames.
std::uint64_t Replayer::first_frame_ns() {
  recording_->seek(from_ns_, [this](const RecordedTopic& topic) { return is_frame(topic); });
  const auto frame = recording_->next();
  return frame ? frame->log_ns : from_ns_;
}

/// What late readers would have got of the time before the first frame: an odometry begins, and can
/// be waited for, when it has heard the calibration.
Result<void> Replayer::publish_latched(std::uint64_t before_ns) {
  recording_->seek(0, [this](const RecordedTopic& topic) {
    const auto output = outputs_.find(topic.topic);
    return output != outputs_.end() && output->second.latched;
  });
  while (const auto message = recording_->next()) {
    if (message->log_ns >= before_ns) break;
    if (auto done = publish(*message); !done) return done;
  }
  return {};
}

Result<void> Replayer::publish(const RecordedMessage& message) {
  Output& output = outputs_.at(message.topic->topic);
  if (output.of_vo && vo_is_live_ && !config_.all) {
    ++state_.left_out;
    return {};
  }
  ++state_.published;
  return output.writer->write(message.data, static_cast<std::int64_t>(message.publish_ns));
}

/// The number of a frame; the follower is that of its session.
std::optional<std::uint64_t> Replayer::follow_frame(const RecordedMessage& message) {
  const auto number = bridge::frame_number(message.data);
  if (!number) return std::nullopt;
  if (!follower_ || followed_session_ != number->session) {
    auto follower = VoFollower::open(participant_, number->session);
    if (!follower) return std::nullopt;
    follower_.emplace(std::move(*follower));
    followed_session_ = number->session;
  }
  return number->sequence;
}

/// Images are known by their stamps.
std::optional<std::uint64_t> Replayer::follow_image(const RecordedMessage& message) {
  const auto header = bridge::decode<bridge::msg::Header>(message.data);
  if (!header) return std::nullopt;
  if (!follower_) {
    const auto numbering = [this](const bridge::msg::VoStatus& status) {
      const auto sent = sent_images_.find(bridge::stamp_ns(status.header.stamp));
      using Number = std::optional<std::uint64_t>;
      return sent == sent_images_.end() ? Number() : Number(sent->second);
    };
    auto follower = VoFollower::open(participant_, numbering, kImagesAhead);
    if (!follower) return std::nullopt;
    follower_.emplace(std::move(*follower));
  }
  const std::uint64_t number = num_images_++;
  sent_images_[bridge::stamp_ns((*header)->stamp)] = number;
  if (sent_images_.size() > kImagesKnown) sent_images_.erase(sent_images_.begin());
  return number;
}

/// As fast as the odometry goes: frames wait for it.
void Replayer::follow_vo(const RecordedMessage& message, const Stop& stop) {
  if (!is_frame(*message.topic) || !vo_is_live_) return;
  const auto number = images_ ? follow_image(message) : follow_frame(message);
  if (number) follower_->wait_before(*number, stop);
}

void Replayer::pace(const RecordedMessage& message, const Stop& stop) {
  if (rate_ == 0.0) return follow_vo(message, stop);
  const double ahead_ns = static_cast<double>(message.log_ns - from_ns_) / rate_;
  const auto due = began_ + std::chrono::nanoseconds(static_cast<std::int64_t>(ahead_ns));
  while (!stop() && Clock::now() < due) {
    std::this_thread::sleep_for(std::min<Clock::duration>(due - Clock::now(), kReplaySlice));
  }
}

Result<void> Replayer::tell_time(std::uint64_t log_ns) {
  if (log_ns < next_clock_ns_) return {};
  next_clock_ns_ = log_ns + kClockPeriodNs;
  bridge::msg::Clock clock{};
  clock.clock = bridge::to_message(static_cast<std::int64_t>(log_ns));
  return clock_.write(clock);
}

Result<void> Replayer::play(const Stop& stop, const std::function<void(const State&)>& progress) {
  const std::uint64_t start = recording_->start_ns();
  from_ns_ = start + static_cast<std::uint64_t>(config_.start * 1e9);
  next_clock_ns_ = 0;
  state_.duration_s = recording_->duration_s();
  const std::uint64_t first_frame = first_frame_ns();
  if (auto done = publish_latched(first_frame); !done) return done;
  read_introductions();
  wait_for_listener(stop);
  recording_->seek(from_ns_,
                   [this](const RecordedTopic& topic) { return outputs_.contains(topic.topic); });
  began_ = Clock::now();
  while (!stop()) {
    const auto message = recording_->next();
    if (!message) break;
    const bool said = outputs_.at(message->topic->topic).latched && message->log_ns < first_frame;
    if (said) continue;
    look_for_vo();
    pace(*message, stop);
    if (auto done = tell_time(message->log_ns); !done) return done;
    if (auto done = publish(*message); !done) return done;
    state_.position_s = static_cast<double>(message->log_ns - start) * 1e-9;
    progress(state_);
  }
  return {};
}

}  // namespace sovo::app
