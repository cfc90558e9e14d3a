#include "sovo/bridge/dds_config.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>

#include "cyclonedds_settings.h"

namespace sovo::bridge {
namespace {

constexpr std::uint32_t kLargestDomain = 232;  // beyond, the port numbers of RTPS run out

std::optional<std::string> variable(const char* name) {
  const char* value = std::getenv(name);
  if (value == nullptr || *value == '\0') return std::nullopt;
  return std::string(value);
}

Result<std::uint32_t> domain_id(const DdsConfig& config, const DdsEnvironment& environment) {
  const std::string range = "a DDS domain is a number from 0 to " + std::to_string(kLargestDomain);
  if (config.domain >= 0) {
    const auto domain = static_cast<std::uint32_t>(config.domain);
    if (domain > kLargestDomain) return Error{"domain " + std::to_string(domain) + ": " + range};
    return domain;
  }
  if (!environment.ros_domain_id) return 0U;
  const std::string& text = *environment.ros_domain_id;
  std::uint32_t domain = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), domain);
  if (code != std::errc() || end != text.data() + text.size() || domain > kLargestDomain) {
    return Error{"ROS_DOMAIN_ID is '" + text + "': " + range};
  }
  return domain;
}

bool is_interface_or_address(const std::string& text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '.' || c == ':' || c == '-' || c == '_' || c == '@';
  });
}

bool is_address(const std::string& text) {
  if (text.find(':') != std::string::npos) return true;
  return std::count(text.begin(), text.end(), '.') == 3 &&
         text.find_first_not_of("0123456789.") == std::string::npos;
}

std::string domain_xml(const std::string& content) {
  return "<CycloneDDS><Domain Id=\"any\">" + content + "</Domain></CycloneDDS>";
}

std::string interface_xml(const std::string& attributes) {
  return domain_xml("<General><Interfaces><NetworkInterface " + attributes +
                    "/></Interfaces></General>");
}

/// Loopback has no multicast flag on Linux, yet carries multicast.
void keep_on_loopback(NetworkPlan* plan) {
  plan->xml += "," + interface_xml("name=\"lo\" multicast=\"true\"");
  plan->loopback_only = true;
}

void add_interfaces(const std::string& network, NetworkPlan* plan) {
  const std::string domain = "domain " + std::to_string(plan->domain);
  if (network == "lo") {
    keep_on_loopback(plan);
    plan->notes.push_back("DDS stays on this machine (network: lo, " + domain +
                          "); --network INTERFACE opens it to others");
    return;
  }
  const bool address = is_address(network);
  plan->xml += "," + interface_xml((address ? "address=\"" : "name=\"") + network + "\"");
  plan->loopback_only = network.starts_with("127.") || network == "::1";
  plan->notes.push_back("DDS speaks on " + network + " (" + domain + ")");
}

/// What ROS 2 (Iron and later) makes of ROS_AUTOMATIC_DISCOVERY_RANGE. False: the variable asks
/// for nothing special.
bool add_discovery_range(const std::string& range, NetworkPlan* plan) {
  const std::string quiet = "<General><AllowMulticast>false</AllowMulticast></General>";
  if (range == "LOCALHOST") {
    plan->xml += "," + domain_xml(quiet +
                                  "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
                                  "<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
                                  "<Peers><Peer address=\"localhost\"/></Peers></Discovery>");
  } else if (range == "OFF") {
    plan->xml += "," + domain_xml(quiet +
                                  "<Discovery><ParticipantIndex>none</ParticipantIndex>"
                                  "<Tag>ros_discovery_off</Tag></Discovery>");
  } else {
    return false;
  }
  plan->notes.push_back("DDS discovery as ROS_AUTOMATIC_DISCOVERY_RANGE=" + range +
                        " says (domain " + std::to_string(plan->domain) + ")");
  return true;
}

}  // namespace

DdsEnvironment DdsEnvironment::current() {
  return {variable("ROS_DOMAIN_ID"), variable("ROS_LOCALHOST_ONLY"),
          variable("ROS_AUTOMATIC_DISCOVERY_RANGE"), variable("CYCLONEDDS_URI")};
}

Result<NetworkPlan> plan_network(const DdsConfig& config, const DdsEnvironment& environment) {
  const auto domain = domain_id(config, environment);
  if (!domain) return domain.failure();
  if (!is_interface_or_address(config.network)) {
    return Error{"network is '" + config.network +
                 "': give lo, the name of an interface or one of this machine's addresses"};
  }
  NetworkPlan plan;
  plan.domain = *domain;
  plan.xml = kTunedCycloneDdsXml;
  if (environment.cyclonedds_uri) {
    plan.xml += "," + *environment.cyclonedds_uri;
    plan.notes.push_back("DDS is configured by CYCLONEDDS_URI (domain " +
                         std::to_string(plan.domain) + "); network: " + config.network +
                         " is not used");
  } else if (environment.ros_localhost_only == "1") {
    keep_on_loopback(&plan);
    plan.notes.push_back("DDS stays on this machine because ROS_LOCALHOST_ONLY is 1 (domain " +
                         std::to_string(plan.domain) + ")");
  } else if (!environment.ros_automatic_discovery_range ||
             !add_discovery_range(*environment.ros_automatic_discovery_range, &plan)) {
    add_interfaces(config.network, &plan);
  }
  return plan;
}

}  // namespace sovo::bridge
