#include <gtest/gtest.h>

#include <stdexcept>

#include "odometry/odometry_test_support.h"
#include "sovo/odometry/stereo_odometry.h"

namespace sovo {
namespace {

using namespace test;

class LiveThreadsOf : public ::testing::TestWithParam<Backend> {};

TEST_P(LiveThreadsOf, EitherBackendFollowTheDriveToo) {
  StereoOdometryConfig config = test_config();
  config.backend = GetParam();
  config.deterministic = false;
  config.threads = 2;
  config.wait_for_mapping = true;
  Playback run(config);
  run.give_drive(0, kDriveFrames);
  run.odometry.finish();
  EXPECT_EQ(run.recorder.frames.back().dropped_queue, 0U);
  expect_follows_the_drive(published(run.recorder), 0.02, 0.04);
  EXPECT_EQ(run.odometry.refined_trajectory().size(), static_cast<std::size_t>(kDriveFrames));
  expect_follows_the_drive(run.odometry.refined_trajectory(), 0.02, 0.04);
  EXPECT_GE(run.recorder.keyframes.size(), 3U);
  // A scale job that is overtaken by the next keyframe is left out.
  EXPECT_GE(run.recorder.scales.size(), 1U);
}

INSTANTIATE_TEST_SUITE_P(Backends, LiveThreadsOf,
                         ::testing::Values(Backend::kDirect, Backend::kFeatures));

TEST(StereoOdometry, FeaturesHaveNoModeStereo) {
  StereoOdometryConfig config = test_config();
  config.backend = Backend::kFeatures;
  config.mode = OdometryMode::kStereo;
  EXPECT_THROW(Playback run(config), std::invalid_argument);
}

}  // namespace
}  // namespace sovo
