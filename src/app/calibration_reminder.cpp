#include "sovo/app/calibration_reminder.h"

#include <spdlog/spdlog.h>

namespace sovo::app {
namespace {

constexpr std::chrono::milliseconds kSayAgain(500);
/// Within this a listener has long been matched, on a busy machine too.
constexpr std::chrono::seconds kNew(10);

}  // namespace

void CalibrationReminder::remind() {
  const auto now = Clock::now();
  if (!enabled_ || now - said_ < kSayAgain) return;
  said_ = now;
  const auto done = publisher_.publish_static(participant_, cameras_, stamp_ns_);
  if (!done) spdlog::warn("{}", done.error());
}

void CalibrationReminder::remind_new_listeners() {
  if (!enabled_) return;
  const std::uint32_t listeners = publisher_.num_readers();
  if (listeners > listeners_) came_ = Clock::now();
  listeners_ = listeners;
  if (listeners > 0 && Clock::now() - came_ < kNew) remind();
}

}  // namespace sovo::app
