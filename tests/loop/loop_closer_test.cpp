#include "sovo/loop/loop_closer.h"

#include <gtest/gtest.h>

#include <map>

#include "place/place_test_support.h"
#include "sovo/geometry/pose_covariance.h"
#include "sovo/image/halving.h"

namespace sovo {
namespace {

constexpr int kLap = 24;  // keyframes
constexpr double kStepMetres = 0.01;
constexpr double kStepRadians = 0.004;

StereoRig small_rig() {
  StereoRig rig;
  rig.left = test::make_camera(240, 180, 195, 195, 119.2, 90.6);
  rig.right = test::make_camera(240, 180, 199, 198, 121.0, 88.3);
  rig.T_right_left = SE3(SO3::exp(Vec3(0.004, -0.003, 0.006)), Vec3(-0.11, 0.002, 0.0));
  return rig;
}

/// Around the room in laps, looking about; the second lap a little beside the first.
SE3 lap_pose(int i) {
  const double angle = 2.0 * M_PI * i / kLap;
  const double aside = 0.03 * (i / kLap);
  return {SO3::exp(Vec3(0.0, 0.5 * std::sin(angle), 0.1 * std::sin(2.0 * angle))),
          Vec3(0.9 * std::cos(angle) + aside, 0.1 * std::sin(angle) - aside,
               -1.0 + 0.9 * std::sin(angle))};
}

struct Views {
  ImagePyramidPtr left, right;
};

/// What the cameras see at keyframe `i`, halved so often; rendered once a program.
const Views& views_of(int i, int halvings) {
  static const test::SyntheticScene scene(3);
  static std::map<std::pair<int, int>, Views> rendered;
  Views& views = rendered[{i, halvings}];
  if (views.left) return views;
  const StereoRig rig = small_rig();
  const SE3 pose = lap_pose(i);
  const auto pyramid_of = [halvings](ImageF image) {
    for (int h = 0; h < halvings; ++h) {
      ImageF half;
      halve(image, &half);
      image = std::move(half);
    }
    const int levels = ImagePyramid::num_levels_for(image.width(), image.height());
    return std::make_shared<const ImagePyramid>(std::move(image), levels);
  };
  views.left = pyramid_of(scene.render(rig.left, pose));
  views.right = pyramid_of(scene.render(rig.right, pose * rig.T_right_left.inverse()));
  return views;
}

/// An odometry that errs at random in every step, and says by how much.
class DriftingOdometry {
 public:
  explicit DriftingOdometry(unsigned seed) : random_(seed) {}

  /// Its images are halved so often from now on.
  void halve_images(int halvings) { halvings_ = halvings; }

  /// Keyframe `i`, as it is new; `first`: of a segment, whose poses go on from `T_odom_left`.
  KeyframeOutput next(int i) {
    KeyframeOutput out;
    if (!last_) {
      pose_ = begin_;
      covariance_.setZero();
    } else {
      Vec6 sigma;
      sigma << Vec3::Constant(kStepMetres), Vec3::Constant(kStepRadians);
      Vec6 noise;
      for (int k = 0; k < 6; ++k) noise[k] = sigma[k] * test::normal(random_);
      const SE3 before = pose_;
      pose_ = pose_ * lap_pose(*last_).inverse() * lap_pose(i) * SE3::exp(noise);
      const Mat6 Q = sigma.cwiseProduct(sigma).asDiagonal();
      covariance_ = carried(covariance_, pose_.translation() - before.translation()) +
                    rotated(pose_.rotation(), Q);
    }
    last_ = i;
    out.id = id_++;
    out.segment = segment_;
    out.stamp_ns = 100'000'000LL * (i + 1);
    out.scale_valid = true;
    out.T_odom_left = pose_;
    out.covariance = covariance_;
    out.inverse_depth = std::vector<float>(10, 0.3F);
    out.left = views_of(i, halvings_).left;
    out.right = views_of(i, halvings_).right;
    out.halvings = halvings_;
    trajectory_.push_back({out.stamp_ns, pose_});
    truth_.push_back(lap_pose(0).inverse() * lap_pose(i));
    return out;
  }

  /// The next keyframe begins another segment, at a pose that has nothing to do with the last.
  void lose(const SE3& T_odom_left) {
    last_.reset();
    begin_ = T_odom_left;
    ++segment_;
    id_ = 0;
  }

  const std::vector<TrajectoryPose>& trajectory() const { return trajectory_; }

  double rms(const std::vector<TrajectoryPose>& poses) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      sum += (poses[i].T_odom_left.translation() - truth_[i].translation()).squaredNorm();
    }
    return std::sqrt(sum / static_cast<double>(poses.size()));
  }

 private:
  std::mt19937 random_;
  SE3 begin_, pose_;
  std::optional<int> last_;
  Mat6 covariance_ = Mat6::Zero();
  std::uint32_t segment_ = 0, id_ = 0;
  int halvings_ = 0;
  std::vector<TrajectoryPose> trajectory_;
  std::vector<SE3> truth_;
};

LoopConfig small_config() {
  LoopConfig config;
  config.enabled = true;
  config.min_gap = 10;
  config.keypoints.per_image = 300;
  config.place_step = 0.02;
  return config;
}

LoopCloser make_closer(const LoopConfig& config = small_config()) {
  return {config, StaticMatcherConfig(), small_rig(), ImageU8()};
}

TEST(LoopCloser, TheSecondLapTakesTheDriftAway) {
  double before = 0.0;
  double after = 0.0;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    DriftingOdometry odometry(seed);
    LoopCloser closer = make_closer();
    std::uint64_t closures = 0;
    for (int i = 0; i < 2 * kLap; ++i) {
      const KeyframeOutput keyframe = odometry.next(i);
      const auto closure = closer.add(keyframe);
      if (!closure) continue;
      ++closures;
      EXPECT_EQ(closure->newer_stamp_ns, keyframe.stamp_ns);
      EXPECT_LT(closure->older_stamp_ns, keyframe.stamp_ns);
      EXPECT_GE(closure->inliers, small_config().matching.min_inliers);
    }
    closer.finish();
    EXPECT_GT(closures, 5U);
    EXPECT_EQ(closer.counts().places, 2U * kLap);
    EXPECT_EQ(closer.counts().refused, 0U);
    before += odometry.rms(odometry.trajectory());
    after += odometry.rms(closer.corrected(odometry.trajectory()));
    // The newest place stands in `map` where T_map_odom has it.
    const SE3 newest = closer.T_map_odom() * odometry.trajectory().back().T_odom_left;
    EXPECT_LT((closer.corrected_places().back().T_odom_left.inverse() * newest).log().norm(), 1e-9);
  }
  EXPECT_LT(after, 0.5 * before) << before / 3 << " m before, " << after / 3 << " m after";
}

TEST(LoopCloser, WhatMovesAlongWithTheCameraIsNoLandmark) {
  // All of it: nothing is recognized. The left half: the rest still is.
  for (const int columns : {240, 120}) {
    auto mask = std::make_shared<ImageU8>(240, 180);
    mask->fill(255);
    for (int y = 0; y < 180; ++y) std::fill_n(mask->row(y), columns, std::uint8_t{0});
    DriftingOdometry odometry(1);
    LoopCloser closer = make_closer();
    for (int i = 0; i < 2 * kLap; ++i) {
      KeyframeOutput keyframe = odometry.next(i);
      keyframe.co_moving_mask = mask;
      closer.add(keyframe);
    }
    EXPECT_EQ(closer.counts().places, 2U * kLap);
    EXPECT_EQ(closer.counts().matched > 0, columns < 240) << columns;
  }
}

TEST(LoopCloser, WithoutALoopTheTrajectoryStaysToTheBit) {
  DriftingOdometry odometry(1);
  LoopCloser closer = make_closer();
  for (int i = 0; i < kLap - 4; ++i) EXPECT_FALSE(closer.add(odometry.next(i)).has_value());
  closer.finish();
  const auto corrected = closer.corrected(odometry.trajectory());
  ASSERT_EQ(corrected.size(), odometry.trajectory().size());
  for (std::size_t i = 0; i < corrected.size(); ++i) {
    EXPECT_EQ(corrected[i].T_odom_left.matrix(), odometry.trajectory()[i].T_odom_left.matrix());
  }
  EXPECT_EQ(closer.T_map_odom().matrix(), Mat4::Identity());
}

TEST(LoopCloser, WhatTheOdometryRulesOutIsNoLoop) {
  // The same views again, but the odometry knows that it has gone five metres on.
  constexpr int kGap = 18;
  LoopConfig config = small_config();
  config.min_gap = kGap;
  DriftingOdometry odometry(1);
  LoopCloser closer = make_closer(config);
  for (int i = 0; i < 2 * kGap; ++i) {
    KeyframeOutput keyframe = odometry.next(i);
    if (i >= kGap) keyframe.T_odom_left.translation() += Vec3(5.0, 0.0, 0.0);
    EXPECT_FALSE(closer.add(keyframe).has_value());
  }
  EXPECT_GT(closer.counts().refused, 5U);
  EXPECT_EQ(closer.counts().closures, 0U);
}

TEST(LoopCloser, ConnectsWhatWasLost) {
  // After one lap the camera is lost; the odometry goes on from anywhere.
  DriftingOdometry odometry(2);
  LoopCloser closer = make_closer();
  for (int i = 0; i < kLap; ++i) closer.add(odometry.next(i));
  odometry.lose(SE3(SO3::exp(Vec3(0.4, -1.5, 0.7)), Vec3(7.0, 2.0, -3.0)));
  for (int i = kLap + 3; i < 2 * kLap; ++i) closer.add(odometry.next(i));
  closer.finish();
  EXPECT_GT(odometry.rms(odometry.trajectory()), 1.0);
  EXPECT_LT(odometry.rms(closer.corrected(odometry.trajectory())), 0.06);
}

TEST(LoopCloser, KnowsAPlaceByImagesOfHalfTheSize) {
  DriftingOdometry odometry(2);
  LoopConfig config = small_config();
  config.lost_support = 0.1;  // small images share few corners with whole ones
  LoopCloser closer = make_closer(config);
  for (int i = 0; i < kLap; ++i) closer.add(odometry.next(i));
  odometry.lose(SE3(SO3::exp(Vec3(0.4, -1.5, 0.7)), Vec3(7.0, 2.0, -3.0)));
  odometry.halve_images(1);
  for (int i = kLap + 3; i < 2 * kLap; ++i) closer.add(odometry.next(i));
  closer.finish();
  EXPECT_GT(odometry.rms(odometry.trajectory()), 1.0);
  EXPECT_LT(odometry.rms(closer.corrected(odometry.trajectory())), 0.06);
}

TEST(LoopCloser, OneLoopAloneIsNotBelieved) {
  DriftingOdometry odometry(1);
  LoopCloser closer = make_closer();
  int i = 0;
  while (closer.counts().matched == 0 && i < 2 * kLap) {
    EXPECT_FALSE(closer.add(odometry.next(i++)).has_value());
  }
  ASSERT_GT(closer.counts().matched, 0U);
  EXPECT_EQ(closer.counts().closures, 0U);
  EXPECT_EQ(closer.T_map_odom().matrix(), Mat4::Identity());
  while (closer.counts().closures == 0 && i < 2 * kLap) closer.add(odometry.next(i++));
  EXPECT_GE(closer.counts().closures, 2U);
}

TEST(LoopCloser, RevisedPosesAreTheOnesThatCount) {
  // The refined steps are without error; what the loops then change is their own error.
  DriftingOdometry odometry(3);
  LoopCloser closer = make_closer();
  std::vector<KeyframeOutput> revised;
  std::vector<TrajectoryPose> refined;
  for (int i = 0; i < 2 * kLap; ++i) {
    KeyframeOutput keyframe = odometry.next(i);
    closer.add(keyframe);
    keyframe.revised = true;
    keyframe.left = keyframe.right = nullptr;
    keyframe.T_odom_left = lap_pose(0).inverse() * lap_pose(i);
    refined.push_back({keyframe.stamp_ns, keyframe.T_odom_left});
    revised.push_back(keyframe);
  }
  for (const KeyframeOutput& keyframe : revised) closer.add(keyframe);
  closer.finish();
  EXPECT_GT(closer.counts().closures, 5U);
  EXPECT_GT(odometry.rms(odometry.trajectory()), 0.03);
  EXPECT_LT(odometry.rms(closer.corrected(refined)), 0.015);
}

TEST(LoopCloser, FramesBetweenPlacesMoveAsTheyDo) {
  DriftingOdometry odometry(4);
  LoopCloser closer = make_closer();
  for (int i = 0; i < 2 * kLap; ++i) closer.add(odometry.next(i));
  closer.finish();
  // A frame halfway between two keyframes, where the odometry has it.
  std::vector<TrajectoryPose> trajectory = odometry.trajectory();
  const TrajectoryPose a = trajectory[20];
  const TrajectoryPose b = trajectory[21];
  const SE3 half = SE3::exp(0.5 * (a.T_odom_left.inverse() * b.T_odom_left).log());
  trajectory.insert(trajectory.begin() + 21, {(a.stamp_ns + b.stamp_ns) / 2, a.T_odom_left * half});
  const auto corrected = closer.corrected(trajectory);
  const auto step = [&](std::size_t i) {
    return (corrected[i].T_odom_left.inverse() * corrected[i + 1].T_odom_left).translation().norm();
  };
  const auto raw_step = [&](std::size_t i) {
    return (trajectory[i].T_odom_left.inverse() * trajectory[i + 1].T_odom_left)
        .translation()
        .norm();
  };
  EXPECT_NEAR(step(20) - raw_step(20), step(21) - raw_step(21), 0.003);
}

TEST(LoopCloser, KeyframesWithoutMetresOrImagesAreNoPlaces) {
  DriftingOdometry odometry(1);
  LoopCloser closer = make_closer();
  KeyframeOutput keyframe = odometry.next(0);
  keyframe.scale_valid = false;
  closer.add(keyframe);
  keyframe = odometry.next(1);
  keyframe.right = nullptr;
  closer.add(keyframe);
  EXPECT_EQ(closer.counts().places, 0U);
  closer.add(odometry.next(2));
  KeyframeOutput near = odometry.next(2);
  near.T_odom_left.translation() += Vec3(0.0, 0.0, 0.001);
  closer.add(near);
  EXPECT_EQ(closer.counts().places, 1U);
}

TEST(LoopCloser, TheOldestPlacesAreForgotten) {
  LoopConfig config = small_config();
  config.max_places = 20;
  DriftingOdometry odometry(1);
  LoopCloser closer = make_closer(config);
  for (int i = 0; i < 2 * kLap; ++i) {
    const KeyframeOutput keyframe = odometry.next(i);
    const auto closure = closer.add(keyframe);
    EXPECT_LE(closer.corrected_places().size(), 20U);
    if (!closure) continue;
    EXPECT_LE(keyframe.stamp_ns - closure->older_stamp_ns, 20 * 100'000'000LL);
  }
  closer.finish();
  EXPECT_GT(closer.corrected_places().size(), 15U);
  EXPECT_EQ(closer.counts().places, 2U * kLap);
  const auto corrected = closer.corrected(odometry.trajectory());
  EXPECT_EQ(corrected.size(), odometry.trajectory().size());
}

TEST(LoopCloser, TheSameKeyframesGiveTheSameBits) {
  const auto run = [] {
    DriftingOdometry odometry(5);
    LoopCloser closer = make_closer();
    for (int i = 0; i < 2 * kLap; ++i) closer.add(odometry.next(i));
    closer.finish();
    return closer.corrected(odometry.trajectory());
  };
  const auto a = run();
  const auto b = run();
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].T_odom_left.matrix(), b[i].T_odom_left.matrix());
  }
}

}  // namespace
}  // namespace sovo
