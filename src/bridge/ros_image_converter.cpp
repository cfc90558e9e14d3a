#include "sovo/bridge/ros_image_converter.h"

#include <algorithm>
#include <utility>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/calibration_conversion.h"
#include "sovo/bridge/cdr_codec.h"
#include "sovo/bridge/recording_topics.h"
#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/stereo_frame_conversion.h"
#include "sovo/bridge/topics.h"
#include "sovo/geometry/radtan_fit.h"

namespace sovo::bridge {
namespace {

constexpr double kLeastBaseline = 1e-6;  // [m]

template <class T>
RecordingTopic ros_view(const std::string& name) {
  return recording_topic(name, *find_schema(MessageTraits<T>::kRosName), topics::kImageQos);
}

msg::Image image_of(const msg::SideImage& side, const msg::Header& header) {
  msg::Image m{};
  m.header = header;
  m.height = side.height;
  m.width = side.width;
  m.encoding = side.encoding;
  m.step = side.step;
  m.data = side.data;
  return m;
}

}  // namespace

std::string right_frame_of(std::string left_frame) {
  const std::string left = "left";
  const auto at = left_frame.rfind(left);
  return at == std::string::npos ? left_frame : left_frame.replace(at, left.size(), "right");
}

RosImageConverter::RosImageConverter(const std::string& stereo_topic)
    : stereo_topic_(stereo_topic) {
  const std::string folder = stereo_topic.substr(0, stereo_topic.rfind('/') + 1);
  for (const bool is_left : {true, false}) {
    const std::string camera = folder + (is_left ? "left/" : "right/");
    Side& side = sides_[is_left ? 0 : 1];
    side.image = ros_view<msg::Image>(camera + topics::kImageRaw);
    side.info = ros_view<msg::CameraInfo>(camera + topics::kCameraInfo);
  }
}

bool RosImageConverter::makes(const std::string& topic) const {
  return std::any_of(sides_.begin(), sides_.end(), [&topic](const Side& side) {
    return side.image.topic == topic || side.info.topic == topic;
  });
}

Result<void> RosImageConverter::take_calibration(ByteSpan bytes) {
  const auto message = decode<msg::StereoCalibration>(bytes);
  if (!message) return message.failure();
  const auto cameras = from_message(**message);
  if (!cameras) return cameras.failure();
  if (cameras->rig.baseline() < kLeastBaseline) return Error{"the calibration has no baseline"};
  const StereoRig rig = without_ports(cameras->rig);
  const StereoRectification rectification = rectify(rig);
  const std::string left_frame = short_text((*message)->header.frame_id);
  for (const bool is_left : {true, false}) {
    sides_[is_left ? 0 : 1].info_message.emplace(rig, rectification, is_left,
                                                 is_left ? left_frame : right_frame_of(left_frame));
  }
  return {};
}

Result<std::vector<RosImageConverter::Message>> RosImageConverter::convert(ByteSpan bytes) const {
  const auto frame = decode<msg::StereoFrame>(bytes);
  if (!frame) return frame.failure();
  const std::string left_frame = text_or_empty((*frame)->header.frame_id);
  const std::string right_frame = right_frame_of(left_frame);
  std::vector<Message> messages;
  for (const bool is_left : {true, false}) {
    const msg::SideImage& image = is_left ? (*frame)->left : (*frame)->right;
    if (!image.valid) continue;
    const Side& side = sides_[is_left ? 0 : 1];
    const msg::Header header = {(*frame)->header.stamp, borrow(is_left ? left_frame : right_frame)};
    messages.push_back({&side.image, encode(image_of(image, header))});
    if (!side.info_message) continue;
    messages.push_back({&side.info, encode(side.info_message->at(stamp_ns(header.stamp)))});
  }
  return messages;
}

}  // namespace sovo::bridge
