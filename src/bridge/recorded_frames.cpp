#include "sovo/bridge/recorded_frames.h"

#include <optional>
#include <utility>

#include "sovo/bridge/cdr_codec.h"
#include "sovo/bridge/image_pairer.h"
#include "sovo/bridge/recorded_calibration.h"
#include "sovo/bridge/stereo_frame_conversion.h"

namespace sovo::bridge {
namespace {

class FramesOfStereoTopic : public RecordedFrames {
 public:
  FramesOfStereoTopic(Recording& recording, const RecordedTopic& topic)
      : recording_(recording), topic_(topic) {}

  std::string about() const override { return topic_.topic; }
  std::size_t size() const override { return topic_.messages; }
  Result<StereoCameras> calibration() override { return read_stereo_calibration(recording_); }

  void rewind() override {
    recording_.seek(0, [this](const RecordedTopic& t) { return t.topic == topic_.topic; });
    read_ = 0;
  }

  SourceResult next() override {
    const auto recorded = recording_.next();
    if (!recorded) return {SourceState::kEndOfStream, {}, {}};
    const std::string where = "frame " + std::to_string(++read_) + " is refused: ";
    const auto message = decode<msg::StereoFrame>(recorded->data);
    if (!message) return {SourceState::kBadFrame, {}, where + message.error()};
    auto frame = from_message(**message);
    if (!frame) return {SourceState::kBadFrame, {}, where + frame.error()};
    return {SourceState::kFrame, std::move(*frame), {}};
  }

 private:
  Recording& recording_;
  const RecordedTopic& topic_;
  std::size_t read_ = 0;
};

class FramesOfImageTopics : public RecordedFrames {
 public:
  FramesOfImageTopics(Recording& recording, ImageTopics topics, double tolerance_s)
      : recording_(recording), topics_(std::move(topics)), tolerance_s_(tolerance_s) {}

  std::string about() const override { return topics_.left + " and " + topics_.right; }
  std::size_t size() const override { return recording_.find(topics_.left)->messages; }
  Result<StereoCameras> calibration() override {
    return read_image_calibration(recording_, topics_);
  }

  void rewind() override {
    pairer_.emplace(topics_, tolerance_s_);
    recording_.seek(0, [this](const RecordedTopic& t) {
      return t.topic == topics_.left || t.topic == topics_.right;
    });
  }

  SourceResult next() override {
    for (bool ended = false;;) {
      if (auto result = pairer_->next()) return std::move(*result);
      if (ended) return {SourceState::kEndOfStream, {}, {}};
      const auto recorded = recording_.next();
      ended = !recorded;
      recorded ? pairer_->add(*recorded) : pairer_->end();
    }
  }

 private:
  Recording& recording_;
  ImageTopics topics_;
  double tolerance_s_;
  std::optional<ImagePairer> pairer_;
};

}  // namespace

Result<std::unique_ptr<RecordedFrames>> RecordedFrames::open(Recording& recording,
                                                             const RecordedFramesConfig& config) {
  const std::string type = MessageTraits<msg::StereoFrame>::kRosName;
  const RecordedTopic* topic = recording.only_topic_of(type);
  if (topic != nullptr && topic->messages > 0 && config.left.empty()) {
    return std::unique_ptr<RecordedFrames>(new FramesOfStereoTopic(recording, *topic));
  }
  auto images = find_image_topics(recording, config.left, config.right);
  if (!images) {
    if (!config.left.empty()) return images.failure();
    return Error{"no stereo frames, or those of more than one camera: one topic of type " + type +
                 " would do; and " + images.error()};
  }
  return std::unique_ptr<RecordedFrames>(
      new FramesOfImageTopics(recording, std::move(*images), config.pair_tolerance_s));
}

}  // namespace sovo::bridge
