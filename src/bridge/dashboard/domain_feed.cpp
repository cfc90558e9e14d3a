#include "sovo/bridge/dashboard/domain_feed.h"

#include <array>

#include "sovo/bridge/dashboard/topic_policy.h"
#include "sovo/bridge/message_schema.h"
#include "sovo/bridge/topics.h"

namespace sovo::bridge {
namespace {

constexpr dds_duration_t kLongestWait = DDS_MSECS(200);
constexpr std::size_t kMostSources = 1000;
constexpr std::size_t kMostCommands = 64;
// Commands are some hundred bytes.
constexpr std::size_t kLargestCommand = 4096;

std::string guid_text(const dds_guid_t& guid) {
  return std::string(guid.v, guid.v + sizeof(guid.v));
}

/// A reader's QoS that matches a writer of this one.
TopicQos qos_for(const dds_qos_t* offered, const std::string& topic) {
  dds_durability_kind_t durability = DDS_DURABILITY_VOLATILE;
  dds_reliability_kind_t reliability = DDS_RELIABILITY_RELIABLE;
  dds_duration_t ignored = 0;
  dds_qget_durability(offered, &durability);
  dds_qget_reliability(offered, &reliability, &ignored);
  TopicQos qos =
      durability == DDS_DURABILITY_VOLATILE ? reliable(10) : latched(latched_depth_of(topic));
  qos.best_effort = reliability == DDS_RELIABILITY_BEST_EFFORT;
  return qos;
}

}  // namespace

Result<std::unique_ptr<DomainFeed>> DomainFeed::open(const DdsConfig& config,
                                                     const std::string& prefix, Ids ids) {
  auto participant = Participant::open(config, "dashboard");
  if (!participant) return participant.failure();
  std::unique_ptr<DomainFeed> feed(new DomainFeed(std::move(*participant), prefix, std::move(ids)));
  if (auto done = feed->open_discovery(); !done) return done.failure();
  return feed;
}

Result<void> DomainFeed::open_discovery() {
  const dds_entity_t participant = participant_.entity();
  const std::string what = "cannot look for topics";
  auto discovery = take_entity(
      dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr), what);
  auto guard = take_entity(dds_create_guardcondition(participant), what);
  auto waitset = take_entity(dds_create_waitset(participant), what);
  for (const auto* part : {&discovery, &guard, &waitset}) {
    if (!*part) return part->failure();
  }
  discovery_ = std::move(*discovery);
  guard_ = std::move(*guard);
  waitset_ = std::move(*waitset);
  const dds_entity_t condition = dds_create_readcondition(discovery_.get(), DDS_ANY_STATE);
  for (const dds_entity_t entity : {condition, guard_.get()}) {
    const dds_return_t code = dds_waitset_attach(waitset_.get(), entity, 0);
    if (code != DDS_RETCODE_OK) return dds_error(what, code);
  }
  return {};
}

DomainFeed::~DomainFeed() { stop(); }

void DomainFeed::stop() {
  stop_ = true;
  dds_set_guardcondition(guard_.get(), true);
  if (thread_.joinable()) thread_.join();
}

void DomainFeed::start(BusListener& listener) {
  listener_ = &listener;
  thread_ = std::thread([this] { run(); });
}

void DomainFeed::run() {
  while (!stop_) {
    std::array<dds_attach_t, 16> triggered{};
    dds_waitset_wait(waitset_.get(), triggered.data(), triggered.size(), kLongestWait);
    bool was_set = false;
    dds_take_guardcondition(guard_.get(), &was_set);
    discover();
    forward();
  }
}

void DomainFeed::discover() {
  std::array<void*, 16> samples{};
  std::array<dds_sample_info_t, 16> infos{};
  while (true) {
    const dds_return_t count = dds_take(discovery_.get(), samples.data(), infos.data(),
                                        samples.size(), static_cast<uint32_t>(samples.size()));
    if (count <= 0) return;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      const auto& writer = *static_cast<const dds_builtintopic_endpoint_t*>(samples[i]);
      if (infos[i].instance_state != DDS_ALIVE_INSTANCE_STATE) {
        remove_writer(writer);
      } else if (infos[i].valid_data) {
        add_writer(writer);
      }
    }
    dds_return_loan(discovery_.get(), samples.data(), count);
  }
}

void DomainFeed::add_writer(const dds_builtintopic_endpoint_t& writer) {
  const auto topic = ros_name_of(writer.topic_name);
  const MessageSchema* schema = find_schema(writer.type_name);
  if (!topic || schema == nullptr || !is_forwarded(*topic, schema->ros_name)) return;
  const std::string guid = guid_text(writer.key);
  const Key key(*topic, schema->ros_name);
  foxglove::Channel added;
  {
    const std::lock_guard lock(mutex_);
    if (sources_.size() >= kMostSources && sources_.count(key) == 0) return;
    writers_[guid] = key;
    Source& source = sources_[key];
    source.writers.insert(guid);
    if (source.writers.size() > 1) return;
    source.topic = *topic;
    source.schema = schema;
    source.qos = qos_for(writer.qos, *topic);
    source.channel = {++*ids_,
                      prefix_ + *topic,
                      schema->ros_name,
                      schema->definition,
                      importance_of(schema->ros_name),
                      source.qos.latched ? source.qos.depth : 0};
    added = source.channel;
  }
  if (schema->ros_name == "sovo_msgs/msg/VoStatus") {
    metrics_.add(participant_, topic->substr(0, topic->rfind('/')));
  }
  listener_->on_channel(added);
}

void DomainFeed::remove_writer(const dds_builtintopic_endpoint_t& writer) {
  const auto known = writers_.find(guid_text(writer.key));
  if (known == writers_.end()) return;
  std::uint32_t gone = 0;
  {
    const std::lock_guard lock(mutex_);
    const auto at = sources_.find(known->second);
    at->second.writers.erase(known->first);
    if (at->second.writers.empty()) {
      gone = at->second.channel.id;
      sources_.erase(at);
    }
  }
  writers_.erase(known);
  if (gone != 0) listener_->on_channel_gone(gone);
}

void DomainFeed::want(std::uint32_t channel, bool wanted) {
  const std::lock_guard lock(mutex_);
  for (auto& [key, source] : sources_) {
    if (source.channel.id == channel) source.wanted = wanted;
  }
  dds_set_guardcondition(guard_.get(), true);
}

/// Opens and closes readers as wanted; those that are open.
std::vector<std::pair<std::uint32_t, std::shared_ptr<RawReader>>> DomainFeed::update_readers() {
  std::vector<std::pair<std::uint32_t, std::shared_ptr<RawReader>>> readers;
  const std::lock_guard lock(mutex_);
  for (auto& [key, source] : sources_) {
    if (!source.wanted) source.reader.reset();
    if (source.wanted && !source.reader) {
      auto reader = RawReader::open(participant_, source.topic, *source.schema, source.qos);
      if (!reader) continue;
      source.reader = std::make_shared<RawReader>(std::move(*reader));
      const dds_entity_t condition =
          dds_create_readcondition(source.reader->entity(), DDS_ANY_STATE);
      dds_waitset_attach(waitset_.get(), condition, 0);
    }
    if (source.reader) readers.emplace_back(source.channel.id, source.reader);
  }
  return readers;
}

void DomainFeed::forward() {
  for (const auto& [channel, reader] : update_readers()) {
    (void)reader->take_each([&, id = channel](const CdrSample& sample, const dds_sample_info_t&) {
      const CdrBytes bytes = sample.bytes();
      listener_->on_message(
          id, sample.source_stamp_ns(),
          std::make_shared<const std::vector<std::uint8_t>>(bytes.begin(), bytes.end()));
    });
  }
}

Result<void> DomainFeed::prepare(const std::string& topic, const std::string& type) {
  const MessageSchema* schema = find_schema(type);
  if (schema == nullptr || !is_command(topic, type)) {
    return Error{
        "only commands can be published: command (sovo_msgs/msg/VoCommand) and "
        "record_command (sovo_msgs/msg/RecorderCommand) of a namespace, not " +
        topic};
  }
  const std::lock_guard lock(mutex_);
  if (commands_.count(topic) != 0) return {};
  if (commands_.size() >= kMostCommands) return Error{"too many command topics"};
  auto writer = RawWriter::open(participant_, topic, *schema, topics::kCommandQos);
  if (!writer) return writer.failure();
  commands_.emplace(topic, std::move(*writer));
  return {};
}

Result<void> DomainFeed::publish(const std::string& topic, std::span<const std::uint8_t> payload) {
  if (payload.size() > kLargestCommand) return Error{"a command of this size is none"};
  const std::lock_guard lock(mutex_);
  const auto at = commands_.find(topic);
  if (at == commands_.end()) return Error{topic + " was not advertised"};
  if (at->second.num_readers() == 0) {
    return Error{"nobody listens to " + topic + ": is the process running, in this domain?"};
  }
  return at->second.write(payload, dds_time());
}

}  // namespace sovo::bridge
