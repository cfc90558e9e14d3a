#include "sovo/bridge/vo_views.h"

#include <gtest/gtest.h>

#include <cstring>

#include "sovo/bridge/point_conversion.h"
#include "sovo/bridge/reader.h"
#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/topics.h"
#include "sovo/bridge/vo_publisher.h"
#include "test_bus.h"
#include "test_cameras.h"

namespace sovo::bridge {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

CameraModel tracked_camera() { return {640, 480, 400.0, 400.0, 319.5, 239.5}; }

/// A keyframe one metre to the right of the world's origin that sees two points 2 m ahead.
KeyframeOutput test_keyframe() {
  KeyframeOutput keyframe;
  keyframe.segment = 3;
  keyframe.stamp_ns = 7 * kSecond;
  keyframe.scale_valid = true;
  keyframe.T_odom_left = SE3(SO3(), Vec3(1.0, 0.0, 0.0));
  keyframe.u = {319.5F, 419.5F, 10.0F};
  keyframe.v = {239.5F, 239.5F, 10.0F};
  keyframe.inverse_depth = {0.5F, 0.5F, 0.0F};  // the last one is infinitely far
  keyframe.sigma = {0.1F, 0.1F, 0.1F};
  keyframe.intensity = {10, 200, 30};
  return keyframe;
}

/// A frame half a metre ahead of that keyframe.
OdometryOutput output_with_views() {
  OdometryOutput output;
  output.stamp_ns = 8 * kSecond;
  output.state = OdometryState::kTracking;
  output.pose_valid = output.scale_valid = true;
  output.segment = 3;
  output.T_odom_left = SE3(SO3(), Vec3(1.0, 0.0, 0.5));
  return output;
}

TEST(PointsInView, AreWhereTheRawCameraSeesThemNow) {
  const CameraModel raw = test_cameras().rig.left;
  const PointsInView points =
      points_in_view(output_with_views(), test_keyframe(), tracked_camera(), raw);
  ASSERT_EQ(points.u.size(), 2U);
  const Vec2 expected = *raw.project(Vec3(0.5, 0.0, 1.5));
  EXPECT_NEAR(points.u[1], expected.x(), 1e-3);
  EXPECT_NEAR(points.v[1], expected.y(), 1e-3);
  EXPECT_NEAR(points.inverse_depth[1], 1.0 / 1.5, 1e-6);
}

TEST(PointsInView, GrowWithTheScaleCorrectionsSinceTheKeyframe) {
  OdometryOutput output = output_with_views();
  output.T_odom_left = test_keyframe().T_odom_left;
  output.log_scale = std::log(2.0);
  const PointsInView points =
      points_in_view(output, test_keyframe(), tracked_camera(), tracked_camera());
  ASSERT_EQ(points.u.size(), 2U);
  EXPECT_NEAR(points.u[1], 419.5, 1e-3) << "seen from the keyframe nothing moves";
  EXPECT_NEAR(points.inverse_depth[1], 0.25, 1e-6);
}

TEST(PointsInView, OfAnotherSegmentOrWithoutAPoseAreNone) {
  OdometryOutput output = output_with_views();
  output.segment = 4;
  EXPECT_TRUE(
      points_in_view(output, test_keyframe(), tracked_camera(), tracked_camera()).u.empty());
  output = output_with_views();
  output.pose_valid = false;
  EXPECT_TRUE(
      points_in_view(output, test_keyframe(), tracked_camera(), tracked_camera()).u.empty());
}

TEST(PointCloud, HoldsThePointsInTheAxesOfOdom) {
  const OdometryFrames frames;
  const PointCloudMessage cloud(test_keyframe(), tracked_camera(), body_from_optical(), frames);
  const msg::PointCloud2& m = cloud.message();
  ASSERT_EQ(m.width, 2U);
  ASSERT_EQ(m.data._length, 2 * m.point_step);
  EXPECT_EQ(m.row_step, m.data._length);
  ASSERT_EQ(m.fields._length, 4U);
  EXPECT_STREQ(m.fields._buffer[2].name, "z");
  EXPECT_EQ(m.fields._buffer[2].offset, 8U);
  EXPECT_STREQ(m.header.frame_id, "odom");
  EXPECT_EQ(stamp_ns(m.header.stamp), 7 * kSecond);
  float point[4];
  std::memcpy(point, m.data._buffer + m.point_step, sizeof(point));
  // Optical (1.5, 0, 2) is body (2, -1.5, 0).
  EXPECT_NEAR(point[0], 2.0F, 1e-6F);
  EXPECT_NEAR(point[1], -1.5F, 1e-6F);
  EXPECT_NEAR(point[2], 0.0F, 1e-6F);
  EXPECT_EQ(point[3], 200.0F);
}

TEST(VoViews, PointsAreMadeOnlyForReaders) {
  const Participant vo = open_participant();
  const Participant other = open_remote_participant();
  auto publisher = require(VoPublisher::open(vo, {}, body_from_optical()));
  publisher->set_cameras(tracked_camera(), test_cameras().rig.left);
  auto diagnostics = require(
      Reader<msg::DiagnosticArray>::open(other, topics::kDiagnostics, topics::kDiagnosticsQos));
  OdometryOutput output = output_with_views();
  const auto feed = [&] {
    output.stamp_ns += kSecond / 10;
    publisher->on_keyframe(test_keyframe());
    publisher->on_frame(output);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  };
  int reports = 0;
  EXPECT_TRUE(eventually([&] {
    feed();
    const auto taken =
        diagnostics.take_each([](const msg::DiagnosticArray&, const dds_sample_info_t&) {});
    reports += taken.ok() ? *taken : 0;
    return reports >= 2;
  }));
  EXPECT_EQ(publisher->views_made(), 0U);

  auto tracked = require(
      Reader<msg::TrackedPoints>::open(other, topics::kTrackedPoints, topics::kTrackedPointsQos));
  auto cloud = require(Reader<msg::PointCloud2>::open(other, topics::kPoints, topics::kPointsQos));
  int clouds = 0;
  int views = 0;
  EXPECT_TRUE(eventually([&] {
    feed();
    (void)tracked.take_each([&](const msg::TrackedPoints& m, const dds_sample_info_t&) {
      ++views;
      EXPECT_EQ(m.u._length, 2U);
      EXPECT_EQ(stamp_ns(m.header.stamp) % (kSecond / 10), 0);
      EXPECT_LE(stamp_ns(m.header.stamp), output.stamp_ns);
    });
    (void)cloud.take_each([&](const msg::PointCloud2& m, const dds_sample_info_t&) {
      ++clouds;
      EXPECT_EQ(m.width, 2U);
    });
    return clouds > 0 && views > 0;
  }));
  EXPECT_GT(publisher->views_made(), 0U);
}

TEST(VoViews, SilenceOfTheSourceIsToldAsStale) {
  const Participant vo = open_participant();
  const auto publisher = require(VoPublisher::open(vo, {}, SE3()));
  auto reader = require(
      Reader<msg::DiagnosticArray>::open(vo, topics::kDiagnostics, topics::kDiagnosticsQos));
  int level = -1;
  EXPECT_TRUE(eventually([&] {
    (void)reader.take_each([&](const msg::DiagnosticArray& m, const dds_sample_info_t&) {
      level = m.status._buffer[0].level;
    });
    return level >= 0;
  }));
  EXPECT_EQ(level, MessageTraits<msg::DiagnosticStatus>::STALE);
}

}  // namespace
}  // namespace sovo::bridge
