#include "sovo/driver/live/device_clock.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sovo {
namespace {

constexpr std::int64_t kUtc0 = 1'700'000'000'000'000'000;
constexpr double kDrift = 40e-6;

/// A device with a clock of its own: UTC = kUtc0 + (1 + kDrift) * device, seen late.
class Device {
 public:
  std::int64_t utc(std::int64_t device_ns) const {
    return kUtc0 + shift_ns + device_ns +
           static_cast<std::int64_t>(kDrift * static_cast<double>(device_ns));
  }
  /// Delay of an arrival: some at least, now and then a lot.
  std::int64_t late_ns() {
    const double u = static_cast<double>(random_() >> 11) * 0x1p-53;
    const double rare = static_cast<double>(random_() >> 11) * 0x1p-53;
    return static_cast<std::int64_t>(1e6 * (-std::log(1.0 - u)) + (rare < 0.02 ? 30e6 : 0.0));
  }

  std::int64_t shift_ns = 0;

 private:
  std::mt19937_64 random_{7};
};

TEST(DeviceClock, FindsOffsetAndDriftUnderLateReadings) {
  DeviceClock clock;
  Device device;
  for (int n = 0; n < 30 * 60; ++n) {
    const std::int64_t t = n * 33'333'333LL;
    clock.observe(t, device.utc(t) + device.late_ns());
    // After ten seconds the least delay of thirty readings is far below a millisecond.
    if (n > 300) {
      EXPECT_LT(std::abs(clock.to_utc(t) - device.utc(t)), 500'000) << n;
    }
  }
  EXPECT_NEAR(clock.drift(), kDrift, 5e-6);
  EXPECT_LT(clock.sigma_s(), 200e-6);
  EXPECT_GT(clock.sigma_s(), 0.0);
  EXPECT_EQ(clock.steps(), 0U);
}

TEST(DeviceClock, StampsRiseWhileTheFitChanges) {
  DeviceClock clock;
  Device device;
  std::int64_t last = 0;
  for (int n = 0; n < 2000; ++n) {
    const std::int64_t t = n * 16'666'667LL;
    clock.observe(t, device.utc(t) + device.late_ns());
    EXPECT_GT(clock.to_utc(t), last);
    last = clock.to_utc(t);
  }
}

TEST(DeviceClock, ASteppedClockIsFollowedAndCounted) {
  for (const std::int64_t step : {-800'000'000LL, 300'000'000LL}) {
    DeviceClock clock;
    Device device;
    for (int n = 0; n < 600; ++n) {
      if (n == 300) device.shift_ns = step;
      const std::int64_t t = n * 33'333'333LL;
      clock.observe(t, device.utc(t) + device.late_ns());
    }
    const std::int64_t t = 600 * 33'333'333LL;
    EXPECT_LT(std::abs(clock.to_utc(t) - device.utc(t)), 2'000'000) << step;
    EXPECT_EQ(clock.steps(), 1U) << step;
  }
}

TEST(DeviceClock, ARestartedDeviceIsFollowed) {
  DeviceClock clock;
  Device device;
  for (int n = 0; n < 300; ++n) clock.observe(n * 33'333'333LL, device.utc(n * 33'333'333LL));
  const std::int64_t later = device.utc(300 * 33'333'333LL);
  clock.observe(1000, later);
  EXPECT_EQ(clock.to_utc(1000), later);
  EXPECT_EQ(clock.steps(), 1U);
}

TEST(DeviceClock, AStalledHostIsNoStep) {
  DeviceClock clock;
  Device device;
  for (int n = 0; n < 600; ++n) {
    const std::int64_t t = n * 33'333'333LL;
    // For half a second nothing is read; then everything at once.
    const std::int64_t read = n >= 300 && n < 315 ? 315 * 33'333'333LL : t;
    clock.observe(t, device.utc(read) + 200'000);
  }
  EXPECT_EQ(clock.steps(), 0U);
  const std::int64_t t = 600 * 33'333'333LL;
  EXPECT_LT(std::abs(clock.to_utc(t) - device.utc(t)), 400'000);
}

TEST(DeviceClock, ABusyHostIsNoStep) {
  DeviceClock clock;
  Device device;
  for (int n = 0; n < 600; ++n) {
    const std::int64_t t = n * 33'333'333LL;
    // For a second and a half every reading is late, and all by about the same.
    const std::int64_t late = n >= 300 && n < 345 ? 80'000'000 : 200'000;
    clock.observe(t, device.utc(t) + late + device.late_ns() / 10);
    if (n > 60) {
      EXPECT_LT(std::abs(clock.to_utc(t) - device.utc(t)), 1'000'000) << n;
    }
  }
  EXPECT_EQ(clock.steps(), 0U);
}

}  // namespace
}  // namespace sovo
