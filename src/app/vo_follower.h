#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

#include "message_traits.h"
#include "sovo/bridge/reader.h"

namespace sovo::app {

/// Paces a source that could be faster than its listener: it stays at most a few frames ahead of
/// what the odometry process says it has done.
class VoFollower {
 public:
  /// Which of the published frames a status is about; nothing for frames of others.
  using Numbering = std::function<std::optional<std::uint64_t>(const bridge::msg::VoStatus&)>;

  /// Two frames ahead. `session`: of the frames that are published.
  static Result<VoFollower> open(const bridge::Participant& participant, std::uint64_t session);
  /// `ahead`: frames that may be on their way.
  static Result<VoFollower> open(const bridge::Participant& participant, Numbering numbering,
                                 std::uint64_t ahead);

  /// Whether an odometry process is on the bus now, busy or not.
  bool sees_odometry() const { return reader_.num_writers() > 0; }

  /// Waits until frame `sequence` may be published, or `stop` says so. When nothing was heard for
  /// five seconds it says so in the log and holds nothing back until the odometry is heard again.
  void wait_before(std::uint64_t sequence, const std::function<bool()>& stop);

  /// Waits until frame `sequence` was done, at most `patience` after the last sign of progress.
  void wait_for(std::uint64_t sequence, std::chrono::milliseconds patience,
                const std::function<bool()>& stop);

 private:
  using Clock = std::chrono::steady_clock;
  VoFollower(bridge::Reader<bridge::msg::VoStatus> reader, Numbering numbering, std::uint64_t ahead)
      : reader_(std::move(reader)), numbering_(std::move(numbering)), ahead_(ahead) {}

  /// Takes what has arrived; whether the newest sequence rose.
  bool update();
  bool is_done(std::uint64_t sequence) const { return done_ && *done_ >= sequence; }

  bridge::Reader<bridge::msg::VoStatus> reader_;
  Numbering numbering_;
  std::uint64_t ahead_;
  std::optional<std::uint64_t> done_;  ///< Newest frame that the odometry reports.
  bool free_running_ = false;
};

}  // namespace sovo::app
