#include "sovo/eval/scale_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "sovo/eval/nees.h"

namespace sovo {
namespace {

std::vector<int> all_of(std::size_t n) {
  std::vector<int> indices(n);
  std::iota(indices.begin(), indices.end(), 0);
  return indices;
}

TEST(ScaleError, ConstantScaleIsRecovered) {
  std::vector<SE3> truth;
  std::vector<SE3> estimate;
  for (int i = 0; i < 100; ++i) {
    truth.push_back({SO3(), Vec3(std::sin(0.1 * i), 0.0, i)});
    estimate.push_back({SO3(), truth.back().translation() / 1.05});
  }
  const auto samples = scale_errors(truth, estimate, all_of(100), 10.0);
  ASSERT_GT(samples.size(), 80U);
  const ScaleErrorSummary sum = summarize(samples);
  EXPECT_NEAR(sum.median_abs, std::log(1.05), 1e-12);
  EXPECT_NEAR(sum.p95_abs, std::log(1.05), 1e-12);
  EXPECT_NEAR(sum.bias, std::log(1.05), 1e-12);
  EXPECT_NEAR(sum.drift_per_100m, 0.0, 1e-10);
}

TEST(ScaleError, DriftIsTheSlopeOverDistance) {
  std::vector<SE3> truth{SE3()};
  std::vector<SE3> estimate{SE3()};
  for (int i = 0; i < 1000; ++i) {
    truth.push_back({SO3(), truth.back().translation() + Vec3(0.0, 0.0, 1.0)});
    const double s = std::exp(0.02 * i / 100.0);
    estimate.push_back({SO3(), estimate.back().translation() + Vec3(0.0, 0.0, 1.0 / s)});
  }
  const auto sum = summarize(scale_errors(truth, estimate, all_of(truth.size()), 10.0));
  EXPECT_NEAR(sum.drift_per_100m, 0.02, 1e-6);
}

TEST(ScaleError, UsesOnlyTheGivenStarts) {
  std::vector<SE3> truth;
  for (int i = 0; i < 40; ++i) truth.push_back({SO3(), Vec3(i, 0.0, 0.0)});
  const std::vector<int> keyframes{0, 7, 12, 30};
  const auto samples = scale_errors(truth, truth, keyframes, 10.0);
  ASSERT_EQ(samples.size(), 3U);
  EXPECT_EQ(samples[0].last, 12);
  EXPECT_EQ(samples[1].last, 30);
  EXPECT_EQ(samples[1].distance, 7.0);
}

TEST(ScaleError, StandingStillGivesNoSample) {
  const std::vector<SE3> still(50);
  EXPECT_TRUE(scale_errors(still, still, all_of(50), 0.5).empty());
  EXPECT_EQ(summarize(std::span<const ScaleSample>()).count, 0);
}

TEST(Nees, IsTheMahalanobisDistance) {
  const Vec2 error(1.0, 2.0);
  Mat2 covariance;
  covariance << 4.0, 0.0, 0.0, 1.0;
  EXPECT_NEAR(nees<2>(error, covariance), 0.25 + 4.0, 1e-12);
  EXPECT_TRUE(std::isnan(nees<2>(error, -covariance)));
}

TEST(Nees, SummaryBoundsAreThoseOfChiSquare) {
  std::vector<double> errors(100, 0.02);
  std::vector<double> sigmas(100, 0.01);
  errors.push_back(1.0);
  sigmas.push_back(0.0);
  errors.push_back(std::numeric_limits<double>::quiet_NaN());
  sigmas.push_back(1.0);
  const NeesSummary sum = nees_summary(errors, sigmas);
  EXPECT_EQ(sum.count, 100);
  EXPECT_NEAR(sum.mean, 4.0, 1e-12);
  // Tables: chi-square of 100 degrees of freedom, 2.5 % and 97.5 %: 74.222 and 129.561.
  EXPECT_NEAR(sum.lower95, 0.74222, 1e-3);
  EXPECT_NEAR(sum.upper95, 1.29561, 1e-3);
}

}  // namespace
}  // namespace sovo
