#include "sovo/vo/map_history.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sovo/geometry/pose_covariance.h"

namespace sovo {
namespace {

std::vector<WindowPose> window_of(double scale) {
  return {{0, 10, SE3(SO3(), Vec3(0, 0, -2.0 * scale + 2.0))}, {1, 20, SE3(SO3(), Vec3(0, 0, 2))}};
}

TEST(MapHistory, ALateCorrectionCountsLessWhatWasAppliedSince) {
  MapHistory history;
  history.record(window_of(1.0));
  ScaleCorrection correction;
  correction.log_scale = 0.3;
  EXPECT_DOUBLE_EQ(history.still_to_apply(correction), 0.3);
  history.note_similarity(0.2, false, window_of(std::exp(0.2)));
  EXPECT_NEAR(history.still_to_apply(correction), 0.1, 1e-12) << "of the snapshot's epoch";
  EXPECT_EQ(history.scale_epoch(), 1U);
  correction.scale_epoch = 1;
  EXPECT_DOUBLE_EQ(history.still_to_apply(correction), 0.3) << "of a newer one";
}

TEST(MapHistory, TheFirstScaleChangesTheUnitOfTheCovariance) {
  MapHistory history;
  history.record(window_of(1.0));
  const SE3 newest = window_of(1.0).back().T_world_camera;
  const Mat6 step = Vec6(1e-4, 2e-4, 3e-4, 1e-6, 2e-6, 3e-6).asDiagonal();
  history.extend_covariance(newest, step);
  const Mat6 before = carried(history.covariance(), newest.translation());
  EXPECT_LT((before - step).norm(), 1e-12);
  history.note_similarity(std::log(3.0), true, window_of(3.0));
  const Mat6 first = carried(history.covariance(), newest.translation());
  EXPECT_LT((first.topLeftCorner<3, 3>() - 9.0 * before.topLeftCorner<3, 3>()).norm(), 1e-12);
  EXPECT_LT((first.bottomRightCorner<3, 3>() - before.bottomRightCorner<3, 3>()).norm(), 1e-15);
  history.note_similarity(0.1, false, window_of(3.0));
  EXPECT_EQ(carried(history.covariance(), newest.translation()), first)
      << "a later one mends an error, which the scale's sigma counts";
}

TEST(MapHistory, ANewBeginningForgetsPosesAndKeepsTheEpochs) {
  MapHistory history;
  history.record(window_of(1.0));
  history.extend_covariance(SE3(), Mat6::Identity());
  history.note_similarity(0.5, false, window_of(1.0));
  history.clear();
  EXPECT_TRUE(history.keyframes().empty());
  EXPECT_TRUE(history.covariance().isZero(0.0));
  EXPECT_DOUBLE_EQ(history.log_scale(), 0.5);
  EXPECT_EQ(history.scale_epoch(), 1U);
}

}  // namespace
}  // namespace sovo
