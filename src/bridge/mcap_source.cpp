#include "sovo/bridge/mcap_source.h"

#include <algorithm>

#include "sovo/bridge/cdr_codec.h"
#include "sovo/bridge/stereo_frame_conversion.h"

namespace sovo::bridge {
namespace {

constexpr const char* kFrameType = MessageTraits<msg::StereoFrame>::kRosName;
constexpr const char* kCalibrationType = MessageTraits<msg::StereoCalibration>::kRosName;

bool is_of(const RecordedTopic& topic, const char* type) {
  return topic.type == type && topic.messages > 0;
}

}  // namespace

Result<std::unique_ptr<McapSource>> McapSource::open(const std::string& path,
                                                     std::optional<StereoCameras> calibration,
                                                     int start, int frames) {
  auto recording = Recording::open(path);
  if (!recording) return recording.failure();
  std::unique_ptr<McapSource> source(new McapSource(std::move(*recording)));
  source->path_ = path;
  const RecordedTopic* topic = source->recording_->only_topic_of(kFrameType);
  if (topic == nullptr || topic->messages == 0) {
    return Error{path +
                 " has no stereo frames, or those of more than one camera; it needs one "
                 "topic of type " +
                 kFrameType};
  }
  if (calibration) {
    source->cameras_ = std::move(*calibration);
  } else if (auto found = source->find_calibration(); !found) {
    return found.failure();
  }
  const auto skipped = static_cast<std::size_t>(std::max(start, 0));
  const std::size_t there = topic->messages > skipped ? topic->messages - skipped : 0;
  source->size_ =
      frames > 0 ? std::min<std::size_t>(there, static_cast<std::size_t>(frames)) : there;
  source->recording_->seek(0, [](const RecordedTopic& t) { return is_of(t, kFrameType); });
  for (std::size_t i = 0; i < skipped && source->recording_->next(); ++i) continue;
  return source;
}

Result<void> McapSource::find_calibration() {
  recording_->seek(0, [](const RecordedTopic& t) { return is_of(t, kCalibrationType); });
  const auto recorded = recording_->next();
  if (!recorded) {
    return Error{path_ + " has no calibration: it needs a topic of type " +
                 std::string(kCalibrationType) + ", or give a file with --calib"};
  }
  const auto message = decode<msg::StereoCalibration>(recorded->data);
  if (!message) return message.failure();
  auto cameras = from_message(**message);
  if (!cameras) return Error{path_ + ": calibration refused: " + cameras.error()};
  cameras_ = std::move(*cameras);
  return {};
}

SourceResult McapSource::next(std::chrono::milliseconds) {
  if (given_ >= size_) return {SourceState::kEndOfStream, {}, {}};
  const auto recorded = recording_->next();
  if (!recorded) return {SourceState::kEndOfStream, {}, {}};
  ++given_;
  const std::string where = path_ + ": frame " + std::to_string(given_) + " is refused: ";
  const auto message = decode<msg::StereoFrame>(recorded->data);
  if (!message) return {SourceState::kBadFrame, {}, where + message.error()};
  auto frame = from_message(**message);
  if (!frame) return {SourceState::kBadFrame, {}, where + frame.error()};
  return {SourceState::kFrame, std::move(*frame), {}};
}

}  // namespace sovo::bridge
