#include "sovo/bridge/odometry_conversion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sovo/bridge/diagnostics.h"
#include "test_cameras.h"

namespace sovo::bridge {
namespace {

OdometryOutput test_output() {
  OdometryOutput output;
  output.stamp_ns = 1'700'000'000'250'000'000;
  output.session = 7;
  output.sequence = 42;
  output.state = OdometryState::kTracking;
  output.pose_valid = true;
  output.scale_valid = true;
  output.T_odom_left = SE3::exp((Vec6() << 1.0, -0.5, 2.0, 0.3, -0.2, 0.4).finished());
  output.velocity << 0.1, 0.2, 1.0, 0.01, -0.3, 0.02;
  output.pose_covariance = Vec6(1, 2, 3, 4, 5, 6).asDiagonal();
  output.velocity_covariance = Vec6(6, 5, 4, 3, 2, 1).asDiagonal();
  return output;
}

TEST(OdometryConversion, ForwardInTheCameraIsForwardInTheBase) {
  OdometryOutput output = test_output();
  output.T_odom_left = SE3(SO3(), Vec3(0, 0, 3.0));  // 3 m along the optical axis
  output.velocity << 0, 0, 2.0, 0, 0.5, 0;           // turning right, about the camera's y axis
  const BaseMotion motion = to_base(output, body_from_optical());
  EXPECT_TRUE(motion.T_odom_base.translation().isApprox(Vec3(3.0, 0, 0), 1e-12));
  EXPECT_TRUE(motion.T_odom_base.rotation_matrix().isApprox(Mat3::Identity(), 1e-12));
  EXPECT_TRUE(motion.twist.isApprox((Vec6() << 2.0, 0, 0, 0, 0, -0.5).finished(), 1e-12));
}

TEST(OdometryConversion, TheBaseBeginsAtTheOriginWhateverItsCamera) {
  OdometryOutput output = test_output();
  output.T_odom_left = SE3();
  const BaseMotion motion = to_base(output, test_cameras().rig.T_base_left);
  EXPECT_TRUE(motion.T_odom_base.matrix().isApprox(Mat4::Identity(), 1e-12));
}

TEST(OdometryConversion, TwistIsTheDerivativeOfThePose) {
  const OdometryOutput output = test_output();
  const SE3 A = test_cameras().rig.T_base_left;
  const double dt = 1e-6;
  OdometryOutput later = output;
  later.T_odom_left = output.T_odom_left * SE3::exp(dt * output.velocity);
  const BaseMotion now = to_base(output, A);
  const SE3 step = now.T_odom_base.inverse() * to_base(later, A).T_odom_base;
  EXPECT_TRUE(now.twist.isApprox(step.log() / dt, 1e-5));
}

/// (translation, rotation about fixed axes) between two poses.
Vec6 difference(const SE3& from, const SE3& to) {
  Vec6 d;
  d.head<3>() = to.translation() - from.translation();
  d.tail<3>() = (to.rotation() * from.rotation().inverse()).log();
  return d;
}

TEST(OdometryConversion, CovarianceIsThatOfThePerturbedPose) {
  OdometryOutput output = test_output();
  Mat6 root;
  for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = std::sin(1.0 + i);
  output.pose_covariance = root * root.transpose();
  const SE3 A = test_cameras().rig.T_base_left;
  const BaseMotion motion = to_base(output, A);
  Mat6 J;
  const double e = 1e-6;
  for (int i = 0; i < 6; ++i) {
    Vec6 x = Vec6::Zero();
    x[i] = e;
    OdometryOutput moved = output;
    moved.T_odom_left = SE3(SO3::exp(x.tail<3>()) * output.T_odom_left.rotation(),
                            output.T_odom_left.translation() + x.head<3>());
    J.col(i) = difference(motion.T_odom_base, to_base(moved, A).T_odom_base) / e;
  }
  const Mat6 expected = J * output.pose_covariance * J.transpose();
  EXPECT_TRUE(motion.pose_covariance.isApprox(expected, 1e-4));
}

TEST(OdometryConversion, MessagesCarryEverything) {
  OdometryOutput output = test_output();
  output.keyframe_id = 9;
  output.is_keyframe = true;
  output.scale_verdict = ScaleVerdict::kAmbiguous;
  output.log_scale_sigma = 0.01;
  const OdometryFrames frames{"auv1/odom", "auv1/base_link"};
  const BaseMotion motion = to_base(output, body_from_optical());
  const msg::Odometry odom = to_odometry(output, motion, frames);
  EXPECT_STREQ(odom.header.frame_id, "auv1/odom");
  EXPECT_STREQ(odom.child_frame_id, "auv1/base_link");
  EXPECT_EQ(odom.header.stamp.sec, 1'700'000'000);
  EXPECT_EQ(odom.header.stamp.nanosec, 250'000'000U);
  EXPECT_EQ(odom.pose.pose.position.x, motion.T_odom_base.translation().x());
  EXPECT_EQ(odom.pose.covariance[7], motion.pose_covariance(1, 1));
  EXPECT_EQ(odom.twist.twist.angular.z, motion.twist[5]);
  const msg::ScaledOdometry scaled = to_scaled_odometry(output, motion, frames);
  EXPECT_EQ(scaled.sequence, 42U);
  EXPECT_EQ(scaled.keyframe_id, 9U);
  EXPECT_TRUE(scaled.is_keyframe);
  EXPECT_TRUE(scaled.scale_valid);
  EXPECT_EQ(scaled.log_scale_sigma, 0.01);
  EXPECT_EQ(scaled.scale_verdict, MessageTraits<msg::ScaledOdometry>::SCALE_AMBIGUOUS);
  EXPECT_EQ(scaled.state, MessageTraits<msg::VoStatus>::TRACKING);
}

TEST(OdometryConversion, StatusAddsWhatTheFeedLost) {
  OdometryOutput output = test_output();
  output.rejected = 2;
  output.dropped_queue = 3;
  output.reason = "dark";
  FeedStatus feed;
  feed.rejected = 10;
  feed.dropped_queue = 20;
  feed.lost_transport = 30;
  feed.last_command_id = 99;
  feed.last_command_result = "done";
  const StatusMessage status(output, feed, {{Stage::kTracking, 1.0F, 2.0F, 3.0F}}, {},
                             output.stamp_ns + 5'000'000);
  const msg::VoStatus& m = status.message();
  EXPECT_EQ(m.rejected, 12U);
  EXPECT_EQ(m.dropped_queue, 23U);
  EXPECT_EQ(m.lost_transport, 30U);
  EXPECT_EQ(m.last_command_id, 99U);
  EXPECT_STREQ(m.last_command_result, "done");
  EXPECT_STREQ(m.reason, "dark");
  EXPECT_NEAR(m.latency_s, 0.005, 1e-9);
  ASSERT_EQ(m.stages._length, 1U);
  EXPECT_STREQ(m.stages._buffer[0].name, "tracking");
  EXPECT_EQ(m.stages._buffer[0].max_ms, 3.0F);
  feed.latency_origin_ns = 1000;
  const StatusMessage late(output, feed, {}, {}, 2'000'001'000);
  EXPECT_NEAR(late.message().latency_s, 2.0, 1e-9);
}

TEST(OdometryConversion, KeyframesStandInTheAxesOfOdom) {
  KeyframeOutput keyframe;
  keyframe.T_odom_left = SE3(SO3(), Vec3(0, 0, 1));
  keyframe.u = {1, 2};
  const SE3 A = test_cameras().rig.T_base_left;
  const msg::Keyframe m = to_message(keyframe, A, {});
  EXPECT_NEAR(m.pose.position.x, 1.0 + A.translation().x(), 1e-12);
  EXPECT_EQ(m.u._buffer, keyframe.u.data());
  EXPECT_NEAR(to_path_pose(keyframe, A, {}).pose.position.x, 1.0, 1e-12);
  keyframe.log_scale = 0.1;
  EXPECT_TRUE(std::isnan(to_message(keyframe, A, {}).log_scale)) << "no scale is claimed";
  keyframe.scale_valid = true;
  EXPECT_EQ(to_message(keyframe, A, {}).log_scale, 0.1);
}

TEST(Diagnostics, LostIsAnErrorAndTrackingIsOk) {
  using Level = MessageTraits<msg::DiagnosticStatus>;
  EXPECT_EQ(diagnostic_level(OdometryState::kTracking), Level::OK);
  EXPECT_EQ(diagnostic_level(OdometryState::kLost), Level::ERROR);
  EXPECT_EQ(diagnostic_level(OdometryState::kDegraded), Level::WARN);
  OdometryOutput output = test_output();
  output.state = OdometryState::kLost;
  output.reason = "too dark";
  const DiagnosticsMessage message(describe("sovo: visual odometry", output, {}), 0);
  ASSERT_EQ(message.message().status._length, 1U);
  EXPECT_NE(std::string(message.message().status._buffer[0].message).find("too dark"),
            std::string::npos);
}

std::string value_of(const DiagnosticReport& report, const std::string& key) {
  for (const auto& [name, value] : report.values) {
    if (name == key) return value;
  }
  return "none";
}

TEST(Diagnostics, WarnOfARightCameraThatIsTurned) {
  using Level = MessageTraits<msg::DiagnosticStatus>;
  OdometryOutput output = test_output();
  output.state = OdometryState::kTracking;
  EXPECT_EQ(describe("", output, {}).level, Level::OK);
  EXPECT_EQ(value_of(describe("", output, {}), "right_turn_deg"), "0.000 0.000 0.000");
  output.decalibrated = true;
  output.right_turn = M_PI / 180.0 * Vec3(0.25, -0.1, 1.0);
  const DiagnosticReport report = describe("", output, {});
  EXPECT_EQ(report.level, Level::WARN);
  EXPECT_EQ(value_of(report, "right_turn_deg"), "0.250 -0.100 1.000");
  output.state = OdometryState::kLost;
  EXPECT_EQ(describe("", output, {}).level, Level::ERROR);
}

TEST(Diagnostics, SayHowFarTheFocalLengthIsSeenToBeOff) {
  OdometryOutput output = test_output();
  EXPECT_EQ(value_of(describe("", output, {}), "focal_error"), "0.000000");
  output.focal_error = -0.0125;
  EXPECT_EQ(value_of(describe("", output, {}), "focal_error"), "-0.012500");
}

TEST(Diagnostics, SayHowMuchLightTheCornersWereFoundToHave) {
  OdometryOutput output = test_output();
  EXPECT_EQ(value_of(describe("", output, {}), "corner_light"), "1.000000");
  output.corner_light = 0.75;
  EXPECT_EQ(value_of(describe("", output, {}), "corner_light"), "0.750000");
}

TEST(Diagnostics, SayHowMuchMovesAlongWithTheCamera) {
  OdometryOutput output = test_output();
  output.co_moving_share = 0.125;
  EXPECT_EQ(value_of(describe("", output, {}), "co_moving_share"), "0.125000");
}

TEST(Diagnostics, SpeakOfLoopsWhereTheyAreClosed) {
  FeedStatus feed;
  EXPECT_EQ(value_of(describe("", test_output(), feed), "loops_closed"), "none");
  feed.loops = LoopStatus{40, 3, 1};
  const DiagnosticReport report = describe("", test_output(), feed);
  EXPECT_EQ(value_of(report, "loop_places"), "40");
  EXPECT_EQ(value_of(report, "loops_closed"), "3");
  EXPECT_EQ(value_of(report, "loop_dropped"), "1");
}

}  // namespace
}  // namespace sovo::bridge
