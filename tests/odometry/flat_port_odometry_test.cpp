#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "odometry/odometry_test_support.h"
#include "sovo/geometry/radtan_fit.h"
#include "sovo/odometry/frame_preparation.h"

namespace sovo {
namespace {

using test::Playback;

constexpr int kDivedFrames = 20;

/// The cameras of the drive, under water, behind thick panes that are far from them.
StereoCameras dived_cameras() {
  StereoCameras cameras = test::test_cameras();
  cameras.rig.left.port = {.distance = 0.06, .thickness = 0.01};
  cameras.rig.right.port = {
      .distance = 0.06, .thickness = 0.01, .normal = Vec3(0.01, 0.0, 1.0).normalized()};
  for (CameraModel* camera : {&cameras.rig.left, &cameras.rig.right}) {
    camera->fx *= 0.6;
    camera->fy *= 0.6;
    camera->port->centre = *centre_behind_port(*camera);
  }
  return cameras;
}

/// Frame `i` of the drive through the panes; rendered once a program.
StereoFrame dived_frame(int i) {
  static const test::SyntheticScene scene(3);
  static const StereoCameras cameras = dived_cameras();
  static std::map<int, StereoFrame> rendered;
  const auto found = rendered.find(i);
  if (found != rendered.end()) return found->second;
  StereoFrame frame = test::drive_frame(i);
  const SE3 pose = test::drive(i);
  frame.left = test::side_of(scene.render(cameras.rig.left, pose));
  frame.right =
      test::side_of(scene.render(cameras.rig.right, pose * cameras.rig.T_right_left.inverse()));
  return rendered.emplace(i, frame).first->second;
}

struct DivedKind {
  const char* name;
  OdometryMode mode;
  Backend backend;
};

class FlatPorts : public testing::TestWithParam<DivedKind> {
 protected:
  static test::DriveError error_with(const StereoCameras& cameras) {
    StereoOdometryConfig config = test::test_config();
    config.mode = GetParam().mode;
    config.backend = GetParam().backend;
    config.right_turn.undo = false;
    Playback playback(config, cameras);
    for (int i = 0; i < kDivedFrames; ++i) playback.give(dived_frame(i));
    const auto poses = test::published(playback.recorder);
    EXPECT_EQ(poses.size(), static_cast<std::size_t>(kDivedFrames));
    return test::drive_error(poses);
  }
};

TEST_P(FlatPorts, AreSeenThroughAsTheyAre) {
  const test::DriveError known = error_with(dived_cameras());
  EXPECT_LT(known.rms, 0.012);
  EXPECT_NEAR(known.scale, 1.0, 0.01);
  StereoCameras central = dived_cameras();
  central.rig = without_ports(central.rig);
  const test::DriveError nearest = error_with(central);
  EXPECT_LT(known.rms, 0.5 * nearest.rms)
      << "known " << known.rms << " m, as a camera whose rays meet " << nearest.rms << " m";
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, FlatPorts,
    testing::Values(DivedKind{"Scale", OdometryMode::kScale, Backend::kDirect},
                    DivedKind{"Stereo", OdometryMode::kStereo, Backend::kDirect},
                    DivedKind{"Features", OdometryMode::kScale, Backend::kFeatures}),
    [](const testing::TestParamInfo<DivedKind>& kind) { return std::string(kind.param.name); });

TEST(FlatPortsOfOneCamera, GoAlongWithFramesOnlyWhereLengthsAreMetres) {
  StereoOdometryConfig config = test::test_config();
  FramePreparation metric(config, dived_cameras());
  EXPECT_FALSE(metric.prepare_left(dived_frame(0), nullptr).shift.none());
  EXPECT_FALSE(metric.prepare_left(dived_frame(0), nullptr, 1).shift.none());
  config.mode = OdometryMode::kMono;
  FramePreparation mono(config, dived_cameras());
  EXPECT_TRUE(mono.prepare_left(dived_frame(0), nullptr).shift.none());
}

/// A map whose unit is not known knows directions alone: they are those of panes that touch the
/// cameras, whose rays meet.
TEST(FlatPortsOfOneCamera, BendDirectionsAloneInAMapOfNoScale) {
  StereoOdometryConfig config = test::test_config();
  config.mode = OdometryMode::kMono;
  config.init = InitMethod::kTwoView;
  StereoCameras touching = dived_cameras();
  for (CameraModel* camera : {&touching.rig.left, &touching.rig.right}) {
    camera->port->distance = camera->port->thickness = camera->port->centre = 0.0;
  }
  Playback dived(config, dived_cameras());
  Playback touched(config, touching);
  int tracked = 0;
  for (int i = 0; i < kDivedFrames; ++i) {
    const OdometryOutput a = dived.give(dived_frame(i));
    const OdometryOutput b = touched.give(dived_frame(i));
    EXPECT_EQ(a.pose_valid, b.pose_valid);
    EXPECT_EQ(a.T_odom_left.matrix(), b.T_odom_left.matrix());
    tracked += a.pose_valid ? 1 : 0;
  }
  EXPECT_GE(tracked, 5) << "from two views";
}

}  // namespace
}  // namespace sovo
