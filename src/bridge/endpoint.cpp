#include "sovo/bridge/endpoint.h"

#include <algorithm>
#include <array>
#include <vector>

#include "sovo/bridge/cdr_sertype.h"
#include "sovo/bridge/ros_names.h"

namespace sovo::bridge {
namespace {

Result<DdsHandle> open_topic(const Participant& participant, const std::string& ros_name,
                             const TypeInfo& type) {
  const std::string name = dds_topic(ros_name);
  const std::string what = "cannot create topic " + ros_name;
  if (type.descriptor != nullptr) {
    return take_entity(
        dds_create_topic(participant.entity(), type.descriptor, name.c_str(), nullptr, nullptr),
        what);
  }
  ddsi_sertype* sertype = new_cdr_sertype(type.raw_name);
  const dds_entity_t topic = dds_create_topic_sertype(participant.entity(), name.c_str(), &sertype,
                                                      nullptr, nullptr, nullptr);
  if (topic < 0) ddsi_sertype_unref(sertype);
  return take_entity(topic, what);
}

}  // namespace

std::uint32_t WriterBase::num_readers() const {
  return static_cast<std::uint32_t>(
      std::max(dds_get_matched_subscriptions(writer_.get(), nullptr, 0), 0));
}

Result<void> WriterBase::open_untyped(const Participant& participant, const std::string& name,
                                      const TopicQos& qos, const TypeInfo& type) {
  name_ = participant.topic(name);
  auto topic = open_topic(participant, name_, type);
  if (!topic) return topic.failure();
  const QosPtr settings = writer_qos(qos, type.hash);
  auto writer =
      take_entity(dds_create_writer(participant.entity(), topic->get(), settings.get(), nullptr),
                  "cannot create a writer of " + name_);
  if (!writer) return writer.failure();
  topic_ = std::move(*topic);
  writer_ = std::move(*writer);
  participant.announce();
  return {};
}

Result<void> WriterBase::write_untyped(const void* message, std::int64_t source_stamp_ns) {
  const dds_return_t code = dds_write_ts(writer_.get(), message, source_stamp_ns);
  if (code != DDS_RETCODE_OK) return dds_error("cannot write to " + name_, code);
  return {};
}

std::uint32_t ReaderBase::num_writers() const {
  return static_cast<std::uint32_t>(
      std::max(dds_get_matched_publications(reader_.get(), nullptr, 0), 0));
}

bool ReaderBase::has_writer(dds_instance_handle_t writer) const {
  std::array<dds_instance_handle_t, 64> writers{};
  const dds_return_t count =
      dds_get_matched_publications(reader_.get(), writers.data(), writers.size());
  const auto end = writers.begin() + std::clamp<std::ptrdiff_t>(count, 0, writers.size());
  return std::find(writers.begin(), end, writer) != end;
}

Result<void> ReaderBase::open_untyped(const Participant& participant, const std::string& name,
                                      const TopicQos& qos, const TypeInfo& type) {
  name_ = participant.topic(name);
  auto topic = open_topic(participant, name_, type);
  if (!topic) return topic.failure();
  const QosPtr settings = reader_qos(qos, type.hash);
  auto reader =
      take_entity(dds_create_reader(participant.entity(), topic->get(), settings.get(), nullptr),
                  "cannot create a reader of " + name_);
  if (!reader) return reader.failure();
  topic_ = std::move(*topic);
  reader_ = std::move(*reader);
  participant.announce();
  return open_waitset(participant);
}

Result<void> ReaderBase::open_waitset(const Participant& participant) {
  const std::string what = "cannot wait on " + name_;
  auto condition = take_entity(dds_create_readcondition(reader_.get(), DDS_ANY_STATE), what);
  auto guard = take_entity(dds_create_guardcondition(participant.entity()), what);
  auto waitset = take_entity(dds_create_waitset(participant.entity()), what);
  for (const auto* part : {&condition, &guard, &waitset}) {
    if (!*part) return part->failure();
  }
  condition_ = std::move(*condition);
  guard_ = std::move(*guard);
  waitset_ = std::move(*waitset);
  for (const dds_entity_t entity : {condition_.get(), guard_.get()}) {
    const dds_return_t code = dds_waitset_attach(waitset_.get(), entity, entity);
    if (code != DDS_RETCODE_OK) return dds_error(what, code);
  }
  return {};
}

bool ReaderBase::wait(std::chrono::nanoseconds timeout) {
  std::array<dds_attach_t, 2> triggered{};
  const dds_return_t count =
      dds_waitset_wait(waitset_.get(), triggered.data(), triggered.size(), timeout.count());
  bool data = false;
  for (dds_return_t i = 0; i < std::min<dds_return_t>(count, triggered.size()); ++i) {
    if (triggered[static_cast<std::size_t>(i)] == condition_.get()) data = true;
    if (triggered[static_cast<std::size_t>(i)] == guard_.get()) {
      bool was_set = false;
      dds_take_guardcondition(guard_.get(), &was_set);
      if (was_set) return false;
    }
  }
  return data;
}

void ReaderBase::wake() { dds_set_guardcondition(guard_.get(), true); }

}  // namespace sovo::bridge
