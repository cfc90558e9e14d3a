#include "sovo/driver/live/host_clock.h"

#include <ctime>

namespace sovo {
namespace {

constexpr std::int64_t kUninterruptedNs = 5'000;
constexpr int kTries = 5;

std::int64_t now_ns(clockid_t clock) {
  timespec time{};
  ::clock_gettime(clock, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

}  // namespace

HostClock read_host_clock() {
  HostClock best;
  std::int64_t shortest = -1;
  for (int i = 0; i < kTries; ++i) {
    const std::int64_t before = now_ns(CLOCK_MONOTONIC);
    const std::int64_t utc = now_ns(CLOCK_REALTIME);
    const std::int64_t took = now_ns(CLOCK_MONOTONIC) - before;
    if (shortest >= 0 && took >= shortest) continue;
    best = {before + took / 2, utc};
    shortest = took;
    if (took < kUninterruptedNs) break;
  }
  return best;
}

}  // namespace sovo
