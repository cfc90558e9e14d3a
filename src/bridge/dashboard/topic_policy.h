#pragma once

#include <optional>
#include <string>

#include "sovo/bridge/dashboard/client_queue.h"

namespace sovo::bridge {

/// The ROS name of a topic on the wire: "rt/sovo/odom" is "/sovo/odom"; nothing for what is no ROS
/// topic.
std::optional<std::string> ros_name_of(const std::string& dds_topic);

/// Whether the dashboard passes such a topic on: not stereo frames and images, and of compressed
/// ones the previews only.
bool is_forwarded(const std::string& ros_topic, const std::string& ros_type);

Importance importance_of(const std::string& ros_type);

/// How many messages a late subscriber gets of a latched topic.
int latched_depth_of(const std::string& ros_topic);

/// Whether clients that may give commands may publish this type there.
bool is_command(const std::string& ros_topic, const std::string& ros_type);

}  // namespace sovo::bridge
