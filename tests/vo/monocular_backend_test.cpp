#include "sovo/vo/monocular_backend.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sovo/geometry/pose_covariance.h"
#include "sovo/vo/direct_odometry.h"
#include "sovo/vo/features/feature_odometry.h"
#include "vo/drive_test_support.h"

namespace sovo {
namespace {

using namespace test;

enum class Kind { kDirect, kFeatures };

std::string name_of(const ::testing::TestParamInfo<Kind>& tested) {
  return tested.param == Kind::kDirect ? "Direct" : "Features";
}

std::unique_ptr<MonocularBackend> new_backend(Kind kind, WorkerPool* pool) {
  if (kind == Kind::kFeatures) {
    FeatureConfig config;
    config.features = 400;
    return std::make_unique<FeatureOdometry>(config, KeyframeConfig(), small_camera(), ImageU8(),
                                             pool);
  }
  DirectConfig config;
  config.points.active_points = 500;
  config.points.immature_points = 400;
  return std::make_unique<DirectOdometry>(config, small_camera(), ImageU8(), 0, pool);
}

/// What every monocular odometry owes to the stereo odometry that runs it, on a map of one keyframe
/// at the origin with true depths of a scene.
class Backend : public ::testing::TestWithParam<Kind> {
 protected:
  Backend() : pool_(1), vo_(new_backend(GetParam(), &pool_)) {
    first_ = frame_at(scene_, SE3(), 0);
    begin(first_, vo_.get());
  }

  void begin(const MonoFrame& frame, MonocularBackend* vo) const {
    std::vector<StartPoint> points;
    for (const SelectedPixel& pixel : vo->select_pixels(frame, 700)) {
      const auto rho =
          static_cast<float>(1.0 / scene_.depth(small_camera(), SE3(), Vec2(pixel.x, pixel.y)));
      points.push_back({pixel, {rho, 0.02F * rho}});
    }
    vo->begin(frame, SE3(), points, nullptr);
  }

  /// Takes frames of the drive until one becomes the keyframe `id`; returns the last frame's index.
  int drive_to_keyframe(std::size_t id, int first = 1) {
    int i = first;
    for (; vo_->keyframes().size() <= id && i < 60; ++i) {
      vo_->map(vo_->track(frame_at(scene_, drive(i), i), 0.0), {}, nullptr);
    }
    return i - 1;
  }

  SyntheticScene scene_{3};
  WorkerPool pool_;
  std::unique_ptr<MonocularBackend> vo_;
  MonoFrame first_;
};

TEST_P(Backend, UnrelatedImageIsLostAndTheMapGoesOn) {
  MonoFrame other = frame_at(scene_, SE3(), 1);
  ImageF checks(small_camera().width, small_camera().height);
  for (int y = 0; y < checks.height(); ++y) {
    for (int x = 0; x < checks.width(); ++x) {
      checks.at(x, y) = (x / 11 + y / 7) % 2 == 0 ? 10.0F : 240.0F;
    }
  }
  other.pyramid = pyramid_of(std::move(checks));
  EXPECT_FALSE(vo_->track(other, 0.0).tracking.good);
  EXPECT_TRUE(vo_->track(frame_at(scene_, SE3(SO3(), Vec3(0.02, 0, 0)), 2), 0.0).tracking.good);
}

TEST_P(Backend, APoseOutOfReachIsNone) {
  for (int i = 1; i <= 2; ++i) {
    const SE3 slow(SO3(), Vec3(0.01 * i, 0, 0));
    ASSERT_TRUE(vo_->track(frame_at(scene_, slow, i), 50.0).tracking.good);
  }
  // From 0.2 m/s to 6 m/s in one frame: 116 m/s^2.
  const MonoFrame leap = frame_at(scene_, SE3(SO3(), Vec3(0.32, 0, 0)), 3);
  const FrameTracking refused = vo_->track(leap, 50.0).tracking;
  EXPECT_FALSE(refused.good);
  EXPECT_TRUE(refused.out_of_reach);
  EXPECT_TRUE(vo_->track(leap, 140.0).tracking.good);
}

TEST_P(Backend, WhereMotionIsKnownItMayBeMoreThanAMeanDepth) {
  const double depth = 1.0 / vo_->reference()->mean_rho;
  const SE3 back(SO3(), Vec3(0.0, 0.0, -1.1 * depth));
  const MonoFrame frame = frame_at(scene_, back, 1);
  EXPECT_FALSE(vo_->track(frame, 0.0).tracking.good) << "nothing is known yet";
  const TrackedFrame there = vo_->track_from(frame, back.inverse());
  EXPECT_TRUE(there.tracking.good);
  const SE3 off = there.tracking.T_current_reference * back;
  EXPECT_LT(off.translation().norm(), 0.03 * depth);
}

TEST_P(Backend, WhereNoMotionIsKnownPixelsAreBelievedLessFar) {
  const bool direct = GetParam() == Kind::kDirect;
  for (const double way : {0.6, 0.8}) {
    vo_ = new_backend(GetParam(), &pool_);
    begin(first_, vo_.get());
    const SE3 back(SO3(), Vec3(0.0, 0.0, -way / vo_->reference()->mean_rho));
    const bool good = vo_->track(frame_at(scene_, back, 1), 0.0).tracking.good;
    EXPECT_EQ(good, !direct || way < 0.75) << way;
  }
}

TEST_P(Backend, NothingIsBelievedAMeanDepthFromTheReferenceAndFromWhereItIsExpected) {
  const auto at = [&](double depths) {
    return SE3(SO3(), Vec3(0.0, 0.0, -depths / vo_->reference()->mean_rho));
  };
  for (const double way : {0.97, 1.03}) {
    vo_ = new_backend(GetParam(), &pool_);
    begin(first_, vo_.get());
    ASSERT_TRUE(vo_->track_from(frame_at(scene_, at(0.6), 1), at(-0.6)).tracking.good);
    ASSERT_TRUE(vo_->track_from(frame_at(scene_, at(0.95), 2), at(-0.95)).tracking.good);
    // Ten frames are missing, in which it should have gone four depths on.
    const TrackedFrame stopped = vo_->track(frame_at(scene_, at(way), 13), 0.0);
    EXPECT_EQ(stopped.tracking.good, way < 1.0) << way;
  }
}

TEST_P(Backend, WhatWasTriedOnceMoreIsTakenBack) {
  // The frame after it is found as if nothing had been tried, to the bit.
  std::vector<SE3> found;
  for (const bool tries : {false, true}) {
    vo_ = new_backend(GetParam(), &pool_);
    begin(first_, vo_.get());
    vo_->track(frame_at(scene_, drive(1), 1), 0.0);
    const MonoFrame second = frame_at(scene_, drive(2), 2);
    const TrackedFrame before = vo_->track(second, 0.0);
    ASSERT_TRUE(before.tracking.good);
    if (tries) {
      const SE3 beside(SO3::exp(Vec3(0.0, 0.003, 0.0)), Vec3(0.005, 0.0, 0.0));
      ASSERT_TRUE(
          vo_->track_from(second, beside * before.tracking.T_current_reference).tracking.good);
      vo_->take_back();
    }
    found.push_back(vo_->track(frame_at(scene_, drive(3), 3), 0.0).T_world_camera);
  }
  EXPECT_EQ(found[0].translation(), found[1].translation());
  EXPECT_EQ(found[0].rotation().matrix(), found[1].rotation().matrix());
}

TEST_P(Backend, AFirstMotionOfManyPixelsIsFound) {
  // A vehicle may already move when the map begins.
  int index = 0;
  for (const Vec3& step : {Vec3(0.02, 0, 0.01), Vec3(0, 0, 0.6), Vec3(0.45, 0, 0)}) {
    begin(first_, vo_.get());
    const SE3 truth(SO3::exp(Vec3(0.004, -0.006, 0.002)), step);
    const TrackedFrame tracked = vo_->track(frame_at(scene_, truth, ++index), 0.0);
    ASSERT_TRUE(tracked.tracking.good) << step.transpose();
    const SE3 error = tracked.T_world_camera.inverse() * truth;
    EXPECT_LT(error.translation().norm(), 0.02) << step.transpose();
    EXPECT_LT(error.rotation().log().norm(), 0.004) << step.transpose();
  }
}

TEST_P(Backend, GrowsAlongADriveAndKeepsItsScaleInEverySimilarity) {
  // Corrections of scale in the middle: positions measured afterwards are in the new unit.
  double scale = 1.0;
  Vec3 shift = Vec3::Zero();
  std::size_t keyframes = 1;
  for (int i = 1; i <= 36; ++i) {
    const TrackedFrame tracked = vo_->track(frame_at(scene_, drive(i), i), 0.0);
    ASSERT_TRUE(tracked.tracking.good) << "frame " << i;
    const Vec3 expected = scale * drive(i).translation() + shift;
    EXPECT_LT((tracked.T_world_camera.translation() - expected).norm(), 0.03 * scale)
        << "frame " << i;
    const MapResult result = vo_->map(tracked, {}, nullptr);
    ASSERT_FALSE(result.failed);
    keyframes += result.is_keyframe ? 1 : 0;
    if (i == 12 || i == 18) {
      const double factor = i == 12 ? 1.4 : 0.6;
      ASSERT_TRUE(vo_->snapshot());
      ScaleCorrection correction;
      correction.keyframe_id = vo_->snapshot()->id;
      correction.scale_epoch = vo_->snapshot()->scale_epoch;
      correction.log_scale = vo_->log_scale() - vo_->snapshot()->log_scale + std::log(factor);
      const Vec3 fixed = vo_->keyframes().back().T_world_camera.translation();
      EXPECT_NEAR(vo_->apply(correction), std::log(factor), 1e-12);
      EXPECT_LT((vo_->keyframes().back().T_world_camera.translation() - fixed).norm(), 1e-9);
      shift = factor * shift + (1.0 - factor) * fixed;
      scale *= factor;
    }
  }
  EXPECT_NEAR(vo_->log_scale(), std::log(scale), 1e-12);
  EXPECT_GE(keyframes, 4U);
  EXPECT_EQ(vo_->keyframes().size(), keyframes);
  EXPECT_EQ(vo_->window_keyframes().front().id, vo_->oldest_in_window());
}

TEST_P(Backend, CovarianceIsCarriedOverEachStepAndGrowsByIt) {
  EXPECT_TRUE(vo_->reference()->covariance.isZero(0.0)) << "the first keyframe is the origin";
  Mat6 before = Mat6::Zero();  // of the keyframe before, where it is
  Vec3 position = vo_->reference()->T_world_camera.translation();
  int steps = 0;
  for (int i = 1; i <= 36; ++i) {
    const MapResult result = vo_->map(vo_->track(frame_at(scene_, drive(i), i), 0.0), {}, nullptr);
    if (!result.is_keyframe) continue;
    ++steps;
    const SE3 newest = vo_->reference()->T_world_camera;
    const Mat6 step = rotated(newest.rotation(), result.bundle.newest_covariance);
    EXPECT_GT(step.diagonal().minCoeff(), 0.0);
    const Mat6 expected = carried(before, newest.translation() - position) + step;
    before = carried(vo_->reference()->covariance, newest.translation());
    position = newest.translation();
    EXPECT_TRUE(before.isApprox(expected, 1e-9)) << before << "\n\n" << expected;
  }
  EXPECT_GE(steps, 3);
}

TEST_P(Backend, BeginsAnewWithoutWhatItHeld) {
  drive_to_keyframe(2);
  ASSERT_GT(vo_->keyframes().size(), 1U);
  const MonoFrame again = frame_at(scene_, SE3(), 61);
  begin(again, vo_.get());
  ASSERT_EQ(vo_->keyframes().size(), 1U);
  EXPECT_EQ(vo_->keyframes()[0].stamp_ns, again.stamp_ns);
  EXPECT_EQ(vo_->oldest_in_window(), 0U);
  EXPECT_FALSE(vo_->snapshot());
  ASSERT_EQ(vo_->window_keyframes().size(), 1U);
  const TrackedFrame tracked = vo_->track(frame_at(scene_, drive(1), 62), 0.0);
  ASSERT_TRUE(tracked.tracking.good);
  EXPECT_LT((tracked.T_world_camera.translation() - drive(1).translation()).norm(), 0.02);
}

TEST_P(Backend, CorrectionCountsLessWhatWasAppliedSinceItsSnapshot) {
  drive_to_keyframe(1);
  ASSERT_TRUE(vo_->snapshot());
  ScaleCorrection late;
  late.keyframe_id = vo_->snapshot()->id;
  late.scale_epoch = vo_->snapshot()->scale_epoch;
  late.log_scale = 0.3;
  EXPECT_NEAR(vo_->apply(late), 0.3, 1e-12);
  EXPECT_NEAR(vo_->apply(late), 0.0, 1e-12) << "the same measurement enters once";
  EXPECT_NEAR(vo_->reference()->log_scale, 0.3, 1e-12);
}

TEST_P(Backend, SnapshotShowsTheTrueDepths) {
  const int last = drive_to_keyframe(3);
  ASSERT_TRUE(vo_->snapshot());
  const KeyframeSnapshot& s = *vo_->snapshot();
  EXPECT_EQ(s.stamp_ns, frame_at(scene_, SE3(), last).stamp_ns);
  ASSERT_GT(s.points.size(), 50U);
  std::vector<double> errors;
  for (std::size_t k = 0; k < s.points.size(); ++k) {
    const Vec2 pixel(s.points.u[k], s.points.v[k]);
    const double depth = scene_.depth(small_camera(), drive(last), pixel);
    errors.push_back(std::abs(s.points.inverse_depth[k] * depth - 1.0));
    EXPECT_GT(s.points.sigma[k], 0.0F);
  }
  std::nth_element(errors.begin(), errors.begin() + errors.size() / 2, errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.03);
}

TEST_P(Backend, AnyTrackedFrameCanBeMadeAKeyframe) {
  // The second one of a start from two views must be one.
  TrackedFrame tracked = vo_->track_from(frame_at(scene_, drive(2), 2), drive(2).inverse());
  ASSERT_TRUE(tracked.tracking.good);
  tracked.wants_keyframe = true;
  const MapResult result = vo_->map(tracked, {}, nullptr);
  EXPECT_TRUE(result.is_keyframe);
  EXPECT_FALSE(result.failed);
  EXPECT_EQ(vo_->keyframes().size(), 2U);
}

TEST_P(Backend, AStaleFrameMakesNoKeyframe) {
  const TrackedFrame old = vo_->track(frame_at(scene_, drive(1), 1), 0.0);
  drive_to_keyframe(1, 2);
  TrackedFrame late = old;
  late.wants_keyframe = true;
  const std::size_t before = vo_->keyframes().size();
  EXPECT_FALSE(vo_->map(late, {}, nullptr).is_keyframe);
  EXPECT_EQ(vo_->keyframes().size(), before);
}

TEST_P(Backend, ThreadsChangeNoBit) {
  std::vector<MonoFrame> frames;
  for (int i = 0; i <= 12; ++i) frames.push_back(frame_at(scene_, drive(i), i));
  std::vector<Mat4> poses[2];
  for (const int threads : {1, 2}) {
    WorkerPool pool(threads);
    const auto vo = new_backend(GetParam(), &pool);
    begin(frames[0], vo.get());
    for (std::size_t i = 1; i < frames.size(); ++i) {
      const TrackedFrame tracked = vo->track(frames[i], 0.0);
      poses[threads - 1].push_back(tracked.T_world_camera.matrix());
      vo->map(tracked, {}, nullptr);
    }
    EXPECT_GE(vo->keyframes().size(), 2U);
  }
  ASSERT_EQ(poses[0].size(), 12U);
  for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(poses[0][i], poses[1][i]) << "frame " << i + 1;
}

INSTANTIATE_TEST_SUITE_P(Kinds, Backend, ::testing::Values(Kind::kDirect, Kind::kFeatures),
                         name_of);

}  // namespace
}  // namespace sovo
