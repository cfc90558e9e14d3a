#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "sovo/bridge/participant.h"
#include "sovo/bridge/reader.h"

namespace sovo::bridge {

/// The time of a replay on the bus, `/clock`. For one thread.
class ReplayClock {
 public:
  static Result<ReplayClock> open(const Participant& participant);

  /// Takes what has come.
  Result<void> update();

  /// UTC less the replay's time [ns]; nothing while no replay is heard. Added to what was stamped
  /// when the recording was made, it gives when that was replayed.
  std::optional<std::int64_t> lag_ns() const;

 private:
  struct Heard {
    std::int64_t lag_ns = 0;
    std::chrono::steady_clock::time_point at;
  };

  explicit ReplayClock(Reader<msg::Clock> reader) : reader_(std::move(reader)) {}

  Reader<msg::Clock> reader_;
  std::optional<Heard> heard_;
};

}  // namespace sovo::bridge
