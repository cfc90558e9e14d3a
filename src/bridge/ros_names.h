#pragma once

#include <string>

namespace sovo::bridge {

/// Full ROS name of a topic: "/ns/name", or `name` itself when it begins with a slash.
inline std::string ros_topic(const std::string& ns, const std::string& name) {
  if (name.starts_with('/')) return name;
  std::string result = "/";
  if (!ns.empty() && ns != "/") result = (ns.starts_with('/') ? ns : "/" + ns) + "/";
  return result + name;
}

/// Name of a ROS topic on the wire.
inline std::string dds_topic(const std::string& ros_name) { return "rt" + ros_name; }

/// ROS name of a topic on the wire; one that is none of ROS's stays as it is.
inline std::string ros_name_of_topic(const std::string& wire_name) {
  return wire_name.starts_with("rt/") ? wire_name.substr(2) : wire_name;
}

/// "pkg/msg/Name" of "pkg::msg::dds_::Name_"; another name stays as it is.
inline std::string ros_name_of_type(const std::string& wire_name) {
  const std::string middle = "::msg::dds_::";
  const auto at = wire_name.find(middle);
  if (at == std::string::npos || !wire_name.ends_with('_')) return wire_name;
  const std::string name = wire_name.substr(at + middle.size());
  return wire_name.substr(0, at) + "/msg/" + name.substr(0, name.size() - 1);
}

/// Name of a coordinate frame: prefixed by a namespace other than the default one.
inline std::string frame_name(const std::string& ns, const std::string& frame) {
  const std::string plain = ns.starts_with('/') ? ns.substr(1) : ns;
  return plain.empty() || plain == "sovo" ? frame : plain + "/" + frame;
}

/// "pkg::msg::dds_::Name_" of "pkg/msg/Name".
inline std::string dds_type(const std::string& ros_type) {
  const auto first = ros_type.find('/');
  const auto last = ros_type.rfind('/');
  return ros_type.substr(0, first) + "::msg::dds_::" + ros_type.substr(last + 1) + "_";
}

}  // namespace sovo::bridge
