#include "sovo/bridge/recorded_calibration.h"

#include "sovo/bridge/calibration_conversion.h"
#include "sovo/bridge/camera_info_conversion.h"
#include "sovo/bridge/cdr_codec.h"
#include "sovo/bridge/topics.h"

namespace sovo::bridge {
namespace {

constexpr char kOrFile[] = "; --calib gives a file instead";

Result<CameraInfoCopy> read_info(Recording& recording, const std::string& image_topic) {
  const std::string name = info_topic(image_topic);
  recording.seek(0, [&name](const RecordedTopic& topic) {
    return topic.topic == name && topic.type == MessageTraits<msg::CameraInfo>::kRosName;
  });
  const auto recorded = recording.next();
  if (!recorded) return Error{"no camera_info on " + name + kOrFile};
  const auto message = decode<msg::CameraInfo>(recorded->data);
  if (!message) return Error{name + ": " + message.error()};
  return copy(**message);
}

}  // namespace

std::optional<std::string> calibration_of(const Recording& recording,
                                          const std::string& image_topic) {
  const std::string end = std::string("/") + topics::kCalibration;
  for (const auto& [name, topic] : recording.topics()) {
    if (topic.type != MessageTraits<msg::StereoCalibration>::kRosName || topic.messages == 0 ||
        !name.ends_with(end)) {
      continue;
    }
    if (image_topic.starts_with(name.substr(0, name.size() - end.size() + 1))) return name;
  }
  return std::nullopt;
}

Result<StereoCameras> read_stereo_calibration(Recording& recording, const std::string& topic) {
  const std::string type = MessageTraits<msg::StereoCalibration>::kRosName;
  recording.seek(0, [&](const RecordedTopic& t) {
    return t.type == type && t.messages > 0 && (topic.empty() || t.topic == topic);
  });
  const auto recorded = recording.next();
  if (!recorded) {
    return Error{"no calibration: it needs a topic of type " + type + kOrFile};
  }
  const auto message = decode<msg::StereoCalibration>(recorded->data);
  if (!message) return message.failure();
  auto cameras = from_message(**message);
  if (!cameras) return Error{"calibration refused: " + cameras.error()};
  return cameras;
}

Result<StereoCameras> read_image_calibration(Recording& recording, const ImageTopics& topics) {
  const auto own = calibration_of(recording, topics.left);
  if (own && !is_rectified(topics.left)) return read_stereo_calibration(recording, *own);
  const auto left = read_info(recording, topics.left);
  if (!left) return left.failure();
  const auto right = read_info(recording, topics.right);
  if (!right) return right.failure();
  auto cameras = cameras_from(*left, *right, topics.rectified());
  if (!cameras) return Error{"camera_info cannot be used: " + cameras.error() + kOrFile};
  return cameras;
}

}  // namespace sovo::bridge
