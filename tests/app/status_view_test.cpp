#include "sovo/app/status_view.h"

#include <gtest/gtest.h>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/ros_conversion.h"

namespace sovo::app {
namespace {

using namespace std::chrono_literals;
namespace msg = bridge::msg;

constexpr std::int64_t kStamp = 1'700'000'000'000'000'000;

class StatusScreen : public ::testing::Test {
 protected:
  void SetUp() override { status_.header.stamp = bridge::to_message(kStamp); }

  bool says(const std::string& text, std::int64_t utc_ns = kStamp) const {
    const std::string screen = status_screen(status_, surroundings_.text(status_, now_, utc_ns));
    return screen.find(text) != std::string::npos;
  }

  void record(bool recording, std::uint64_t bytes) {
    msg::RecorderStatus m{};
    m.recording = recording;
    m.file = bridge::borrow("dive_0.mcap");
    m.reason = bridge::borrow(recording ? "" : "the disk is full");
    m.bytes = bytes;
    m.free_bytes = 34'000'000'000;
    m.dropped = 3;
    surroundings_.add(m, now_);
  }

  msg::VoStatus status_{};
  StatusSurroundings surroundings_;
  StatusSurroundings::Clock::time_point now_ = StatusSurroundings::Clock::now();
};

TEST_F(StatusScreen, TellsTheDiskWhileARecorderSpeaks) {
  EXPECT_TRUE(says("no word of a recorder"));
  record(true, 10'000'000);
  now_ += 1s;
  record(true, 110'000'000);
  EXPECT_TRUE(says("recording dive_0.mcap, 110.0 MB, 100.0 MB/s; 34.0 GB free, 3 dropped"));
  record(false, 110'000'000);
  EXPECT_TRUE(says("not recording (the disk is full)"));
  now_ += 10s;
  EXPECT_TRUE(says("no word of a recorder"));
}

TEST_F(StatusScreen, AgesAreThoseOfTheReplaysClockWhileItIsHeard) {
  EXPECT_TRUE(says("newest frame 0.50 s old", kStamp + 500'000'000));
  EXPECT_TRUE(says("frames of a recording", kStamp + 3600LL * 1'000'000'000));
  msg::Clock clock{};
  clock.clock = bridge::to_message(kStamp + 250'000'000);
  surroundings_.add(clock, now_);
  EXPECT_TRUE(says("0.25 s old by /clock", kStamp + 3600LL * 1'000'000'000));
  now_ += 5s;
  EXPECT_TRUE(says("frames of a recording", kStamp + 3600LL * 1'000'000'000));
}

TEST_F(StatusScreen, TellsRateAndScale) {
  EXPECT_TRUE(says("not measured"));
  for (int i = 0; i < 5; ++i) {
    surroundings_.add(status_, now_);
    now_ += 50ms;
  }
  EXPECT_TRUE(says("20.0 Hz"));
  msg::ScaledOdometry odometry{};
  odometry.scale_valid = true;
  odometry.log_scale_sigma = 0.001;
  odometry.scale_age_s = 1.5;
  surroundings_.add(odometry);
  EXPECT_TRUE(says("1.0000 +- 0.10 %, measured 1.5 s ago"));
}

}  // namespace
}  // namespace sovo::app
