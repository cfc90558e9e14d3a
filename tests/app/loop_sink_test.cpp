#include "sovo/app/loop_sink.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <thread>

#include "support/cameras.h"

namespace sovo::app {
namespace {

StereoCameras small_cameras() {
  StereoCameras cameras;
  cameras.rig.left = test::make_camera(160, 120, 130, 130, 79.5, 59.5);
  cameras.rig.right = cameras.rig.left;
  cameras.rig.T_right_left = SE3(SO3(), Vec3(-0.11, 0.0, 0.0));
  return cameras;
}

/// An odometry that is asked for its cameras only.
class NoSink : public OutputSink {
 public:
  void on_frame(const OdometryOutput& /*output*/) override {}
  void on_keyframe(const KeyframeOutput& /*keyframe*/) override {}
  void on_scale(const ScaleRecord& /*record*/) override {}
};

/// A keyframe half a metre on from the one before, of nothing to be seen.
KeyframeOutput keyframe_of(std::uint32_t id) {
  KeyframeOutput k;
  k.id = id;
  k.stamp_ns = 1'000'000'000LL * (id + 1);
  k.scale_valid = true;
  k.T_odom_left = SE3(SO3(), Vec3(0.5 * id, 0.0, 0.0));
  k.inverse_depth = {1.0F};
  k.left = k.right = std::make_shared<const ImagePyramid>(ImageF(160, 120), 3);
  return k;
}

LoopConfig enabled() {
  LoopConfig config;
  config.enabled = true;
  return config;
}

class LoopSinkTest : public ::testing::Test {
 protected:
  NoSink no_sink_;
  StereoOdometryConfig odometry_config_;
  StereoOdometry odometry_{odometry_config_, small_cameras(), &no_sink_};
};

TEST(NeededForLoops, IsAllButThePoints) {
  KeyframeOutput k = keyframe_of(3);
  k.segment = 2;
  k.covariance.setIdentity();
  k.T_later_left = SE3(SO3(), Vec3(0.01, 0.0, 0.02));
  k.halvings = 1;
  k.co_moving_mask = std::make_shared<const ImageU8>(80, 60);
  k.u = k.v = k.sigma = {1.0F};
  const KeyframeOutput needed = needed_for_loops(k);
  EXPECT_EQ(needed.id, 3U);
  EXPECT_EQ(needed.segment, 2U);
  EXPECT_EQ(needed.stamp_ns, k.stamp_ns);
  EXPECT_EQ(needed.T_odom_left.matrix(), k.T_odom_left.matrix());
  EXPECT_EQ(needed.T_later_left.matrix(), k.T_later_left.matrix());
  EXPECT_EQ(needed.covariance, k.covariance);
  EXPECT_EQ(needed.inverse_depth, k.inverse_depth);
  EXPECT_EQ(needed.left, k.left);
  EXPECT_EQ(needed.right, k.right);
  EXPECT_EQ(needed.halvings, 1);
  EXPECT_EQ(needed.co_moving_mask, k.co_moving_mask);
  EXPECT_TRUE(needed.u.empty());
  k.revised = true;
  EXPECT_EQ(needed_for_loops(k).left, nullptr) << "its images are known";
}

TEST_F(LoopSinkTest, AtOnceEveryKeyframeIsTakenBeforeItReturns) {
  std::size_t told = 0;
  LoopSink sink(enabled(), {}, false, [&](const LoopSink::Map& map) { told = map.places.size(); });
  sink.on_keyframe(keyframe_of(0));  // before the odometry: nobody is there to take it
  EXPECT_EQ(sink.counts().places, 0U);
  sink.begin(odometry_);
  for (std::uint32_t i = 0; i < 30; ++i) {
    sink.on_keyframe(keyframe_of(i));
    EXPECT_EQ(told, i + 1);
  }
  sink.begin(odometry_);
  EXPECT_EQ(sink.counts().places, 0U);
  EXPECT_EQ(told, 0U) << "the old map is taken back";
}

TEST_F(LoopSinkTest, LiveTheOldestOfTooManyAreDroppedAndNoRevisionIs) {
  std::promise<void> go_on;
  std::shared_future<void> may_go_on(go_on.get_future());
  std::atomic<bool> first_came = false;
  std::vector<TrajectoryPose> places;
  LoopSink sink(enabled(), {}, true, [&](const LoopSink::Map& map) {
    first_came = true;
    may_go_on.wait();
    places = map.places;
  });
  sink.begin(odometry_);
  sink.on_keyframe(keyframe_of(0));
  while (!first_came) std::this_thread::yield();
  // The thread is busy with the first one; of these thirty the last ten stay.
  for (std::uint32_t i = 1; i <= 30; ++i) {
    sink.on_keyframe(keyframe_of(i));
    KeyframeOutput revised = keyframe_of(i);
    revised.revised = true;
    sink.on_keyframe(revised);
  }
  EXPECT_EQ(sink.dropped(), 20U);
  go_on.set_value();
  sink.finish();
  EXPECT_EQ(sink.counts().places, 11U);
  ASSERT_EQ(places.size(), 11U);
  EXPECT_EQ(places[0].stamp_ns, keyframe_of(0).stamp_ns);
  EXPECT_EQ(places[1].stamp_ns, keyframe_of(21).stamp_ns);
}

}  // namespace
}  // namespace sovo::app
