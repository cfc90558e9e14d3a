#include "sovo/odometry/trajectory_recorder.h"

#include <gtest/gtest.h>

#include "support/synthetic_scene.h"

namespace sovo {
namespace {

SE3 at(double x, double y = 0.0, double z = 0.0) { return {SO3(), Vec3(x, y, z)}; }

KeyframePose keyframe(std::uint32_t id, const SE3& pose) {
  KeyframePose k;
  k.id = id;
  k.stamp_ns = 100 * (id + 1);
  k.T_world_camera = pose;
  k.step = pose.translation();
  return k;
}

/// A window without images.
class CorrectedWindow {
 public:
  void add(const Vec3& position) {
    const auto id = static_cast<std::uint32_t>(poses_.poses().size());
    window_.push_back({id, 100 * (id + 1), SE3(SO3(), position)});
    poses_.record(window_, log_scale_);
  }
  /// A measured similarity.
  void correct(double log_scale) {
    rescale(std::exp(log_scale));
    log_scale_ += log_scale;
    poses_.rescale(window_, std::exp(log_scale), log_scale_);
  }
  /// Bundle adjustment changes the scale of the window.
  void drift(double log_scale) {
    rescale(std::exp(log_scale));
    poses_.record(window_, log_scale_);
  }
  void drop_oldest() { window_.erase(window_.begin()); }
  const std::vector<KeyframePose>& keyframes() const { return poses_.poses(); }
  Vec3 newest() const { return window_.back().T_world_camera.translation(); }

 private:
  void rescale(double scale) {
    const Vec3 centre = newest();
    for (WindowPose& k : window_) {
      Vec3& p = k.T_world_camera.translation();
      p = centre + scale * (p - centre);
    }
  }

  KeyframePoses poses_;
  std::vector<WindowPose> window_;
  double log_scale_ = 0.0;
};

TEST(RefinedKeyframePoses, WithoutSimilaritiesAreThoseOfTheWindow) {
  CorrectedWindow window;
  for (int i = 0; i < 5; ++i) window.add(Vec3(i, 0.1 * i * i, 0));
  const auto poses = refined_keyframe_poses(window.keyframes());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_LT((poses[i].translation() - window.keyframes()[i].T_world_camera.translation()).norm(),
              1e-12);
  }
}

TEST(RefinedKeyframePoses, LaterSimilaritiesAreUndone) {
  // The map's unit drifts by 10 % a keyframe, and each keyframe's own measurement puts it right:
  // every step comes out a metre long.
  CorrectedWindow window;
  window.add(Vec3::Zero());
  for (int i = 1; i < 6; ++i) {
    window.add(window.newest() + Vec3(1.1, 0, 0));
    window.correct(-std::log(1.1));
  }
  const auto poses = refined_keyframe_poses(window.keyframes());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_NEAR(poses[i].translation().x(), static_cast<double>(i), 1e-9) << "keyframe " << i;
  }
  // The window itself has shrunk its past again and again.
  const double past = window.newest().x() - window.keyframes()[0].T_world_camera.translation().x();
  EXPECT_LT(past, 4.5);
}

TEST(RefinedKeyframePoses, StayInLineWhenSomeLeaveTheWindowBeforeOthers) {
  // Scale drifts and is put right while the window moves on: that moves what is far behind it by a
  // lot, and what has left by then not at all.
  CorrectedWindow window;
  for (int i = 0; i < 4; ++i) window.add(Vec3(i, 0, 0));
  window.drop_oldest();
  window.drop_oldest();
  window.add(Vec3(10, 0, 0));
  window.drift(0.02);
  window.correct(-0.02);
  window.drift(0.02);
  const auto poses = refined_keyframe_poses(window.keyframes());
  EXPECT_GT(std::abs(window.keyframes()[2].T_world_camera.translation().x() - 2.0), 0.1);
  for (int i = 1; i < 4; ++i) {
    const auto k = static_cast<std::size_t>(i);
    EXPECT_NEAR((poses[k].translation() - poses[k - 1].translation()).x(), 1.0, 0.05) << i;
  }
}

TEST(RefinedKeyframePoses, StepsTurnWithTheKeyframeBefore) {
  std::vector<KeyframePose> keyframes = {keyframe(0, at(0)), keyframe(1, at(0))};
  keyframes[0].T_world_camera = SE3(SO3::exp(Vec3(0, 0, 0.5 * M_PI)), Vec3::Zero());
  keyframes[0].step = Vec3(1, 2, 3);
  keyframes[1].step = Vec3(1, 0, 0);
  const auto poses = refined_keyframe_poses(keyframes);
  EXPECT_LT((poses[0].translation() - Vec3(1, 2, 3)).norm(), 1e-12);
  EXPECT_LT((poses[1].translation() - Vec3(1, 3, 3)).norm(), 1e-12);
}

TEST(RefinedKeyframePoses, RotationsAreThoseOfTheWindow) {
  std::vector<KeyframePose> keyframes = {keyframe(0, at(0)), keyframe(1, at(1))};
  keyframes[1].T_world_camera = SE3(SO3::exp(Vec3(0.1, -0.2, 0.3)), Vec3(7, 7, 7));
  const auto poses = refined_keyframe_poses(keyframes);
  EXPECT_LT(poses[0].rotation().log().norm(), 1e-12);
  EXPECT_LT((poses[1].rotation().log() - Vec3(0.1, -0.2, 0.3)).norm(), 1e-12);
}

TEST(RefinedKeyframePoses, ThoseThatHaveNotChangedAreKept) {
  std::vector<KeyframePose> keyframes = {keyframe(0, at(0)), keyframe(1, at(1))};
  std::vector<SE3> poses;
  refine_keyframe_poses(keyframes, 0, &poses);
  keyframes[0].step = Vec3(50, 0, 0);
  keyframes[1].step = Vec3(2, 0, 0);
  keyframes.push_back(keyframe(2, at(1)));
  refine_keyframe_poses(keyframes, 1, &poses);
  ASSERT_EQ(poses.size(), 3U);
  EXPECT_EQ(poses[0].translation().x(), 0.0);
  EXPECT_EQ(poses[1].translation().x(), 2.0);
  EXPECT_EQ(poses[2].translation().x(), 3.0);
}

TEST(RefinedKeyframePoses, OfNoneAreNone) { EXPECT_TRUE(refined_keyframe_poses({}).empty()); }

TrackedFrame tracked(std::int64_t stamp_ns, std::uint32_t keyframe_id, const SE3& T_frame_keyframe,
                     double log_scale) {
  auto reference = std::make_shared<ReferenceKeyframe>();
  reference->keyframe_id = keyframe_id;
  reference->log_scale = log_scale;
  TrackedFrame t;
  t.frame.stamp_ns = stamp_ns;
  t.reference = reference;
  t.tracking.T_current_reference = T_frame_keyframe;
  return t;
}

TEST(TrajectoryRecorder, FramesHangOnTheirKeyframesAsThoseAreKnownLater) {
  TrajectoryRecorder recorder;
  recorder.add(tracked(100, 0, SE3(), 0.0));         // keyframe 0
  recorder.add(tracked(150, 0, at(-0.5), 0.0));      // half a metre on
  recorder.add(tracked(200, 0, at(-1.0), 0.0));      // becomes keyframe 1
  recorder.add(tracked(250, 1, at(0, -0.25), 0.0));  // to the side
  std::vector<KeyframePose> keyframes = {keyframe(0, at(0)), keyframe(1, at(1.2))};
  const auto trajectory = recorder.trajectory(&keyframes);
  ASSERT_EQ(trajectory.size(), 4U);
  EXPECT_NEAR(trajectory[1].T_odom_left.translation().x(), 0.5, 1e-12);
  EXPECT_NEAR(trajectory[2].T_odom_left.translation().x(), 1.2, 1e-12) << "as refined";
  EXPECT_LT((trajectory[3].T_odom_left.translation() - Vec3(1.2, 0.25, 0)).norm(), 1e-12);
  EXPECT_EQ(trajectory[3].stamp_ns, 250);
}

TEST(TrajectoryRecorder, RelativePosesTakeTheScaleOfTheirKeyframe) {
  // A frame was tracked before its keyframe's scale was measured.
  TrajectoryRecorder recorder;
  recorder.add(tracked(150, 0, at(-0.5), 0.0));
  recorder.add(tracked(160, 0, at(-1.0), std::log(2.0)));
  KeyframePose k = keyframe(0, at(0));
  k.log_scale = std::log(2.0);
  const std::vector<KeyframePose> keyframes = {k};
  const auto trajectory = recorder.trajectory(&keyframes);
  EXPECT_NEAR(trajectory[0].T_odom_left.translation().x(), 1.0, 1e-12);
  EXPECT_NEAR(trajectory[1].T_odom_left.translation().x(), 1.0, 1e-12);
}

TEST(TrajectoryRecorder, ClosedSegmentsStay) {
  TrajectoryRecorder recorder;
  recorder.add(tracked(100, 0, SE3(), 0.0));
  recorder.close_segment({keyframe(0, at(3))});
  KeyframePose k = keyframe(0, at(7));
  k.stamp_ns = 500;
  recorder.add(tracked(500, 0, SE3(), 0.0));
  const std::vector<KeyframePose> keyframes = {k};
  const auto trajectory = recorder.trajectory(&keyframes);
  ASSERT_EQ(trajectory.size(), 2U);
  EXPECT_EQ(trajectory[0].T_odom_left.translation().x(), 3.0);
  EXPECT_EQ(trajectory[1].T_odom_left.translation().x(), 7.0);
  EXPECT_EQ(recorder.trajectory(nullptr).size(), 1U);
}

TEST(TrajectoryRecorder, AFrameOfTwoSegmentsBelongsToTheOneThatItBegins) {
  TrajectoryRecorder recorder;
  recorder.add(tracked(100, 0, SE3(), 0.0));
  recorder.add(tracked(150, 0, at(-0.5), 0.0));
  recorder.close_segment({keyframe(0, at(3))});
  KeyframePose k = keyframe(0, at(3.6));
  k.stamp_ns = 150;
  recorder.add(tracked(150, 0, SE3(), 0.0));
  recorder.add(tracked(200, 0, at(-0.5), 0.0));
  recorder.close_segment({k});
  const auto trajectory = recorder.trajectory(nullptr);
  ASSERT_EQ(trajectory.size(), 3U);
  EXPECT_EQ(trajectory[0].stamp_ns, 100);
  EXPECT_EQ(trajectory[1].stamp_ns, 150);
  EXPECT_EQ(trajectory[1].T_odom_left.translation().x(), 3.6);
  EXPECT_EQ(trajectory[2].stamp_ns, 200);
}

}  // namespace
}  // namespace sovo
