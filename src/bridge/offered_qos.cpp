#include "sovo/bridge/offered_qos.h"

#include <algorithm>
#include <optional>

#include "sovo/io/text.h"

namespace sovo::bridge {
namespace {

// Numbers of the policies in ROS 2.
constexpr int kKeepLast = 1;
constexpr int kReliable = 1;
constexpr int kBestEffort = 2;
constexpr int kTransientLocal = 1;
constexpr int kVolatile = 2;

constexpr int kDeepest = 1000;

/// Value of the first line "key: value"; bags write policies as numbers (Humble) or words (Iron).
std::string value_of(const std::string& text, const std::string& key) {
  for (std::string_view line : split_lines(text)) {
    line = trim(line);
    if (line.starts_with("- ")) line = trim(line.substr(2));
    if (line.starts_with(key + ":")) return std::string(trim(line.substr(key.size() + 1)));
  }
  return {};
}

}  // namespace

std::string offered_qos_text(const TopicQos& qos) {
  const std::string infinite = "\n    sec: 9223372036\n    nsec: 854775807\n";
  return "- history: " + std::to_string(kKeepLast) + "\n  depth: " + std::to_string(qos.depth) +
         "\n  reliability: " + std::to_string(qos.best_effort ? kBestEffort : kReliable) +
         "\n  durability: " + std::to_string(qos.latched ? kTransientLocal : kVolatile) +
         "\n  deadline:" + infinite + "  lifespan:" + infinite +
         "  liveliness: 1\n  liveliness_lease_duration:" + infinite +
         "  avoid_ros_namespace_conventions: false\n";
}

TopicQos parse_offered_qos(const std::string& text, const TopicQos& fallback) {
  TopicQos qos = fallback;
  const std::string reliability = value_of(text, "reliability");
  const std::string durability = value_of(text, "durability");
  if (!reliability.empty()) qos.best_effort = reliability == "2" || reliability == "best_effort";
  if (!durability.empty()) qos.latched = durability == "1" || durability == "transient_local";
  const auto depth = parse_integer(value_of(text, "depth"));
  if (depth && *depth > 0) qos.depth = static_cast<int>(std::min<std::int64_t>(*depth, kDeepest));
  return qos;
}

}  // namespace sovo::bridge
