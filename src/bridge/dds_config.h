#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sovo/io/result.h"

namespace sovo::bridge {

/// Whether ROS 2 tools see this process as a node: the layout of its graph message changed between
/// Humble and Iron, under one type name.
enum class RosGraph { kOff, kHumble, kIronPlus };

constexpr std::array<std::pair<RosGraph, const char*>, 3> enum_names(RosGraph) {
  return {{{RosGraph::kOff, "off"}, {RosGraph::kHumble, "humble"}, {RosGraph::kIronPlus, "iron+"}}};
}

/// How samples go from process to process on one machine.
enum class Transport {
  kUdp,
  kShm,  ///< Shared memory of iceoryx, between camera and odometry.
};

constexpr std::array<std::pair<Transport, const char*>, 2> enum_names(Transport) {
  return {{{Transport::kUdp, "udp"}, {Transport::kShm, "shm"}}};
}

struct RosConfig {
  RosGraph graph = RosGraph::kOff;

  template <class Visitor>
  void visit(Visitor& v) {
    v("graph", graph, "show this process in ROS 2's node list: off, humble or iron+");
  }
};

/// Where on the network a process speaks, and under which names.
struct DdsConfig {
  int domain = -1;             ///< Negative: ROS_DOMAIN_ID, else 0.
  std::string network = "lo";  ///< "lo", an interface or one of this machine's addresses.
  std::string ns = "sovo";     ///< Namespace of topics; another than "sovo" prefixes frames too.
  bool accept_commands = false;
  std::string security;  ///< Folder with the keys of DDS Security; empty: none.
  Transport transport = Transport::kUdp;
  RosConfig ros;

  template <class Visitor>
  void visit(Visitor& v) {
    v("domain", domain, "DDS domain; negative: ROS_DOMAIN_ID, else 0");
    v("network", network, "lo, an interface or an address of this machine");
    v("ns", ns, "namespace of topics; another than sovo prefixes frame names too");
    v("accept_commands", accept_commands, "obey commands that come over a network");
    v("security", security, "folder with the keys of DDS Security (config/security); empty: none");
    v("transport", transport, "udp, or shm: shared memory from camera to vo, needs iox-roudi");
    v("ros", ros, "what ROS 2 tools see");
  }
};

/// The environment variables that decide about DDS; unset or empty ones are nothing.
struct DdsEnvironment {
  std::optional<std::string> ros_domain_id;
  std::optional<std::string> ros_localhost_only;
  std::optional<std::string> ros_automatic_discovery_range;
  std::optional<std::string> cyclonedds_uri;

  static DdsEnvironment current();
};

/// What to configure Cyclone DDS with.
struct NetworkPlan {
  std::uint32_t domain = 0;
  std::string xml;                 ///< Configuration for dds_create_domain.
  bool loopback_only = false;      ///< Nothing can come from another machine.
  bool secured = false;            ///< Nothing can come from those who have no key.
  std::vector<std::string> notes;  ///< For the log at start: where it speaks, how to change that.
};

/// Joins configuration, environment and the tuned settings of config/cyclonedds.xml. With
/// CYCLONEDDS_URI no interface is added, and its values win.
Result<NetworkPlan> plan_network(const DdsConfig& config, const DdsEnvironment& environment);

}  // namespace sovo::bridge
