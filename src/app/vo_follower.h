#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>

#include "message_traits.h"
#include "sovo/bridge/reader.h"

namespace sovo::app {

/// Paces a source that could be faster than its listener: it stays at most two frames ahead of
/// what the odometry process says it has done.
class VoFollower {
 public:
  /// `session`: of the frames that are published.
  static Result<VoFollower> open(const bridge::Participant& participant, std::uint64_t session);

  /// Waits until frame `sequence` may be published, or `stop` says so. When nothing was heard for
  /// five seconds it says so in the log and holds nothing back until the odometry is heard again.
  void wait_before(std::uint64_t sequence, const std::function<bool()>& stop);

  /// Waits until frame `sequence` was done, at most `patience` after the last sign of progress.
  void wait_for(std::uint64_t sequence, std::chrono::milliseconds patience,
                const std::function<bool()>& stop);

 private:
  using Clock = std::chrono::steady_clock;
  VoFollower(bridge::Reader<bridge::msg::VoStatus> reader, std::uint64_t session)
      : reader_(std::move(reader)), session_(session) {}

  /// Takes what has arrived; whether the newest sequence rose.
  bool update();
  bool is_done(std::uint64_t sequence) const { return done_ && *done_ >= sequence; }

  bridge::Reader<bridge::msg::VoStatus> reader_;
  std::uint64_t session_;
  std::optional<std::uint64_t> done_;  ///< Newest frame that the odometry reports.
  bool free_running_ = false;
};

}  // namespace sovo::app
