#pragma once

#include <string>
#include <vector>

#include "sovo/bridge/endpoint.h"

namespace sovo::bridge {

/// A message type as others can understand it without this program.
struct MessageSchema {
  std::string ros_name;    ///< "nav_msgs/msg/Odometry"
  std::string dds_name;    ///< "nav_msgs::msg::dds_::Odometry_"
  std::string type_hash;   ///< RIHS01 text, or empty when unknown.
  std::string definition;  ///< .msg text with those of all types in it (encoding "ros2msg").
};

/// All types that this program knows.
const std::vector<MessageSchema>& message_schemas();

/// The known type of a ROS or DDS name; null for others.
const MessageSchema* find_schema(const std::string& ros_or_dds_name);

/// What an endpoint needs to pass this type on as bytes.
TypeInfo raw_type(const MessageSchema& schema);

}  // namespace sovo::bridge
