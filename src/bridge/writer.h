#pragma once

#include <string>

#include "message_traits.h"
#include "sovo/bridge/endpoint.h"

namespace sovo::bridge {

/// Writes messages of one type to one topic. T is a type of namespace `msg`.
///
///     auto writer = Writer<msg::VoCommand>::open(participant, "command", reliable(10));
///     if (!writer) return writer.error();
///     writer->write(message);
///
/// Writing may be done from any thread. A keep-last writer never blocks on a slow reader.
template <class T>
class Writer : public WriterBase {
 public:
  /// `name`: below the participant's namespace, or global with a leading slash.
  static Result<Writer> open(const Participant& participant, const std::string& name,
                             const TopicQos& qos) {
    Writer writer;
    const auto done = writer.open_untyped(
        participant, name, qos, {&MessageTraits<T>::descriptor(), MessageTraits<T>::kHash});
    if (!done) return done.failure();
    return writer;
  }

  /// Serializes and sends; the message may borrow what it points at (borrow.h).
  Result<void> write(const T& message) { return write(message, dds_time()); }

  /// The same with a source timestamp [ns, UTC].
  Result<void> write(const T& message, std::int64_t source_stamp_ns) {
    return write_untyped(&message, source_stamp_ns);
  }

 private:
  Writer() = default;
};

}  // namespace sovo::bridge
