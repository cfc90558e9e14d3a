#include "sovo/bridge/topic_discovery.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <map>
#include <tuple>

#include "sovo/bridge/ros_names.h"

namespace sovo::bridge {
namespace {

constexpr std::size_t kMostEndpoints = 4096;

/// Calls f for every endpoint that a reader of a built-in topic knows to be alive.
Result<void> for_each_endpoint(dds_entity_t reader,
                               const std::function<void(const dds_builtintopic_endpoint_t&)>& f) {
  std::vector<void*> samples(kMostEndpoints, nullptr);
  std::vector<dds_sample_info_t> infos(kMostEndpoints);
  const dds_return_t count =
      dds_read_mask(reader, samples.data(), infos.data(), kMostEndpoints, kMostEndpoints,
                    DDS_ANY_SAMPLE_STATE | DDS_ANY_VIEW_STATE | DDS_ALIVE_INSTANCE_STATE);
  if (count < 0) return dds_error("cannot read what discovery heard", count);
  for (dds_return_t i = 0; i < count; ++i) {
    const auto index = static_cast<std::size_t>(i);
    if (!infos[index].valid_data) continue;
    f(*static_cast<const dds_builtintopic_endpoint_t*>(samples[index]));
  }
  if (count > 0) dds_return_loan(reader, samples.data(), count);
  return {};
}

/// QoS of a reader that hears this writer.
TopicQos qos_of(const dds_builtintopic_endpoint_t& writer) {
  TopicQos qos;
  dds_reliability_kind_t reliability = DDS_RELIABILITY_BEST_EFFORT;
  dds_duration_t blocking = 0;
  dds_qget_reliability(writer.qos, &reliability, &blocking);
  qos.best_effort = reliability == DDS_RELIABILITY_BEST_EFFORT;
  dds_durability_kind_t durability = DDS_DURABILITY_VOLATILE;
  dds_qget_durability(writer.qos, &durability);
  qos.latched = durability != DDS_DURABILITY_VOLATILE;
  dds_history_kind_t history = DDS_HISTORY_KEEP_LAST;
  std::int32_t depth = 1;
  dds_qget_history(writer.qos, &history, &depth);
  qos.depth = std::clamp(depth, 10, 1000);
  return qos;
}

bool is_of(const dds_guid_t& participant, const dds_builtintopic_endpoint_t& endpoint) {
  return std::memcmp(endpoint.participant_key.v, participant.v, sizeof(participant.v)) == 0;
}

}  // namespace

Result<TopicDiscovery> TopicDiscovery::open(const Participant& participant) {
  const std::string what = "cannot listen to discovery";
  auto writers = take_entity(
      dds_create_reader(participant.entity(), DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr),
      what);
  if (!writers) return writers.failure();
  auto readers = take_entity(
      dds_create_reader(participant.entity(), DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION, nullptr, nullptr),
      what);
  if (!readers) return readers.failure();
  dds_guid_t self{};
  if (const auto code = dds_get_guid(participant.entity(), &self); code != DDS_RETCODE_OK) {
    return dds_error(what, code);
  }
  return TopicDiscovery(std::move(*writers), std::move(*readers), self);
}

Result<std::vector<DiscoveredTopic>> TopicDiscovery::topics() const {
  std::map<std::pair<std::string, std::string>, DiscoveredTopic> found;
  const auto entry = [&](const dds_builtintopic_endpoint_t& endpoint) -> DiscoveredTopic& {
    DiscoveredTopic& topic = found[{endpoint.topic_name, endpoint.type_name}];
    topic.name = ros_name_of_topic(endpoint.topic_name);
    topic.dds_type = endpoint.type_name;
    topic.type = ros_name_of_type(endpoint.type_name);
    return topic;
  };
  auto done = for_each_endpoint(writers_.get(), [&](const dds_builtintopic_endpoint_t& endpoint) {
    if (is_of(self_, endpoint)) return;
    DiscoveredTopic& topic = entry(endpoint);
    const TopicQos qos = qos_of(endpoint);
    const bool first = topic.writers++ == 0;
    topic.qos.depth = first ? qos.depth : std::max(topic.qos.depth, qos.depth);
    topic.qos.best_effort = topic.qos.best_effort || qos.best_effort;
    topic.qos.latched = qos.latched && (first || topic.qos.latched);
  });
  if (!done) return done.failure();
  done = for_each_endpoint(readers_.get(), [&](const dds_builtintopic_endpoint_t& endpoint) {
    if (!is_of(self_, endpoint)) ++entry(endpoint).readers;
  });
  if (!done) return done.failure();
  std::vector<DiscoveredTopic> topics;
  topics.reserve(found.size());
  for (auto& [key, topic] : found) topics.push_back(std::move(topic));
  std::sort(topics.begin(), topics.end(), [](const DiscoveredTopic& a, const DiscoveredTopic& b) {
    return std::tie(a.name, a.type) < std::tie(b.name, b.type);
  });
  return topics;
}

}  // namespace sovo::bridge
