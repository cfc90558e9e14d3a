#pragma once

#include <string>

#include "sovo/bridge/cdr_sertype.h"
#include "sovo/bridge/endpoint.h"
#include "sovo/bridge/message_schema.h"

namespace sovo::bridge {

/// Writes serialized messages to a topic unchanged.
///
///     auto writer = RawWriter::open(participant, "status", *find_schema("sovo_msgs/msg/VoStatus"),
///                                   reliable(10));
///     writer->write(sample.bytes(), sample.source_stamp_ns());
///
/// Writing may be done from any thread. Shared memory must be off in this process.
class RawWriter : public WriterBase {
 public:
  /// `name`: below the participant's namespace, or global with a leading slash.
  static Result<RawWriter> open(const Participant& participant, const std::string& name,
                                const MessageSchema& type, const TopicQos& qos) {
    RawWriter writer;
    const auto done = writer.open_untyped(participant, name, qos, raw_type(type));
    if (!done) return done.failure();
    return writer;
  }

  /// `bytes` begin with an encapsulation header; they are copied. Stamp: source timestamp [ns,
  /// UTC].
  Result<void> write(CdrBytes bytes, std::int64_t source_stamp_ns) {
    if (bytes.size() < 4) return Error{"a message for " + topic() + " is shorter than its header"};
    const CdrView view{bytes};
    return write_untyped(&view, source_stamp_ns);
  }

 private:
  RawWriter() = default;
};

}  // namespace sovo::bridge
