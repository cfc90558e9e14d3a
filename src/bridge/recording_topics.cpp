#include "sovo/bridge/recording_topics.h"

#include <algorithm>

#include "sovo/bridge/offered_qos.h"

namespace sovo::bridge {
namespace {

std::size_t latched_depth(const TopicQos& qos) {
  return qos.latched ? static_cast<std::size_t>(std::max(qos.depth, 1)) : 0;
}

}  // namespace

RecordingTopic recording_topic(const std::string& ros_name, const MessageSchema& schema,
                               const TopicQos& qos) {
  return {ros_name,         schema.ros_name,       schema.definition,
          schema.type_hash, offered_qos_text(qos), latched_depth(qos)};
}

RecordingTopic recording_topic(const RecordedTopic& topic) {
  const TopicQos qos = parse_offered_qos(topic.offered_qos, reliable(10));
  return {topic.topic,     topic.type,        topic.definition,
          topic.type_hash, topic.offered_qos, latched_depth(qos)};
}

}  // namespace sovo::bridge
