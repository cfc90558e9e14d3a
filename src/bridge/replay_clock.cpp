#include "sovo/bridge/replay_clock.h"

#include <utility>

#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/topics.h"

namespace sovo::bridge {
namespace {

constexpr std::chrono::seconds kReplayedLately(2);  // a replay publishes it all the time

}  // namespace

Result<ReplayClock> ReplayClock::open(const Participant& participant) {
  auto reader = Reader<msg::Clock>::open(participant, topics::kClock, topics::kClockQos);
  if (!reader) return reader.failure();
  return ReplayClock(std::move(*reader));
}

Result<void> ReplayClock::update() {
  const auto taken = reader_.take_each([&](const msg::Clock& m, const dds_sample_info_t& info) {
    heard_ = Heard{info.source_timestamp - stamp_ns(m.clock), std::chrono::steady_clock::now()};
  });
  if (!taken) return taken.failure();
  return {};
}

std::optional<std::int64_t> ReplayClock::lag_ns() const {
  if (!heard_ || std::chrono::steady_clock::now() - heard_->at > kReplayedLately) {
    return std::nullopt;
  }
  return heard_->lag_ns;
}

}  // namespace sovo::bridge
