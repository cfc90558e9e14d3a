#include "sovo/bridge/camera_publisher.h"

#include <vector>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/stereo_frame_conversion.h"
#include "sovo/bridge/topics.h"

namespace sovo::bridge {
namespace {

/// Name of the camera in frame names: letters, digits and underscores.
std::string camera_name(const std::string& rig_name) {
  std::string name = rig_name.empty() ? "cam" : rig_name;
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  return name;
}

}  // namespace

Result<CameraPublisher> CameraPublisher::open(const Participant& participant,
                                              const StereoCameras& cameras, std::int64_t stamp_ns) {
  auto stereo = Writer<msg::StereoFrame>::open(participant, topics::kStereo, topics::kStereoQos);
  if (!stereo) return stereo.failure();
  auto calibration = Writer<msg::StereoCalibration>::open(participant, topics::kCalibration,
                                                          topics::kCalibrationQos);
  if (!calibration) return calibration.failure();
  auto tf_static =
      Writer<msg::TFMessage>::open(participant, topics::kTfStatic, topics::kTfStaticQos);
  if (!tf_static) return tf_static.failure();
  const std::string camera = camera_name(cameras.rig.name);
  const std::string left_frame = participant.frame(camera + "_left_camera_optical_frame");
  auto views = CameraViews::open(participant, cameras, left_frame,
                                 participant.frame(camera + "_right_camera_optical_frame"));
  if (!views) return views.failure();
  CameraPublisher publisher(std::move(*stereo), std::move(*calibration), std::move(*tf_static),
                            std::move(*views), left_frame);
  const auto done = publisher.publish_static(participant, cameras, stamp_ns);
  if (!done) return done.failure();
  return publisher;
}

Result<void> CameraPublisher::publish_static(const Participant& participant,
                                             const StereoCameras& cameras, std::int64_t stamp_ns) {
  const std::string camera = camera_name(cameras.rig.name);
  const CalibrationMessage calibration(cameras, left_frame_, stamp_ns);
  auto done = calibration_.write(calibration.message());
  if (!done) return done;

  // The link frame has its origin in the left camera and the axes of a body.
  const std::string base = participant.frame("base_link");
  const std::string link = participant.frame(camera + "_link");
  const std::string right = participant.frame(camera + "_right_camera_optical_frame");
  const SE3 T_link_left = body_from_optical();
  const SE3 T_base_link = cameras.rig.T_base_left * T_link_left.inverse();
  const SE3 T_link_right = T_link_left * cameras.rig.T_right_left.inverse();
  const msg::Time stamp = to_message(stamp_ns);
  const std::vector<msg::TransformStamped> transforms = {
      {{stamp, borrow(base)}, borrow(link), to_transform(T_base_link)},
      {{stamp, borrow(link)}, borrow(left_frame_), to_transform(T_link_left)},
      {{stamp, borrow(link)}, borrow(right), to_transform(T_link_right)},
  };
  msg::TFMessage message{};
  borrow(message.transforms, transforms);
  return tf_static_.write(message);
}

Result<void> CameraPublisher::publish(const StereoFrame& frame, const StereoColour& colour) {
  msg::StereoFrame message = to_message(frame);
  if (frame.frame_id.empty()) message.header.frame_id = borrow(left_frame_);
  auto written = stereo_.write(message);
  views_->offer(frame, colour);
  return written;
}

}  // namespace sovo::bridge
