#include "sovo/bridge/ros_graph.h"

#include <algorithm>
#include <cstring>
#include <type_traits>
#include <vector>

#include "message_traits.h"
#include "sovo/bridge/borrow.h"
#include "sovo/bridge/topic_qos.h"

namespace sovo::bridge {
namespace {

constexpr std::size_t kGuidSize = sizeof(dds_guid_t);

std::vector<dds_entity_t> children(dds_entity_t parent) {
  const dds_return_t count = dds_get_children(parent, nullptr, 0);
  std::vector<dds_entity_t> result(static_cast<std::size_t>(std::max(count, 0)));
  const dds_return_t got = dds_get_children(parent, result.data(), result.size());
  result.resize(std::min(result.size(), static_cast<std::size_t>(std::max(got, 0))));
  return result;
}

/// Humble's gid is 24 bytes, the last 8 zero.
template <class Gid>
Gid gid_of(dds_entity_t entity) {
  Gid gid{};
  dds_guid_t guid{};
  dds_get_guid(entity, &guid);
  std::memcpy(gid.data, guid.v, kGuidSize);
  return gid;
}

template <class Gid>
struct Endpoints {
  std::vector<Gid> readers;
  std::vector<Gid> writers;
};

/// Readers and writers hang below implicit subscribers and publishers.
template <class Gid>
Endpoints<Gid> endpoints(dds_entity_t participant, dds_entity_t own_writer) {
  Endpoints<Gid> result;
  for (const dds_entity_t group : children(participant)) {
    for (const dds_entity_t endpoint : children(group)) {
      if (endpoint == own_writer) continue;
      dds_guid_t guid{};
      if (dds_get_guid(endpoint, &guid) != DDS_RETCODE_OK) continue;
      // Kind of an entity id (RTPS 9.3.1.2): 2 and 3 are writers, 4 and 7 readers.
      const int kind = guid.v[kGuidSize - 1] & 0x0F;
      if (kind == 2 || kind == 3) result.writers.push_back(gid_of<Gid>(endpoint));
      if (kind == 4 || kind == 7) result.readers.push_back(gid_of<Gid>(endpoint));
    }
  }
  return result;
}

void copy_name(char (&target)[257], const std::string& name) {
  const std::size_t length = std::min(name.size(), sizeof(target) - 1);
  std::memcpy(target, name.data(), length);
  target[length] = '\0';
}

}  // namespace

// Both layouts carry the same type name; Humble's has no type information that could contradict
// Iron's.
dds_topic_descriptor_t graph_descriptor(RosGraph layout) {
  const dds_topic_descriptor_t& iron = rmw_dds_common_msg_dds__ParticipantEntitiesInfo__desc;
  if (layout != RosGraph::kHumble) return iron;
  const dds_topic_descriptor_t& humble =
      rmw_dds_common_humble_msg_dds__ParticipantEntitiesInfo__desc;
  return {humble.m_size,  humble.m_align,  humble.m_flagset & ~DDS_TOPIC_XTYPES_METADATA,
          humble.m_nkeys, iron.m_typename, humble.m_keys,
          humble.m_nops,  humble.m_ops,    humble.m_meta,
          {nullptr, 0},   {nullptr, 0},    0};
}

Result<std::unique_ptr<RosGraphWriter>> RosGraphWriter::open(dds_entity_t participant,
                                                             RosGraph layout,
                                                             const std::string& node_namespace,
                                                             const std::string& node) {
  const dds_topic_descriptor_t descriptor = graph_descriptor(layout);
  auto topic = take_entity(
      dds_create_topic(participant, &descriptor, "ros_discovery_info", nullptr, nullptr),
      "cannot create topic ros_discovery_info");
  if (!topic) return topic.failure();
  const QosPtr qos = writer_qos(latched(1), type_hash::kRmwDdsCommonParticipantEntitiesInfo);
  auto writer = take_entity(dds_create_writer(participant, topic->get(), qos.get(), nullptr),
                            "cannot create the writer of ros_discovery_info");
  if (!writer) return writer.failure();
  std::unique_ptr<RosGraphWriter> result(new RosGraphWriter());
  result->participant_ = participant;
  result->layout_ = layout;
  result->namespace_ = node_namespace;
  result->node_ = node;
  result->topic_ = std::move(*topic);
  result->writer_ = std::move(*writer);
  result->publish();
  return result;
}

void RosGraphWriter::publish() {
  const std::lock_guard lock(mutex_);
  if (layout_ == RosGraph::kHumble) {
    write<msg::ParticipantEntitiesInfoHumble>();
  } else {
    write<msg::ParticipantEntitiesInfo>();
  }
}

template <class Info>
void RosGraphWriter::write() const {
  using Gid = decltype(Info::gid);
  using Node = std::remove_pointer_t<decltype(Info::node_entities_info_seq._buffer)>;
  auto owned = endpoints<Gid>(participant_, writer_.get());
  std::vector<Node> nodes(1);
  copy_name(nodes[0].node_namespace, namespace_);
  copy_name(nodes[0].node_name, node_);
  borrow(nodes[0].reader_gid_seq, owned.readers);
  borrow(nodes[0].writer_gid_seq, owned.writers);
  Info info{};
  info.gid = gid_of<Gid>(participant_);
  borrow(info.node_entities_info_seq, nodes);
  dds_write(writer_.get(), &info);
}

}  // namespace sovo::bridge
