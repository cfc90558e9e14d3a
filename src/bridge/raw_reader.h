#pragma once

#include <functional>
#include <string>

#include "sovo/bridge/cdr_sample.h"
#include "sovo/bridge/endpoint.h"
#include "sovo/bridge/message_schema.h"

namespace sovo::bridge {

/// Reads messages of a topic as serialized bytes, whatever their type.
///
///     auto reader = RawReader::open(participant, "status", *find_schema("sovo_msgs/msg/VoStatus"),
///                                   reliable(10));
///     while (reader->wait(std::chrono::seconds(1))) {
///       reader->take_each([](CdrSample sample, const dds_sample_info_t& info) { ... });
///     }
///
/// One thread takes; any thread may `wake` it. Shared memory must be off in this process.
class RawReader : public ReaderBase {
 public:
  using Callback = std::function<void(CdrSample, const dds_sample_info_t&)>;

  /// `name`: below the participant's namespace, or global with a leading slash.
  static Result<RawReader> open(const Participant& participant, const std::string& name,
                                const MessageSchema& type, const TopicQos& qos);

  /// Gives everything that has arrived to `f`, in order; how many there were.
  Result<int> take_each(const Callback& f);

 private:
  RawReader() = default;
};

}  // namespace sovo::bridge
