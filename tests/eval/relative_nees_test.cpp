#include "sovo/eval/relative_nees.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "sovo/geometry/pose_covariance.h"

namespace sovo {
namespace {

constexpr std::int64_t kPeriodNs = 100'000'000;

/// Estimates of steps of a metre that turn, each with an error of its own, and each pose with
/// another that no later one inherits; fifty poses a segment.
class RelativeNees : public ::testing::Test {
 protected:
  void SetUp() override {
    std::mt19937 generator(3);
    const Vec6 step_sigma = (Vec6() << 0.02, 0.01, 0.03, 0.002, 0.004, 0.001).finished();
    const Vec6 own_sigma = (Vec6() << 0.001, 0.002, 0.001, 0.001, 0.001, 0.002).finished();
    const auto draw = [&](const Vec6& sigma) {
      std::normal_distribution<double> normal;
      Vec6 error;
      for (int i = 0; i < 6; ++i) error[i] = sigma[i] * normal(generator);
      return error;
    };
    const auto covariance_of = [](const Vec6& sigma) {
      return Mat6(sigma.cwiseAbs2().asDiagonal());
    };
    SE3 chain;
    SE3 truth;
    Mat6 covariance = Mat6::Zero();
    for (int i = 0; i < 3000; ++i) {
      if (i % 50 == 0) {
        chain = truth = SE3();
        covariance.setZero();
      }
      const std::int64_t stamp = i * kPeriodNs;
      const Vec6 own = draw(own_sigma);
      const SE3 published(chain.rotation() * SO3::exp(own.tail<3>()), chain * Vec3(own.head<3>()));
      const Mat6 own_covariance = rotated(chain.rotation(), covariance_of(own_sigma));
      poses_.push_back({stamp, static_cast<std::uint32_t>(i / 50), published,
                        covariance + own_covariance, own_covariance});
      truth_.push_back({stamp, truth});
      const SE3 step(SO3::exp(Vec3(0.01, 0.05 * std::sin(0.1 * i), 0.02)), Vec3(1, 0.1, 0));
      const Vec6 error = draw(step_sigma);
      const Vec3 before = chain.translation();
      truth = truth * step;
      chain =
          chain * SE3(step.rotation() * SO3::exp(error.tail<3>()), step * Vec3(error.head<3>()));
      covariance = carried(covariance, chain.translation() - before) +
                   rotated(chain.rotation(), covariance_of(step_sigma));
    }
  }

  std::vector<UncertainPose> poses_;
  Trajectory truth_;
};

TEST_F(RelativeNees, IsOneWhereTheClaimsAreHonest) {
  EXPECT_NEAR(relative_nees(poses_, truth_, {.seconds = 1.0}), 1.0, 0.1);
  EXPECT_NEAR(relative_nees(poses_, truth_, {.metres = 25.0}), 1.0, 0.15);
  EXPECT_NEAR(relative_nees(poses_, truth_, {.seconds = 0.1}), 1.0, 0.1);
}

TEST_F(RelativeNees, TellsTooBoldClaimsFromTooTimidOnes) {
  const double honest = relative_nees(poses_, truth_, {.seconds = 1.0});
  for (UncertainPose& pose : poses_) {
    pose.covariance *= 4.0;
    pose.frame_covariance *= 4.0;
  }
  EXPECT_NEAR(relative_nees(poses_, truth_, {.seconds = 1.0}), 0.25 * honest, 1e-6);
}

TEST_F(RelativeNees, AFewPosesThatClaimLessLaterAreLeftOutAndManyAreNot) {
  const double honest = relative_nees(poses_, truth_, {.seconds = 1.0});
  for (std::size_t i = 0; i < poses_.size(); i += 100) poses_[i].covariance *= 1e6;
  EXPECT_NEAR(relative_nees(poses_, truth_, {.seconds = 1.0}), honest, 0.1);
  for (std::size_t i = 0; i < poses_.size(); i += 15) poses_[i].covariance *= 1e6;
  EXPECT_TRUE(std::isnan(relative_nees(poses_, truth_, {.seconds = 1.0})));
}

TEST_F(RelativeNees, ComparesNoPosesOfTwoSegmentsAndNoneWithoutTruth) {
  EXPECT_TRUE(std::isnan(relative_nees(poses_, truth_, {.metres = 60.0})));
  for (StampedPose& pose : truth_) pose.stamp_ns += kPeriodNs / 2;
  EXPECT_TRUE(std::isnan(relative_nees(poses_, truth_, {.seconds = 1.0})));
  for (StampedPose& pose : truth_) pose.stamp_ns -= kPeriodNs / 2;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    poses_[i].segment = static_cast<std::uint32_t>(i % 2);
  }
  EXPECT_TRUE(std::isnan(relative_nees(poses_, truth_, {.seconds = 1.0})));
}

}  // namespace
}  // namespace sovo
