#pragma once

#include <array>
#include <string>

#include "message_traits.h"
#include "sovo/bridge/endpoint.h"

namespace sovo::bridge {

/// Reads messages of one type from one topic. T is a type of namespace `msg`.
///
///     auto reader = Reader<msg::VoStatus>::open(participant, "status", reliable(10));
///     while (reader->wait(std::chrono::seconds(1))) {
///       reader->take_each([](const msg::VoStatus& status, const dds_sample_info_t& info) { ... });
///     }
///
/// Messages are lent to the callback and go back when it returns or throws: what it wants to keep
/// it copies. One thread takes; any thread may `wake` it.
template <class T>
class Reader : public ReaderBase {
 public:
  /// `name`: below the participant's namespace, or global with a leading slash.
  static Result<Reader> open(const Participant& participant, const std::string& name,
                             const TopicQos& qos) {
    Reader reader;
    const auto done = reader.open_untyped(
        participant, name, qos, {&MessageTraits<T>::descriptor(), MessageTraits<T>::kHash});
    if (!done) return done.failure();
    return reader;
  }

  /// Calls f(message, info) for everything that has arrived, in order, and gives how many there
  /// were.
  template <class F>
  Result<int> take_each(F&& f) {
    int messages = 0;
    while (true) {
      Loan loan(entity());
      if (loan.count < 0) return dds_error("cannot read " + topic(), loan.count);
      if (loan.count == 0) return messages;
      for (dds_return_t i = 0; i < loan.count; ++i) {
        const auto index = static_cast<std::size_t>(i);
        if (!loan.infos[index].valid_data) continue;  // news of a writer's end, not of data
        ++messages;
        f(*static_cast<const T*>(loan.samples[index]), loan.infos[index]);
      }
    }
  }

 private:
  static constexpr std::size_t kBatch = 8;

  /// Samples lent by Cyclone DDS, given back at the end of the scope.
  struct Loan {
    explicit Loan(dds_entity_t from) : reader(from) {
      count = dds_take(reader, samples.data(), infos.data(), kBatch, kBatch);
    }
    ~Loan() {
      if (count > 0) dds_return_loan(reader, samples.data(), count);
    }
    Loan(const Loan&) = delete;
    Loan& operator=(const Loan&) = delete;

    dds_entity_t reader;
    std::array<void*, kBatch> samples{};
    std::array<dds_sample_info_t, kBatch> infos{};
    dds_return_t count = 0;
  };

  Reader() = default;
};

}  // namespace sovo::bridge
