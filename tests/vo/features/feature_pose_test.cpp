#include "sovo/vo/features/feature_pose.h"

#include <gtest/gtest.h>

#include <cmath>

#include "vo/features/feature_test_support.h"

namespace sovo {
namespace {

using namespace test;

/// Matches of a frame at `truth`, with errors of pixel and depth.
std::vector<FeatureMatch> matches_at(const SE3& truth, int n, double sigma, double depth_error,
                                     std::mt19937& random) {
  const CameraModel camera = feature_camera();
  std::vector<FeatureMatch> out;
  while (static_cast<int>(out.size()) < n) {
    FeatureMatch m;
    m.T_reference_host = feature_pose(3) * feature_pose(0).inverse();
    m.ray = ray_of(camera, uniform(random, 0.0, 640.0), uniform(random, 0.0, 480.0));
    const double rho = 1.0 / uniform(random, 2.0, 10.0);
    if (!reproject(camera, truth * m.T_reference_host, m.ray, rho, &m.pixel)) continue;
    m.pixel += sigma * Vec2(normal(random), normal(random));
    m.sigma = sigma;
    m.rho_sigma = depth_error * rho;
    m.rho = rho + m.rho_sigma * normal(random);
    out.push_back(m);
  }
  return out;
}

const SE3 kTruth(SO3::exp(Vec3(0.03, -0.05, 0.02)), Vec3(0.2, -0.1, 0.3));

TEST(FeaturePose, IsFoundAmongOutliers) {
  std::mt19937 random(1);
  std::vector<FeatureMatch> matches = matches_at(kTruth, 200, 0.3, 0.01, random);
  for (std::size_t i = 0; i < 80; ++i) {
    matches[i].pixel = Vec2(uniform(random, 0.0, 640.0), uniform(random, 0.0, 480.0));
  }
  const FeaturePose pose = estimate_pose(feature_camera(), matches, SE3(), 3.0);
  EXPECT_LT((pose.T_current_reference * kTruth.inverse()).log().norm(), 0.005);
  EXPECT_GE(pose.inliers, 112);
  EXPECT_LE(pose.inliers, 125);
  for (std::size_t i = 80; i < 100; ++i) EXPECT_TRUE(pose.inlier[i] || pose.inliers < 120);
}

TEST(FeaturePose, CovarianceIsHonestWhereDepthsErrMoreThanPixels) {
  std::mt19937 random(2);
  double nees = 0.0;
  constexpr int kFrames = 60;
  for (int i = 0; i < kFrames; ++i) {
    const FeaturePose pose =
        estimate_pose(feature_camera(), matches_at(kTruth, 120, 0.3, 0.1, random), kTruth, 3.0);
    const Vec6 error = (pose.T_current_reference * kTruth.inverse()).log();
    nees += error.dot(pose.covariance.inverse() * error) / 6.0;
  }
  EXPECT_GT(nees / kFrames, 0.6);
  EXPECT_LT(nees / kFrames, 1.6);
}

TEST(FeaturePose, TooFewMatchesGiveNone) {
  std::mt19937 random(3);
  const FeaturePose pose =
      estimate_pose(feature_camera(), matches_at(kTruth, 5, 0.3, 0.0, random), SE3(), 3.0);
  EXPECT_EQ(pose.inliers, 0);
  EXPECT_EQ(pose.inlier.size(), 5U);
}

}  // namespace
}  // namespace sovo
