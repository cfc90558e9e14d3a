#include "sovo/scale/scale_filter.h"

#include <gtest/gtest.h>

#include <cmath>

#include "scale/scale_filter_support.h"
#include "support/synthetic_scene.h"

namespace sovo {
namespace {

using test::locked_filter;
using test::measure;

TEST(ScaleFilter, NothingIsAppliedBeforeTheLock) {
  ScaleFilter filter({});
  EXPECT_FALSE(filter.locked());
  EXPECT_TRUE(filter.wants_cold_start());
  EXPECT_FALSE(filter.update(measure(0.3, 0.001)).apply);  // not a cold start
  EXPECT_FALSE(filter.update(measure(0.3, 0.001, true, ScaleVerdict::kOutOfRange)).apply);
  EXPECT_FALSE(filter.locked());
}

TEST(ScaleFilter, AnUnambiguousColdStartLocks) {
  ScaleFilter filter({});
  const ScaleUpdate update = filter.update(measure(1.7, 0.002, true));
  EXPECT_TRUE(update.apply);
  EXPECT_DOUBLE_EQ(update.log_scale_correction, 1.7);
  EXPECT_TRUE(filter.locked());
  EXPECT_FALSE(filter.wants_cold_start());
  EXPECT_NEAR(filter.sigma(), 0.002 * std::sqrt(ScaleFilterConfig().measurement_factor), 1e-12);
}

TEST(ScaleFilter, AmbiguousColdStartsLockWhenTwoAgree) {
  ScaleFilter filter({});
  const auto ambiguous = [](double s) { return measure(s, 0.002, true, ScaleVerdict::kAmbiguous); };
  EXPECT_FALSE(filter.update(ambiguous(1.0)).apply);
  EXPECT_FALSE(filter.update(ambiguous(1.4)).apply);  // disagrees
  EXPECT_FALSE(filter.locked());
  const ScaleUpdate update = filter.update(ambiguous(1.401));
  EXPECT_TRUE(update.apply);
  EXPECT_EQ(update.verdict, ScaleVerdict::kAccepted);
  EXPECT_TRUE(filter.locked());
}

TEST(ScaleFilter, ConvergesToTheScale) {
  ScaleFilterConfig config;
  config.measurement_factor = 1.0;
  ScaleFilter filter = locked_filter(config);
  double error = 0.03;
  for (int i = 0; i < 10; ++i) error -= filter.update(measure(error, 0.003)).log_scale_correction;
  EXPECT_LT(std::abs(error), 1e-5);
  EXPECT_LT(filter.sigma(), 0.004);
}

TEST(ScaleFilter, AWindowThatKeepsItsScaleIsOnlyWatched) {
  ScaleFilter filter = locked_filter();
  const double variance = 1e-6;
  for (int i = 1; i <= 20; ++i) {
    ScaleMeasurement m = measure(0.01, 0.001);  // a calibration that does not quite fit
    m.stamp_ns = i;
    const ScaleUpdate update = filter.watch(m, variance);
    EXPECT_FALSE(update.apply);
    EXPECT_EQ(update.verdict, ScaleVerdict::kAccepted);
  }
  EXPECT_FALSE(filter.wants_cold_start());
  EXPECT_DOUBLE_EQ(filter.sigma(), 1e-3);
  EXPECT_GT(filter.path_sigma(), 2e-3) << "keyframes share their error";
  EXPECT_NEAR(filter.age_s(20 + 1'000'000'000), 1.0, 1e-12);
}

TEST(ScaleFilter, AWatchedWindowWithAnotherScaleIsPutRightByAColdStart) {
  ScaleFilter filter = locked_filter();
  const double variance = 1e-6;
  int disagreements = 0;
  while (!filter.wants_cold_start() && disagreements < 10) {
    const ScaleUpdate update = filter.watch(measure(0.25, 0.002), variance);
    EXPECT_FALSE(update.apply);
    EXPECT_EQ(update.verdict, ScaleVerdict::kInnovation);
    EXPECT_GT(filter.sigma(), 0.02) << "either may be right";
    ++disagreements;
  }
  EXPECT_EQ(disagreements, ScaleFilterConfig().cold_start_after_agreeing);
  EXPECT_EQ(filter.watch(measure(0.25, 0.002, true, ScaleVerdict::kAmbiguous), variance).verdict,
            ScaleVerdict::kAmbiguous);
  const ScaleUpdate update = filter.watch(measure(0.25, 0.002, true), variance);
  EXPECT_TRUE(update.apply);
  EXPECT_DOUBLE_EQ(update.log_scale_correction, 0.25);
  EXPECT_EQ(update.verdict, ScaleVerdict::kAccepted);
  EXPECT_FALSE(filter.wants_cold_start());
}

TEST(ScaleFilter, WhatCannotBeSeenSpeaksNotAgainstAWatchedWindow) {
  ScaleFilter filter = locked_filter();
  for (int i = 0; i < 20; ++i) {
    const ScaleVerdict verdict =
        filter.watch(measure(0.0, 0.0, false, ScaleVerdict::kUnobservable), 1e-6).verdict;
    EXPECT_EQ(verdict, ScaleVerdict::kUnobservable);
  }
  EXPECT_EQ(filter.disagreements(), 0);
  EXPECT_FALSE(filter.wants_cold_start());
  for (int i = 0; i < 20; ++i) {
    filter.watch(measure(0.0, 0.002, false, ScaleVerdict::kTooFewInliers), 1e-6);
  }
  EXPECT_TRUE(filter.wants_cold_start());
}

TEST(ScaleFilter, WhatHoldsAScaleTellsOfItUntilTheNextMeasurement) {
  const ScaleMeasurement blind = measure(0.0, 0.0, false, ScaleVerdict::kTooFewPoints);
  ScaleFilter filter = locked_filter();
  ScaleFilter alone = locked_filter();
  for (int i = 1; i <= 20; ++i) {
    filter.update(blind);
    alone.update(blind);
    filter.hold(1e-5, i);
    EXPECT_DOUBLE_EQ(filter.sigma(), std::sqrt(1e-5));
    EXPECT_GT(filter.path_sigma(), 2e-3 + filter.sigma()) << "keyframes share their error";
    EXPECT_LT(filter.path_sigma(), alone.path_sigma());
  }
  EXPECT_GT(alone.sigma(), 0.02);
  EXPECT_NEAR(filter.age_s(20 + 1'000'000'000), 1.0, 1e-12);

  filter.update(blind);
  alone.update(blind);
  EXPECT_DOUBLE_EQ(filter.sigma(), alone.sigma()) << "not held any more";
  filter.hold(1e-5, 21);
  const ScaleUpdate update = filter.update(measure(0.02, 0.003));
  EXPECT_DOUBLE_EQ(update.gain, alone.update(measure(0.02, 0.003)).gain) << "it may err alike";
  EXPECT_DOUBLE_EQ(filter.sigma(), alone.sigma());
}

TEST(ScaleFilter, WhatHoldsAScaleWorseThanItIsKnownTellsNothing) {
  ScaleFilter filter = locked_filter();
  filter.update(measure(0.0, 0.003));
  const double sigma = filter.sigma();
  const double path_sigma = filter.path_sigma();
  filter.hold(1.0, 1);
  EXPECT_DOUBLE_EQ(filter.sigma(), sigma);
  EXPECT_DOUBLE_EQ(filter.path_sigma(), path_sigma);
}

TEST(ScaleFilter, NothingHoldsAScaleThatThereIsNot) {
  ScaleFilter filter({});
  filter.hold(1e-5, 1);
  EXPECT_FALSE(filter.locked());
  filter.lock_initial(0.03, 2);
  EXPECT_DOUBLE_EQ(filter.sigma(), 0.03);
}

TEST(ScaleFilter, AWatchedFilterLocksAsAnyOther) {
  ScaleFilter filter({});
  EXPECT_FALSE(filter.watch(measure(0.3, 0.001), 0.0).apply);
  EXPECT_TRUE(filter.watch(measure(1.7, 0.002, true), 0.0).apply);
  EXPECT_TRUE(filter.locked());
}

TEST(ScaleFilter, PendingCorrectionsAreNotAppliedTwice) {
  ScaleFilter filter = locked_filter();
  const double first = filter.update(measure(0.02, 0.001)).log_scale_correction;
  ScaleMeasurement m = measure(0.02, 0.001);
  m.pending_log_scale = first;  // the snapshot was made before the first was applied
  const ScaleUpdate second = filter.update(m);
  EXPECT_NEAR(first + second.log_scale_correction, 0.02, 1e-4);
  EXPECT_NEAR(second.innovation, 0.02 - first, 1e-12);
}

TEST(ScaleFilter, AnOutlierIsGated) {
  ScaleFilter filter = locked_filter();
  for (int i = 0; i < 20; ++i) filter.update(measure(0.0, 0.001));
  const ScaleUpdate update = filter.update(measure(0.2, 0.001));
  EXPECT_FALSE(update.apply);
  EXPECT_EQ(update.verdict, ScaleVerdict::kInnovation);
  EXPECT_EQ(filter.last_verdict(), ScaleVerdict::kInnovation);
  EXPECT_EQ(filter.disagreements(), 1);
  EXPECT_TRUE(filter.update(measure(0.001, 0.001)).apply);
  EXPECT_EQ(filter.disagreements(), 0);
}

TEST(ScaleFilter, SigmaCountsThatADisagreeingMeasurementMayBeRight) {
  ScaleFilter filter = locked_filter();
  for (int i = 0; i < 20; ++i) filter.update(measure(0.0, 0.001));
  const double sigma = filter.sigma();
  const double path_sigma = filter.path_sigma();
  filter.update(measure(0.04, 0.001));
  EXPECT_NEAR(filter.sigma(), 0.04 / std::sqrt(2.0), 1e-3);
  EXPECT_NEAR(filter.path_sigma(), 0.04 / std::sqrt(2.0), 1e-3);
  filter.update(measure(0.0, 0.001, false, ScaleVerdict::kTooFewInliers));
  EXPECT_GT(filter.sigma(), 0.02) << "nothing has been settled";
  filter.update(measure(0.3, 0.001));
  EXPECT_NEAR(filter.sigma(), 0.05 / std::sqrt(2.0), 1e-3) << "more does no window drift";
  EXPECT_TRUE(filter.update(measure(0.0, 0.001)).apply);
  EXPECT_LT(filter.sigma(), 2.0 * sigma);
  EXPECT_LT(filter.path_sigma(), 2.0 * path_sigma);
}

TEST(ScaleFilter, ANewCalibrationMayHaveAnotherScale) {
  ScaleFilter filter = locked_filter();
  for (int i = 0; i < 20; ++i) filter.update(measure(0.0, 0.001));
  EXPECT_EQ(filter.update(measure(0.05, 0.001)).verdict, ScaleVerdict::kInnovation);
  filter.widen(-0.05);
  EXPECT_GT(filter.sigma(), 0.05);
  EXPECT_GT(filter.path_sigma(), 0.05);
  const ScaleUpdate update = filter.update(measure(0.05, 0.001));
  EXPECT_EQ(update.verdict, ScaleVerdict::kAccepted);
  EXPECT_NEAR(update.log_scale_correction, 0.05, 0.001);
}

TEST(ScaleFilter, SixDisagreementsAskForAColdStart) {
  ScaleFilter filter = locked_filter();
  for (int i = 0; i < 20; ++i) filter.update(measure(0.0, 0.001));
  for (int i = 0; i < 6; ++i) {
    EXPECT_FALSE(filter.wants_cold_start());
    filter.update(measure(i % 2 == 0 ? 0.4 : -0.4, 0.001));
  }
  EXPECT_TRUE(filter.wants_cold_start());
  EXPECT_TRUE(filter.locked());
  const ScaleUpdate update = filter.update(measure(0.4, 0.001, true));
  EXPECT_TRUE(update.apply);
  EXPECT_DOUBLE_EQ(update.log_scale_correction, 0.4);
  EXPECT_FALSE(filter.wants_cold_start());
}

TEST(ScaleFilter, ThreeDisagreementsThatAgreeWithEachOtherAskForAColdStart) {
  ScaleFilter filter = locked_filter();
  for (int i = 0; i < 20; ++i) filter.update(measure(0.0, 0.001));
  for (const double wrong : {-0.4, 0.401, 0.399}) {
    filter.update(measure(wrong, 0.001));
    EXPECT_FALSE(filter.wants_cold_start());
  }
  filter.update(measure(0.4, 0.001));
  EXPECT_TRUE(filter.wants_cold_start());
  EXPECT_FALSE(filter.update(measure(0.4, 0.001, false, ScaleVerdict::kTooFewPoints)).apply);
  EXPECT_DOUBLE_EQ(filter.update(measure(0.4, 0.001, true)).log_scale_correction, 0.4);
  EXPECT_FALSE(filter.wants_cold_start());
}

TEST(ScaleFilter, TwoThatAgreeOutvoteAStartThatNoneHasConfirmed) {
  ScaleFilter filter = locked_filter();
  EXPECT_FALSE(filter.update(measure(0.1, 0.001)).apply);
  EXPECT_FALSE(filter.update(measure(-0.1, 0.001)).apply) << "they disagree";
  const ScaleUpdate update = filter.update(measure(-0.101, 0.001));
  EXPECT_TRUE(update.apply);
  EXPECT_DOUBLE_EQ(update.log_scale_correction, -0.101);
  EXPECT_EQ(filter.disagreements(), 0);
  // What they gave is not outvoted so.
  EXPECT_FALSE(filter.update(measure(0.1, 0.001)).apply);
  EXPECT_FALSE(filter.update(measure(0.1, 0.001)).apply);
}

TEST(ScaleFilter, AConfirmedStartIsNotOutvotedByTwo) {
  ScaleFilter filter = locked_filter();
  EXPECT_TRUE(filter.update(measure(0.001, 0.001)).apply);
  EXPECT_FALSE(filter.update(measure(-0.1, 0.001)).apply);
  EXPECT_FALSE(filter.update(measure(-0.1, 0.001)).apply);
}

TEST(ScaleFilter, AgreementBeginsAnewAfterAnAcceptedMeasurement) {
  ScaleFilter filter = locked_filter();
  for (int i = 0; i < 20; ++i) filter.update(measure(0.0, 0.001));
  for (int i = 0; i < 10; ++i) {
    filter.update(measure(0.4, 0.001));
    filter.update(measure(0.4, 0.001));
    EXPECT_TRUE(filter.update(measure(0.0, 0.001)).apply);
    EXPECT_FALSE(filter.wants_cold_start());
  }
}

TEST(ScaleFilter, AColdStartThatAgreesEndsTheDoubt) {
  ScaleFilter filter = locked_filter();
  for (int i = 0; i < 6; ++i) {
    filter.update(measure(0.0, 0.001, false, ScaleVerdict::kTooFewInliers));
  }
  EXPECT_TRUE(filter.wants_cold_start());
  EXPECT_TRUE(filter.update(measure(0.002, 0.001, true)).apply);
  EXPECT_FALSE(filter.wants_cold_start());
}

TEST(ScaleFilter, MissesCountNeitherForNorAgainst) {
  ScaleFilter filter = locked_filter();
  for (int i = 0; i < 20; ++i) filter.update(measure(0.0, 0.001));
  for (int i = 0; i < 5; ++i) filter.update(measure(i % 2 == 0 ? 0.4 : -0.4, 0.001));
  const double before = filter.sigma();
  for (const ScaleVerdict miss :
       {ScaleVerdict::kTooFewPoints, ScaleVerdict::kUnobservable, ScaleVerdict::kNoRightImage}) {
    for (int i = 0; i < 10; ++i) EXPECT_FALSE(filter.update(measure(0, 0, false, miss)).apply);
  }
  EXPECT_EQ(filter.disagreements(), 5);
  EXPECT_FALSE(filter.wants_cold_start());
  EXPECT_GT(filter.sigma(), before);  // the scale walks on unseen
  EXPECT_EQ(filter.last_verdict(), ScaleVerdict::kNoRightImage);
}

TEST(ScaleFilter, PointsThatAreLongOutsideTheRightImageAskForAColdStart) {
  ScaleFilter filter = locked_filter();
  ScaleMeasurement outside = measure(0.0, 0.0, false, ScaleVerdict::kTooFewPoints);
  outside.estimate.out_of_view = true;
  for (int round = 0; round < 3; ++round) {  // in a row, or it does not count
    for (int i = 0; i < 5; ++i) EXPECT_FALSE(filter.update(outside).apply);
    EXPECT_FALSE(filter.wants_cold_start());
    filter.update(measure(0.0, 0.001));
  }
  for (int i = 0; i < 6; ++i) filter.update(outside);
  EXPECT_TRUE(filter.wants_cold_start());
  EXPECT_DOUBLE_EQ(filter.update(measure(1.6, 0.001, true)).log_scale_correction, 1.6);
  EXPECT_FALSE(filter.wants_cold_start());
}

TEST(ScaleFilter, AgeCountsFromTheLastAcceptedKeyframe) {
  ScaleFilter filter = locked_filter();
  ScaleMeasurement m = measure(0.0, 0.001);
  m.stamp_ns = 2'000'000'000;
  filter.update(m);
  m = measure(0.0, 0.001, false, ScaleVerdict::kUnobservable);
  m.stamp_ns = 3'000'000'000;
  filter.update(m);
  EXPECT_DOUBLE_EQ(filter.age_s(3'500'000'000), 1.5);
}

/// Mean of error^2 / sigma^2 over a random walk, and of the summed error over the path's sigma.
struct Consistency {
  double nees = 0.0;
  double path_nees = 0.0;
};

Consistency simulate(double correlation, double shared, double q_true) {
  Consistency out;
  const int runs = 60;
  const int keyframes = 200;
  for (unsigned run = 0; run < runs; ++run) {
    std::mt19937 random(run + 1);
    ScaleFilter filter = locked_filter();
    double error = 0.02 * test::normal(random);
    double noise = test::normal(random);
    double sum = 0.0;
    double variance = 0.0;
    for (int i = 0; i < keyframes; ++i) {
      error += std::sqrt(0.1 * q_true) * test::normal(random);
      noise =
          correlation * noise + std::sqrt(1.0 - correlation * correlation) * test::normal(random);
      ScaleMeasurement m = measure(error + 0.003 * noise, 0.003);
      m.shared_points = shared;
      error -= filter.update(m).log_scale_correction;
      sum += error;
      variance += filter.path_sigma() * filter.path_sigma();
      out.nees += error * error / (filter.sigma() * filter.sigma()) / (runs * keyframes);
    }
    out.path_nees += sum * sum / variance / runs;
  }
  return out;
}

TEST(ScaleFilter, SigmaIsHonest) {
  for (const double q : {1e-4, 3e-4, 1e-3}) {
    const Consistency found = simulate(0.0, 0.0, q);
    EXPECT_GT(found.nees, 0.6) << q;
    EXPECT_LT(found.nees, 1.6) << q;
    EXPECT_GT(found.path_nees, 0.4) << q;
    EXPECT_LT(found.path_nees, 2.5) << q;  // the process noise is still being learned
  }
}

TEST(ScaleFilter, SigmaCountsCorrelationOfSharedPoints) {
  const Consistency found = simulate(0.7, 0.7 / 0.85, 3e-4);
  EXPECT_GT(found.nees, 0.4);
  EXPECT_LT(found.nees, 1.8);
  EXPECT_GT(found.path_nees, 0.4);
  EXPECT_LT(found.path_nees, 2.5);
}

/// The filter's errors over keyframes whose scale walks by `walk` and is measured with `noise`,
/// while the optimizer claims 0.002.
double rms_error(double walk, double noise, ScaleFilter* filter) {
  std::mt19937 random(5);
  double error = 0.0;
  double sum = 0.0;
  constexpr int kKeyframes = 400;
  constexpr int kLearning = 100;
  for (int i = 0; i < kKeyframes; ++i) {
    error += walk * test::normal(random);
    error -=
        filter->update(measure(error + noise * test::normal(random), 0.002)).log_scale_correction;
    if (i >= kLearning) sum += error * error;
  }
  return std::sqrt(sum / (kKeyframes - kLearning));
}

TEST(ScaleFilter, LearnsFromAlternatingInnovationsThatMeasurementsAreWorseThanClaimed) {
  ScaleFilter filter = locked_filter();
  // A steady scale under noise four times as large as claimed: most of it must be averaged out.
  EXPECT_LT(rms_error(0.0003, 0.008, &filter), 0.4 * 0.008);
  EXPECT_GT(filter.measurement_factor(), 8.0);
}

TEST(ScaleFilter, LearnsFromTrendingInnovationsThatTheScaleWalks) {
  ScaleFilter filter = locked_filter();
  // A walking scale, measured well: the correction must follow it, not lag.
  EXPECT_LT(rms_error(0.008, 0.001, &filter), 0.5 * 0.008);
  EXPECT_GT(filter.process_noise(), 3.0 * ScaleFilterConfig().process_noise);
}

TEST(ScaleFilter, LearnsTheProcessNoiseWithinBounds) {
  ScaleFilterConfig config;
  std::mt19937 random(2);
  ScaleFilter restless = locked_filter(config);
  for (int i = 0; i < 400; ++i) restless.update(measure(0.03 * test::normal(random), 0.001));
  EXPECT_GT(restless.process_noise(), 3.0 * config.process_noise);
  EXPECT_LE(restless.process_noise(), config.max_process_noise);
  ScaleFilter calm = locked_filter(config);
  for (int i = 0; i < 400; ++i) calm.update(measure(0.0, 0.001));
  EXPECT_DOUBLE_EQ(calm.process_noise(), config.min_process_noise);
  calm.reset();
  EXPECT_FALSE(calm.locked());
  EXPECT_DOUBLE_EQ(calm.process_noise(), config.min_process_noise);
}

}  // namespace
}  // namespace sovo
