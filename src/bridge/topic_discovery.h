#pragma once

#include <string>
#include <vector>

#include "sovo/bridge/participant.h"
#include "sovo/bridge/topic_qos.h"

namespace sovo::bridge {

/// A topic that others write or read.
struct DiscoveredTopic {
  std::string name;  ///< As ROS has it, "/sovo/odom"; topics that are none of ROS's as on the wire.
  std::string type;  ///< "nav_msgs/msg/Odometry"; other types as on the wire.
  std::string dds_type;  ///< As on the wire.
  int writers = 0;
  int readers = 0;
  TopicQos qos;  ///< That a reader needs to hear all of the writers.
};

/// What discovery has heard of other participants so far.
class TopicDiscovery {
 public:
  static Result<TopicDiscovery> open(const Participant& participant);

  /// All topics that have a writer or a reader now, by name; those of this participant are left
  /// out. A new participant needs a moment to hear of the others.
  Result<std::vector<DiscoveredTopic>> topics() const;

 private:
  TopicDiscovery(DdsHandle writers, DdsHandle readers, const dds_guid_t& self)
      : writers_(std::move(writers)), readers_(std::move(readers)), self_(self) {}

  DdsHandle writers_;
  DdsHandle readers_;
  dds_guid_t self_;
};

}  // namespace sovo::bridge
