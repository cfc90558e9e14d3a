#include "sovo/driver/live/auto_exposure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace sovo {
namespace {

/// A frame of a scene of this light under an exposure.
StereoFrame frame(double light, const Exposure& exposure) {
  const double grey = light * exposure.exposure_s * std::pow(10.0, exposure.gain_db / 20.0);
  StereoFrame result;
  result.left.valid = true;
  result.left.width = 64;
  result.left.height = 48;
  result.left.step = 64;
  result.left.data = std::make_shared<const std::vector<std::uint8_t>>(
      64 * 48, static_cast<std::uint8_t>(std::clamp(grey, 0.0, 255.0)));
  result.right = result.left;
  return result;
}

/// Runs until it is quiet; the largest change of light at a time.
double settle(AutoExposure* control, double light) {
  double largest = 0.0;
  for (int n = 0; n < 3000; ++n) {
    const Exposure before = control->exposure();
    const auto wanted = control->observe(frame(light, before));
    if (!wanted) continue;
    const double change = wanted->exposure_s / before.exposure_s *
                          std::pow(10.0, (wanted->gain_db - before.gain_db) / 20.0);
    largest = std::max(largest, std::max(change, 1.0 / change) - 1.0);
  }
  return largest;
}

TEST(AutoExposure, ComesSlowlyToTheTargetFromBothSides) {
  AutoExposureConfig config;
  for (const double light : {3'000.0, 20'000.0, 400'000.0}) {
    AutoExposure control(config);
    EXPECT_LE(settle(&control, light), config.max_step + 1e-9);
    EXPECT_NEAR(control.mean_grey(), config.target_grey, 0.12 * config.target_grey) << light;
  }
}

TEST(AutoExposure, GainComesAfterExposureAndGoesBeforeIt) {
  AutoExposureConfig config;
  AutoExposure control(config);
  settle(&control, 5'000.0);
  EXPECT_NEAR(control.exposure().exposure_s, config.max_exposure_s, 1e-9);
  EXPECT_GT(control.exposure().gain_db, 3.0);
  settle(&control, 50'000.0);
  EXPECT_EQ(control.exposure().gain_db, 0.0);
  EXPECT_LT(control.exposure().exposure_s, config.max_exposure_s);
}

TEST(AutoExposure, DarknessEndsAtTheBounds) {
  AutoExposureConfig config;
  AutoExposure control(config);
  settle(&control, 0.0);
  EXPECT_NEAR(control.exposure().exposure_s, config.max_exposure_s, 1e-9);
  EXPECT_NEAR(control.exposure().gain_db, config.max_gain_db, 1e-9);
}

}  // namespace
}  // namespace sovo
