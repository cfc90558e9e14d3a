#include "sovo/bridge/stereo_recording.h"

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/calibration_conversion.h"
#include "sovo/bridge/cdr_codec.h"
#include "sovo/bridge/recording_topics.h"
#include "sovo/bridge/ros_names.h"
#include "sovo/bridge/stereo_frame_conversion.h"
#include "sovo/bridge/topics.h"
#include "sovo/io/calibration.h"

namespace sovo::bridge {
namespace {

template <class T>
RecordingTopic own_topic(const std::string& ns, const char* name, const TopicQos& qos) {
  return recording_topic(ros_topic(ns, name), *find_schema(MessageTraits<T>::kRosName), qos);
}

}  // namespace

StereoRecording::StereoRecording(RecordingWriter& writer, const std::string& ns, bool ros_images)
    : writer_(writer),
      ns_(ns),
      stereo_(own_topic<msg::StereoFrame>(ns, topics::kStereo, topics::kStereoQos)),
      calibration_(
          own_topic<msg::StereoCalibration>(ns, topics::kCalibration, topics::kCalibrationQos)) {
  if (ros_images) converter_ = std::make_unique<RosImageConverter>(stereo_.topic);
}

Result<void> StereoRecording::begin(const StereoCameras& cameras, std::uint64_t log_ns) {
  const std::string camera = cameras.rig.name.empty() ? "cam" : cameras.rig.name;
  left_frame_ = frame_name(ns_, camera + "_left_camera_optical_frame");
  const CalibrationMessage message(cameras, left_frame_, static_cast<std::int64_t>(log_ns));
  const Bytes bytes = encode(message.message());
  if (converter_) {
    if (auto taken = converter_->take_calibration(bytes); !taken) return taken;
  }
  const std::string text = format_sovo_calibration(cameras.rig);
  auto done = writer_.attach("calibration.yaml", "application/yaml", log_ns,
                             Bytes(text.begin(), text.end()));
  if (!done) return done;
  return writer_.write(writer_.topic_number(calibration_), log_ns, log_ns, bytes);
}

Result<void> StereoRecording::write(const StereoFrame& frame, std::uint64_t log_ns) {
  msg::StereoFrame message = to_message(frame);
  if (frame.frame_id.empty()) message.header.frame_id = borrow(left_frame_);
  const Bytes bytes = encode(message);
  const auto stamp = static_cast<std::uint64_t>(frame.stamp_ns);
  if (!converter_) return writer_.write(writer_.topic_number(stereo_), log_ns, stamp, bytes);
  const auto parts = converter_->convert(bytes);
  if (!parts) return parts.failure();
  for (const auto& part : *parts) {
    auto done = writer_.write(writer_.topic_number(*part.topic), log_ns, stamp, part.data);
    if (!done) return done;
  }
  return {};
}

}  // namespace sovo::bridge
