#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "sovo/bridge/dds_handle.h"
#include "sovo/bridge/participant.h"
#include "sovo/bridge/topic_qos.h"

namespace sovo::bridge {

/// What readers and writers need to know of a message type.
struct TypeInfo {
  const dds_topic_descriptor_t* descriptor = nullptr;  ///< Null: pass messages on as bytes.
  const char* hash = "";
  const char* raw_name = "";  ///< DDS name of the type when there is no descriptor.
};

/// A writer without its type, see writer.h.
class WriterBase {
 public:
  dds_entity_t entity() const { return writer_.get(); }
  /// Full ROS name.
  const std::string& topic() const { return name_; }
  /// Readers that are matched now.
  std::uint32_t num_readers() const;

 protected:
  WriterBase() = default;
  Result<void> open_untyped(const Participant& participant, const std::string& name,
                            const TopicQos& qos, const TypeInfo& type);
  Result<void> write_untyped(const void* message, std::int64_t source_stamp_ns);

 private:
  std::string name_;
  DdsHandle topic_;
  DdsHandle writer_;
};

/// A reader without its type, see reader.h.
class ReaderBase {
 public:
  dds_entity_t entity() const { return reader_.get(); }
  /// Full ROS name.
  const std::string& topic() const { return name_; }
  /// Writers that are matched now.
  std::uint32_t num_writers() const;
  /// Whether the writer of this handle (dds_sample_info_t::publication_handle) is still there.
  bool has_writer(dds_instance_handle_t writer) const;

  /// Waits until there is something to take; false when `timeout` passed, or `wake` was called.
  bool wait(std::chrono::nanoseconds timeout);
  /// Ends one wait, the present or the next one; may be called from any thread.
  void wake();

 protected:
  ReaderBase() = default;
  Result<void> open_untyped(const Participant& participant, const std::string& name,
                            const TopicQos& qos, const TypeInfo& type);

 private:
  Result<void> open_waitset(const Participant& participant);

  std::string name_;
  DdsHandle topic_;
  DdsHandle reader_;
  DdsHandle condition_;
  DdsHandle guard_;
  DdsHandle waitset_;
};

}  // namespace sovo::bridge
