#include <gtest/gtest.h>

#include <cmath>

#include "scale/scale_filter_support.h"
#include "support/synthetic_scene.h"

namespace sovo {
namespace {

using test::locked_filter;
using test::measure;

TEST(ScaleDrift, ConstantDriftThatIsNotExpectedLeavesLittleBias) {
  // 0.4 % of drift a keyframe under 0.3 % of noise: a gain K leaves 0.4 % (1 - K) / K.
  ScaleFilterConfig config;
  config.drift_sigma = 0.0;
  ScaleFilter filter = locked_filter(config);
  std::mt19937 random(5);
  double error = 0.0;
  double bias = 0.0;
  double square = 0.0;
  double gain = 0.0;
  int counted = 0;
  for (int i = 0; i < 2000; ++i) {
    error += 0.004;
    const ScaleUpdate update = filter.update(measure(error + 0.003 * test::normal(random), 0.003));
    error -= update.log_scale_correction;
    if (i < 200) continue;
    bias += error;
    square += error * error;
    gain += update.gain;
    ++counted;
  }
  bias /= counted;
  gain /= counted;
  RecordProperty("bias", std::to_string(bias));
  RecordProperty("gain", std::to_string(gain));
  RecordProperty("rms", std::to_string(std::sqrt(square / counted)));
  EXPECT_NEAR(bias, 0.004 * (1.0 - gain) / gain, 3e-4);
  EXPECT_LT(bias, 0.0015);
  EXPECT_LT(std::sqrt(square / counted), 0.0035);
}

/// Mean and root mean square of a filter's error over keyframes whose scale drifts and walks.
struct Followed {
  double bias = 0.0;
  double rms = 0.0;
};
Followed follow(double drift_sigma, double drift, double walk) {
  ScaleFilterConfig config;
  config.drift_sigma = drift_sigma;
  ScaleFilter filter = locked_filter(config);
  std::mt19937 random(7);
  Followed out;
  double error = 0.0;
  constexpr int kKeyframes = 4000;
  constexpr int kLearning = 200;
  for (int i = 0; i < kKeyframes; ++i) {
    error += drift + walk * test::normal(random);
    error -=
        filter.update(measure(error + 0.003 * test::normal(random), 0.003)).log_scale_correction;
    if (i < kLearning) continue;
    out.bias += error / (kKeyframes - kLearning);
    out.rms += error * error / (kKeyframes - kLearning);
  }
  out.rms = std::sqrt(out.rms);
  return out;
}

TEST(ScaleDrift, ASteadyDriftIsLearnedAndMadeUpFor) {
  // 0.1 % a keyframe, 1 % over a median depth, as maps of an open highway shrink.
  const Followed lagging = follow(0.0, 0.001, 0.0005);
  const Followed expected = follow(ScaleFilterConfig().drift_sigma, 0.001, 0.0005);
  RecordProperty("lagging", std::to_string(lagging.bias));
  RecordProperty("expected", std::to_string(expected.bias));
  EXPECT_GT(lagging.bias, 8e-4);
  EXPECT_LT(std::abs(expected.bias), 0.4 * lagging.bias);
  EXPECT_LT(expected.rms, lagging.rms);
}

TEST(ScaleDrift, WithoutADriftLittleIsLostByExpectingOne) {
  const Followed without = follow(0.0, 0.0, 0.0005);
  const Followed with = follow(ScaleFilterConfig().drift_sigma, 0.0, 0.0005);
  RecordProperty("without", std::to_string(without.rms));
  RecordProperty("with", std::to_string(with.rms));
  EXPECT_LT(std::abs(with.bias), 2e-4);
  EXPECT_LT(with.rms, 1.25 * without.rms);
}

TEST(ScaleDrift, WhatADriftMakesDoesNotAddUpWhileScalesAreNotSeen) {
  ScaleFilter filter = locked_filter();
  double error = 0.0;
  double step = 0.0;
  for (int i = 0; i < 100; ++i) {
    error += 0.001;
    const ScaleUpdate update = filter.update(measure(error, 0.001));
    error -= update.log_scale_correction;
    step = update.expected;
  }
  EXPECT_GT(step, 6e-4);
  for (int i = 0; i < 20; ++i) {
    EXPECT_FALSE(filter.update(measure(0.0, 0.0, false, ScaleVerdict::kUnobservable)).apply);
  }
  const ScaleUpdate seen = filter.update(measure(0.0, 0.001));
  EXPECT_GT(seen.expected, 0.0);
  EXPECT_LT(seen.expected, step) << "and is forgotten on the way";
  EXPECT_DOUBLE_EQ(seen.innovation, -seen.expected);
}

TEST(ScaleDrift, ANewLockKnowsOfNoDrift) {
  ScaleFilter filter = locked_filter();
  double error = 0.0;
  for (int i = 0; i < 100; ++i) {
    error += 0.001;
    error -= filter.update(measure(error, 0.001)).log_scale_correction;
  }
  const ScaleUpdate cold = filter.update(measure(0.3, 0.001, true));
  EXPECT_GT(cold.expected, 0.0);
  EXPECT_DOUBLE_EQ(cold.log_scale_correction, 0.3) << "what is measured is taken whole";
  const ScaleUpdate update = filter.update(measure(0.004, 0.001));
  EXPECT_EQ(update.expected, 0.0);
  EXPECT_DOUBLE_EQ(update.innovation, 0.004);
}

}  // namespace
}  // namespace sovo
