#include "sovo/bridge/dashboard/topic_policy.h"

#include <map>

#include "sovo/bridge/topics.h"

namespace sovo::bridge {
namespace {

/// "/auv1/left/camera_info" -> "left/camera_info"
std::string below_namespace(const std::string& ros_topic) {
  const auto slash = ros_topic.find('/', 1);
  return slash == std::string::npos ? "" : ros_topic.substr(slash + 1);
}

}  // namespace

std::optional<std::string> ros_name_of(const std::string& dds_topic) {
  if (!dds_topic.starts_with("rt/")) return std::nullopt;
  return dds_topic.substr(2);
}

bool is_forwarded(const std::string& ros_topic, const std::string& ros_type) {
  if (ros_type == "sovo_msgs/msg/StereoFrame" || ros_type == "sensor_msgs/msg/Image") return false;
  if (ros_type == "rmw_dds_common/msg/ParticipantEntitiesInfo") return false;
  if (ros_type != "sensor_msgs/msg/CompressedImage") return true;
  return ros_topic.find("/preview") != std::string::npos;
}

Importance importance_of(const std::string& ros_type) {
  static const std::map<std::string, Importance> others = {
      {"sensor_msgs/msg/CompressedImage", Importance::kImage},
      {"sensor_msgs/msg/PointCloud2", Importance::kCloud},
      {"sovo_msgs/msg/TrackedPoints", Importance::kCloud},
      {"sovo_msgs/msg/Keyframe", Importance::kCloud},
      {"nav_msgs/msg/Path", Importance::kCloud},
      {"nav_msgs/msg/Odometry", Importance::kPose},
      {"sovo_msgs/msg/ScaledOdometry", Importance::kPose},
      {"sovo_msgs/msg/VoStatus", Importance::kPose},
      {"tf2_msgs/msg/TFMessage", Importance::kPose}};
  const auto found = others.find(ros_type);
  return found == others.end() ? Importance::kState : found->second;
}

int latched_depth_of(const std::string& ros_topic) {
  if (below_namespace(ros_topic) == topics::kKeyframe) return topics::kKeyframeQos.depth;
  // Global topics have a writer a camera.
  return below_namespace(ros_topic).empty() ? 16 : 1;
}

bool is_command(const std::string& ros_topic, const std::string& ros_type) {
  const std::string name = below_namespace(ros_topic);
  return (name == topics::kCommand && ros_type == "sovo_msgs/msg/VoCommand") ||
         (name == "record_command" && ros_type == "sovo_msgs/msg/RecorderCommand");
}

}  // namespace sovo::bridge
