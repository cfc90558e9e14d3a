#pragma once

#include <string>

#include "sovo/bridge/dds_handle.h"

namespace sovo::bridge {

/// Quality of service of a topic: keep-last, reliable unless it says otherwise.
struct TopicQos {
  int depth = 10;
  bool latched = false;      ///< Transient-local: late readers get the last `depth` samples.
  bool best_effort = false;  ///< As a reader: also takes from writers that do not repeat.
};

constexpr TopicQos reliable(int depth) { return {depth, false, false}; }
constexpr TopicQos latched(int depth) { return {depth, true, false}; }

/// QoS of a reader. `type_hash`: RIHS01 text for USER_DATA, which ROS 2 complains without.
QosPtr reader_qos(const TopicQos& qos, const std::string& type_hash);

/// QoS of a writer: as a reader's, without dispose at its end, and with a durability service for
/// latched topics, as ROS 2 has them.
QosPtr writer_qos(const TopicQos& qos, const std::string& type_hash);

}  // namespace sovo::bridge
