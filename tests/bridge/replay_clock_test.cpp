#include "sovo/bridge/replay_clock.h"

#include <gtest/gtest.h>

#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/topics.h"
#include "sovo/bridge/writer.h"
#include "test_bus.h"

namespace sovo::bridge {
namespace {

TEST(ReplayClock, TellsHowLongAgoWasWhatIsReplayed) {
  const Participant participant = open_participant();
  const Participant replay = open_participant();
  auto writer = require(Writer<msg::Clock>::open(replay, topics::kClock, topics::kClockQos));
  ReplayClock clock = require(ReplayClock::open(participant));
  ASSERT_TRUE(clock.update().ok());
  EXPECT_FALSE(clock.lag_ns());

  constexpr std::int64_t kAgo = 3'000'000'000'000;
  ASSERT_TRUE(eventually([&] {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    msg::Clock message{};
    message.clock = to_message(std::chrono::nanoseconds(now).count() - kAgo);
    return writer.write(message).ok() && clock.update().ok() && clock.lag_ns();
  }));
  EXPECT_NEAR(1e-9 * static_cast<double>(*clock.lag_ns() - kAgo), 0.0, 5.0);
  // A replay that has ended is no longer a clock.
  EXPECT_TRUE(eventually([&] { return clock.update().ok() && !clock.lag_ns(); }));
}

}  // namespace
}  // namespace sovo::bridge
