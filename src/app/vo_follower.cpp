#include "sovo/app/vo_follower.h"

#include <spdlog/spdlog.h>

#include <algorithm>

#include "sovo/bridge/topics.h"

namespace sovo::app {
namespace {

constexpr std::uint64_t kFramesAhead = 2;
constexpr std::chrono::seconds kVoPatience(5);
constexpr std::chrono::milliseconds kFollowSlice(50);

}  // namespace

Result<VoFollower> VoFollower::open(const bridge::Participant& participant, std::uint64_t session) {
  using Number = std::optional<std::uint64_t>;
  return open(
      participant,
      [session](const bridge::msg::VoStatus& status) {
        return status.session == session ? Number(status.sequence) : std::nullopt;
      },
      kFramesAhead);
}

Result<VoFollower> VoFollower::open(const bridge::Participant& participant, Numbering numbering,
                                    std::uint64_t ahead) {
  auto reader = bridge::Reader<bridge::msg::VoStatus>::open(participant, bridge::topics::kStatus,
                                                            bridge::topics::kStatusQos);
  if (!reader) return reader.failure();
  return VoFollower(std::move(*reader), std::move(numbering), ahead);
}

bool VoFollower::update() {
  const auto before = done_;
  const auto taken = reader_.take_each([this](const bridge::msg::VoStatus& status, const auto&) {
    const auto number = numbering_(status);
    if (number) done_ = std::max(done_.value_or(0), *number);
  });
  if (!taken) spdlog::warn("{}", taken.error());
  return done_ != before;
}

void VoFollower::wait_before(std::uint64_t sequence, const std::function<bool()>& stop) {
  if (update()) free_running_ = false;
  if (sequence < ahead_ || free_running_) return;
  auto last_progress = Clock::now();
  while (!is_done(sequence - ahead_) && !stop()) {
    reader_.wait(kFollowSlice);
    if (update()) last_progress = Clock::now();
    if (Clock::now() - last_progress < kVoPatience) continue;
    spdlog::warn("no odometry process answers on {}; publishing without waiting for it",
                 reader_.topic());
    free_running_ = true;
    return;
  }
}

void VoFollower::wait_for(std::uint64_t sequence, std::chrono::milliseconds patience,
                          const std::function<bool()>& stop) {
  auto last_progress = Clock::now();
  update();
  while (!is_done(sequence) && !stop() && Clock::now() - last_progress < patience) {
    reader_.wait(kFollowSlice);
    if (update()) last_progress = Clock::now();
  }
}

}  // namespace sovo::app
