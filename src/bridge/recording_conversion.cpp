#include "sovo/bridge/recording_conversion.h"

#include <algorithm>
#include <set>
#include <utility>

#include "sovo/bridge/recorded_calibration.h"
#include "sovo/bridge/recording_topics.h"
#include "sovo/io/text.h"

namespace sovo::bridge {
namespace {

constexpr std::size_t kMostNotes = 20;
constexpr char kFrameTypeName[] = "sovo_msgs/msg/StereoFrame";

}  // namespace

Result<void> RecordingConversion::run(const std::function<bool(std::uint64_t)>& progress) {
  if (auto done = copy_attachments(); !done) return done;
  copy_drops();
  if (config_.frames == FrameForm::kRosImages) {
    if (auto done = prepare_ros_images(); !done) return done;
  } else if (config_.frames == FrameForm::kStereoFrames) {
    if (auto done = prepare_stereo_frames(); !done) return done;
  }
  from_.seek(0);
  std::uint64_t read = 0;
  std::uint64_t last_ns = 0;
  while (const auto message = from_.next()) {
    last_ns = message->log_ns;
    if (auto done = convert(*message); !done) return done;
    if (!progress(++read)) return Error{"stopped by the user"};
  }
  if (!pairer_) return {};
  pairer_->end();
  return write_pairs(last_ns);
}

/// Every file of a recording has the same ones.
Result<void> RecordingConversion::copy_attachments() {
  std::set<std::pair<std::string, std::uint64_t>> known;
  for (const auto& file : from_.files()) {
    for (const mcap::AttachmentIndex& attachment : file->attachments()) {
      if (!known.emplace(attachment.name, attachment.log_ns).second) continue;
      auto data = file->read_attachment(attachment);
      if (!data) {
        note(data.error());
        continue;
      }
      auto done =
          to_.attach(attachment.name, attachment.media_type, attachment.log_ns, std::move(*data));
      if (!done) return done;
    }
  }
  return {};
}

/// The counts of a file hold for the recording up to its end.
void RecordingConversion::copy_drops() {
  std::map<std::string, std::uint64_t> drops;
  for (const auto& file : from_.files()) {
    const auto counts = file->metadata("sovo_drops");
    if (!counts) continue;
    for (const auto& [topic, text] : *counts) {
      const auto count = parse_integer(text);
      if (!count || *count < 0) continue;
      drops[topic] = std::max(drops[topic], static_cast<std::uint64_t>(*count));
    }
  }
  to_.set_drops(std::move(drops));
}

Result<void> RecordingConversion::prepare_ros_images() {
  for (const auto& [name, topic] : from_.topics()) {
    if (topic.type != kFrameTypeName || topic.messages == 0) continue;
    auto converter = std::make_unique<RosImageConverter>(name);
    Result<void> known = Error{"no StereoCalibration beside it"};
    if (const auto calibration = calibration_of(from_, name)) {
      from_.seek(0, [&](const RecordedTopic& t) { return t.topic == *calibration; });
      const auto message = from_.next();
      if (message) known = converter->take_calibration(message->data);
    }
    if (!known) note(name + " is converted without camera_info: " + known.error());
    converters_[name] = std::move(converter);
  }
  if (!converters_.empty()) return {};
  return Error{"there are no stereo frames (" + std::string(kFrameTypeName) + ") to convert"};
}

Result<void> RecordingConversion::prepare_stereo_frames() {
  auto topics = find_image_topics(from_, config_.topics.left, config_.topics.right);
  if (!topics) return topics.failure();
  const auto recorded = calibration_of(from_, topics->left);
  if (recorded) config_.ns = recorded->substr(0, recorded->rfind('/'));
  auto cameras = config_.calibration ? Result<StereoCameras>(*config_.calibration)
                                     : read_image_calibration(from_, *topics);
  if (!cameras) return cameras.failure();
  pairer_.emplace(std::move(*topics), config_.topics.pair_tolerance_s);
  stereo_.emplace(to_, config_.ns, false);
  return recorded ? Result<void>() : stereo_->begin(*cameras, from_.start_ns());
}

Result<void> RecordingConversion::convert(const RecordedMessage& message) {
  const std::string& name = message.topic->topic;
  if (const auto converter = converters_.find(name); converter != converters_.end()) {
    return write_images(*converter->second, message);
  }
  const bool made_anew =
      std::any_of(converters_.begin(), converters_.end(),
                  [&name](const auto& converter) { return converter.second->makes(name); });
  if (made_anew) return {};
  if (!pairer_) return copy_message(message);
  const ImageTopics& topics = pairer_->topics();
  if (name == topics.left || name == topics.right) {
    pairer_->add(message);
    return write_pairs(message.log_ns);
  }
  if (name == info_topic(topics.left) || name == info_topic(topics.right)) return {};
  return copy_message(message);
}

Result<void> RecordingConversion::write_images(const RosImageConverter& converter,
                                               const RecordedMessage& message) {
  const auto parts = converter.convert(message.data);
  if (!parts) {
    note(message.topic->topic + ": a frame is left out: " + parts.error());
    return {};
  }
  for (const auto& part : *parts) {
    auto done =
        to_.write(to_.topic_number(*part.topic), message.log_ns, message.publish_ns, part.data);
    if (!done) return done;
  }
  return {};
}

Result<void> RecordingConversion::write_pairs(std::uint64_t log_ns) {
  while (auto result = pairer_->next()) {
    if (result->state != SourceState::kFrame) {
      note(result->message);
      continue;
    }
    if (auto done = stereo_->write(result->frame, log_ns); !done) return done;
  }
  return {};
}

Result<void> RecordingConversion::copy_message(const RecordedMessage& message) {
  return to_.write(to_.topic_number(recording_topic(*message.topic)), message.log_ns,
                   message.publish_ns, message.data);
}

void RecordingConversion::note(const std::string& text) {
  if (notes_.size() < kMostNotes) notes_.push_back(text);
}

}  // namespace sovo::bridge
