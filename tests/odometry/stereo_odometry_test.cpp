#include "sovo/odometry/stereo_odometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "odometry/odometry_test_support.h"
#include "support/same_bits.h"

namespace sovo {
namespace {

using namespace test;

TEST(StereoOdometry, FollowsADriveInMetres) {
  Playback run(test_config());
  run.give_drive(0, kDriveFrames);
  run.odometry.finish();
  for (const OdometryOutput& o : run.recorder.frames) {
    EXPECT_TRUE(o.pose_valid);
    EXPECT_TRUE(o.scale_valid);
    EXPECT_EQ(o.state, OdometryState::kTracking) << o.reason;
    EXPECT_EQ(o.reason, "");
    EXPECT_EQ(o.segment, 0U);
    EXPECT_EQ(o.session, 7U);
  }
  const OdometryOutput& last = run.recorder.frames.back();
  EXPECT_EQ(last.received, static_cast<std::uint64_t>(kDriveFrames));
  EXPECT_EQ(last.rejected, 0U);
  EXPECT_EQ(last.dropped_queue, 0U);
  EXPECT_GT(last.points, 200U);
  EXPECT_GT(last.keyframes, 2U);
  const Vec3 motion = drive(kDriveFrames - 1).translation() - drive(kDriveFrames - 2).translation();
  EXPECT_NEAR(last.velocity.head<3>().norm(), motion.norm() / (1e-9 * kPeriodNs), 0.15);
  EXPECT_GT(last.pose_covariance.diagonal().minCoeff(), 0.0);

  expect_follows_the_drive(published(run.recorder), 0.015, 0.03);
  const auto refined = run.odometry.refined_trajectory();
  EXPECT_EQ(refined.size(), static_cast<std::size_t>(kDriveFrames));
  expect_follows_the_drive(refined, 0.015, 0.03);
  EXPECT_LT(refined[0].T_odom_left.log().norm(), 2e-3);
  EXPECT_TRUE(run.recorder.frames[0].T_odom_left.matrix().isIdentity(1e-12));

  EXPECT_GE(run.recorder.keyframes.size(), 3U);
  EXPECT_GE(run.recorder.scales.size(), 3U);
  for (const KeyframeOutput& k : run.recorder.keyframes) {
    EXPECT_EQ(k.u.size(), k.inverse_depth.size());
    EXPECT_EQ(k.u.size(), k.intensity.size());
  }
}

/// Mean grey level of a square of 24 pixels from (x, y) on.
double brightness_at(const ImagePyramid& image, int x, int y) {
  constexpr int kSide = 24;
  double sum = 0.0;
  for (int j = 0; j < kSide; ++j) {
    for (int i = 0; i < kSide; ++i) sum += double{image[0].at(x + i, y + j)};
  }
  return sum / (kSide * kSide);
}

/// RMS error of the published poses [m].
double flown_by_lamps(const StereoOdometryConfig& config) {
  Playback run(config);
  for (int i = 0; i < 2 * kDriveFrames; ++i) run.give(lamp_frame(i));
  run.odometry.finish();
  const std::vector<OdometryOutput>& frames = run.recorder.frames;
  int said = 0;
  for (const OdometryOutput& o : frames) {
    EXPECT_TRUE(o.pose_valid) << o.reason;
    EXPECT_EQ(o.state, OdometryState::kTracking) << o.reason;
    said += o.reason == "lamps that move along light the scene; a new segment begins" ? 1 : 0;
  }
  EXPECT_EQ(said, 1);
  EXPECT_EQ(frames.back().segment, 1U);
  const std::vector<TrajectoryPose> refined = run.odometry.refined_trajectory();
  EXPECT_EQ(refined.size(), frames.size()) << "a pose for each stamp, also where segments meet";
  for (std::size_t i = 0; i < std::min(refined.size(), frames.size()); ++i) {
    EXPECT_EQ(refined[i].stamp_ns, frames[i].stamp_ns);
  }
  const DriveError error = drive_error(published(run.recorder));
  EXPECT_NEAR(error.scale, 1.0, 0.05);
  return error.rms;
}

TEST(StereoOdometry, LampsThatMoveWithTheCamerasAreFoundAndANewSegmentGoesOn) {
  StereoOdometryConfig config = test_config();
  config.wait_for_mapping = true;
  // Maps that were begun before the lamps are found are bent, by chance more or less.
  constexpr int kSeeds = 5;
  config.deterministic = true;
  double sum = 0.0;
  for (config.seed = 1; config.seed <= kSeeds; ++config.seed) sum += flown_by_lamps(config);
  EXPECT_LT(sum / kSeeds, 0.03);
  config.deterministic = false;
  flown_by_lamps(config);
}

TEST(StereoOdometry, NoLampsAreFoundWhereThereAreNone) {
  StereoOdometryConfig config = test_config();
  Playback daylight(config);
  daylight.give_drive(0, 2 * kDriveFrames);
  EXPECT_EQ(daylight.recorder.frames.back().segment, 0U);
  config.lighting = Lighting::kWorld;
  Playback told(config);
  for (int i = 0; i < 2 * kDriveFrames; ++i) told.give(lamp_frame(i));
  for (const OdometryOutput& o : told.recorder.frames) {
    EXPECT_EQ(o.reason.find("lamps"), std::string::npos);
  }
}

TEST(StereoOdometry, LampsThatMoveWithTheCamerasAreNoMotion) {
  StereoOdometryConfig config = test_config();
  config.lighting = Lighting::kWorld;
  config.vo.window.free_static_weight = 0.0;  // they share the lamps' light, and hold the depths
  const auto fly = [&config] {
    Playback run(config);
    for (int i = 0; i < kDriveFrames; ++i) run.give(lamp_frame(i));
    run.odometry.finish();
    // The corner has 7 % of the light in both images; freed of it, the floor leaves it half as
    // bright.
    const KeyframeOutput& first = run.recorder.keyframes.front();
    for (const ImagePyramidPtr& image : {first.left, first.right}) {
      const double corner = brightness_at(*image, 0, 0) / brightness_at(*image, 108, 78);
      EXPECT_EQ(corner > 0.25, config.lighting == Lighting::kVehicle) << corner;
    }
    return run.odometry.refined_trajectory();
  };
  const auto pulled = fly();
  config.lighting = Lighting::kVehicle;
  const auto freed = fly();
  EXPECT_EQ(freed.size(), static_cast<std::size_t>(kDriveFrames));
  expect_follows_the_drive(freed, 0.015, 0.03);
  EXPECT_GT(drive_error(pulled).rms, 3.0 * drive_error(freed).rms);
  config.vo.window.free_static_weight = StereoOdometryConfig().vo.window.free_static_weight;
  expect_follows_the_drive(fly(), 0.015, 0.03);
  config.lighting = Lighting::kWorld;
  EXPECT_LT(drive_error(fly()).rms, 0.5 * drive_error(pulled).rms);
}

TEST(StereoOdometry, CovarianceGrowsWithTheWay) {
  Playback run(test_config());
  run.give_drive(0, kDriveFrames);
  run.odometry.finish();
  const std::vector<OdometryOutput>& frames = run.recorder.frames;
  EXPECT_TRUE(frames[0].pose_covariance.isZero(0.0)) << "the first pose is the origin";
  Vec6 inherited = Vec6::Zero();
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const Mat6 part = frames[i].pose_covariance - frames[i].frame_covariance;
    EXPECT_GE((part.diagonal() - inherited).tail<3>().minCoeff(), -1e-15) << "frame " << i;
    // Also where the scale becomes better known: what the camera came with stays in its way, but
    // for the part of a millimetre that the last stretch is counted by another sigma.
    EXPECT_GE((part.diagonal() - inherited).head<3>().minCoeff(), -1e-7) << "frame " << i;
    inherited = part.diagonal();
    EXPECT_GT(frames[i].frame_covariance.diagonal().minCoeff(), 0.0);
    EXPECT_GT(frames[i].velocity_covariance.diagonal().minCoeff(), 0.0);
  }
  EXPECT_GT(inherited.minCoeff(), 0.0);
  const OdometryOutput& last = frames.back();
  const double length = last.T_odom_left.translation().norm();
  const double sigma = std::sqrt(inherited.head<3>().sum());
  EXPECT_LT(sigma, 0.05 * length);
  const Vec3 error =
      last.T_odom_left.translation() - (drive(0).inverse() * drive(kDriveFrames - 1)).translation();
  EXPECT_LT(error.norm(), 5.0 * std::sqrt(last.pose_covariance.diagonal().head<3>().sum()));
}

TEST(StereoOdometry, CovarianceOfTheTwistCountsBothAlignmentsInTheCamerasAxes) {
  Playback run(test_config());
  run.give_drive(0, 8);
  const OdometryOutput& before = run.recorder.frames[6];
  const OdometryOutput& last = run.recorder.frames[7];
  const double dt = 1e-9 * static_cast<double>(last.stamp_ns - before.stamp_ns);
  const Mat3 R = last.T_odom_left.rotation_matrix();
  const Mat6 sum = before.frame_covariance + last.frame_covariance;
  const Mat3 angular = R.transpose() * sum.bottomRightCorner<3, 3>() * R / (dt * dt);
  const Mat3 claimed = last.velocity_covariance.bottomRightCorner<3, 3>();
  EXPECT_TRUE(claimed.isApprox(angular, 1e-9)) << claimed << "\n\n" << angular;
  const Vec3 v = last.velocity.head<3>();
  const Mat3 linear = R.transpose() * sum.topLeftCorner<3, 3>() * R / (dt * dt) +
                      std::pow(last.log_scale_sigma, 2) * v * v.transpose();
  const Mat3 claimed_linear = last.velocity_covariance.topLeftCorner<3, 3>();
  EXPECT_TRUE(claimed_linear.isApprox(linear, 1e-9)) << claimed_linear << "\n\n" << linear;
}

TEST(StereoOdometry, RepeatedRunIsTheSameToTheLastBitWithOneThreadOrTwo) {
  std::vector<std::vector<TrajectoryPose>> results;
  for (const int threads : {1, 1, 2}) {
    StereoOdometryConfig config = test_config();
    config.threads = threads;
    Playback run(config);
    run.give_drive(0, 18);
    results.push_back(run.odometry.refined_trajectory());
    const auto live = published(run.recorder);
    results.back().insert(results.back().end(), live.begin(), live.end());
  }
  for (std::size_t k = 1; k < results.size(); ++k) {
    ASSERT_EQ(results[k].size(), results[0].size());
    for (std::size_t i = 0; i < results[0].size(); ++i) {
      const Mat4 a = results[0][i].T_odom_left.matrix();
      const Mat4 b = results[k][i].T_odom_left.matrix();
      Checksum bits_of_a;
      Checksum bits_of_b;
      bits_of_a.add(std::span(a.data(), 16));
      bits_of_b.add(std::span(b.data(), 16));
      EXPECT_EQ(bits_of_a.value(), bits_of_b.value()) << "pose " << i;
    }
  }
}

TEST(StereoOdometry, MonoModeClaimsNoScale) {
  StereoOdometryConfig config = test_config();
  config.mode = OdometryMode::kMono;
  Playback run(config);
  run.give_drive(0, 15);
  for (const OdometryOutput& o : run.recorder.frames) {
    EXPECT_TRUE(o.pose_valid);
    EXPECT_FALSE(o.scale_valid);
    EXPECT_EQ(o.state, OdometryState::kTracking) << o.reason;
  }
  EXPECT_TRUE(run.recorder.scales.empty());
  // Its first keyframe has stereo depth all the same.
  expect_follows_the_drive(run.odometry.refined_trajectory(), 0.02, 0.06);
}

TEST(StereoOdometry, StaticResidualsHoldTheScaleInModeStereo) {
  StereoOdometryConfig config = test_config();
  config.mode = OdometryMode::kStereo;
  Playback run(config);
  run.give_drive(0, kDriveFrames);
  run.odometry.finish();
  for (const OdometryOutput& o : run.recorder.frames) {
    EXPECT_TRUE(o.scale_valid);
    EXPECT_EQ(o.state, OdometryState::kTracking) << o.reason;
    EXPECT_EQ(o.log_scale, 0.0) << "no similarity";
    EXPECT_GT(o.log_scale_sigma, 0.0);
  }
  EXPECT_GE(run.recorder.scales.size(), 3U);
  for (const ScaleRecord& r : run.recorder.scales) {
    EXPECT_EQ(r.correction, 0.0);
    EXPECT_EQ(r.verdict, ScaleVerdict::kAccepted);
    EXPECT_LT(std::abs(r.measured), 0.03) << "what the optimizer sees agrees";
  }
  const OdometryOutput& last = run.recorder.frames.back();
  EXPECT_LT(last.log_scale_sigma, 0.01);
  EXPECT_GT(last.pose_covariance.diagonal().minCoeff(), 0.0);
  expect_follows_the_drive(published(run.recorder), 0.015, 0.02);
  expect_follows_the_drive(run.odometry.refined_trajectory(), 0.015, 0.02);
}

TEST(StereoOdometry, StaticResidualsBringBackAWrongScaleAtTheStart) {
  StereoOdometryConfig config = test_config();
  config.mode = OdometryMode::kStereo;
  Playback run(config);
  run.give(first_frame_of_narrow_rig(0.97));
  run.give_drive(1, kDriveFrames);
  const auto trajectory = run.odometry.refined_trajectory();
  const std::vector<TrajectoryPose> second_half(trajectory.begin() + kDriveFrames / 2,
                                                trajectory.end());
  EXPECT_NEAR(drive_error(second_half).scale, 1.0, 0.02);
}

TEST(StereoOdometry, ModeStereoBeginsFromTwoViewsToo) {
  StereoOdometryConfig config = test_config();
  config.mode = OdometryMode::kStereo;
  config.init = InitMethod::kTwoView;
  Playback run(config);
  for (int i = 0; i < 2 * kDriveFrames && run.recorder.scales.size() < 6; ++i)
    run.give(drive_frame(i));
  ASSERT_TRUE(run.recorder.frames.back().scale_valid) << run.recorder.frames.back().reason;
  const auto corrections = std::count_if(run.recorder.scales.begin(), run.recorder.scales.end(),
                                         [](const ScaleRecord& r) { return r.correction != 0.0; });
  EXPECT_EQ(corrections, 1) << "the cold start gives the map its unit; then residuals hold it";
  expect_follows_the_drive(run.odometry.refined_trajectory(), 0.02, 0.05);
}

TEST(StereoOdometry, TwoViewStartFindsItsScale) {
  StereoOdometryConfig config = test_config();
  config.init = InitMethod::kTwoView;
  Playback run(config);
  for (int i = 0; i < 2 * kDriveFrames && run.recorder.scales.size() < 4; ++i)
    run.give(drive_frame(i));
  const auto& frames = run.recorder.frames;
  EXPECT_EQ(frames[0].state, OdometryState::kInitializing);
  EXPECT_FALSE(frames[0].pose_valid);
  EXPECT_NE(frames[1].reason.find("two views"), std::string::npos) << frames[1].reason;
  ASSERT_TRUE(frames.back().scale_valid) << frames.back().reason;
  const auto start = std::find_if(run.recorder.scales.begin(), run.recorder.scales.end(),
                                  [](const ScaleRecord& r) { return r.correction != 0.0; });
  ASSERT_NE(start, run.recorder.scales.end());
  EXPECT_GT(std::abs(start->correction), 0.05) << "a map without unit is not metric by chance";
  // What was built before the scale was known is metric in the refined trajectory, too.
  expect_follows_the_drive(run.odometry.refined_trajectory(), 0.02, 0.05);
}

TEST(StereoOdometry, WrongScaleAtTheStartIsCorrected) {
  StereoOdometryConfig config = test_config();
  config.vo.window.free_static_weight = 0.0;  // by similarities alone
  Playback run(config);
  run.give(first_frame_of_narrow_rig(0.93));
  run.give_drive(1, kDriveFrames);
  double sum = 0.0;
  for (const ScaleRecord& r : run.recorder.scales) sum += r.correction;
  // Depths came out 1 / 0.93 too long.
  EXPECT_NEAR(sum, std::log(0.93), 0.03);
  EXPECT_NEAR(run.recorder.frames.back().log_scale, sum, 0.005);
  const auto trajectory = run.odometry.refined_trajectory();
  const std::vector<TrajectoryPose> second_half(trajectory.begin() + kDriveFrames / 2,
                                                trajectory.end());
  EXPECT_NEAR(drive_error(second_half).scale, 1.0, 0.04);
}

TEST(StereoOdometry, WrongScaleAtTheStartIsDrawnToThatOfTheRightImages) {
  Playback run(test_config());
  run.give(first_frame_of_narrow_rig(0.93));
  run.give_drive(1, kDriveFrames);
  const auto trajectory = run.odometry.refined_trajectory();
  const std::vector<TrajectoryPose> second_half(trajectory.begin() + kDriveFrames / 2,
                                                trajectory.end());
  EXPECT_NEAR(drive_error(second_half).scale, 1.0, 0.02);
}

TEST(StereoOdometry, StampsThatRepeatOrGoBackAreRefused) {
  Playback run(test_config());
  run.give_drive(0, 4);
  const OdometryOutput repeated = run.give(drive_frame(3));
  EXPECT_EQ(repeated.state, OdometryState::kDegraded);
  EXPECT_FALSE(repeated.pose_valid);
  EXPECT_NE(repeated.reason.find("repeats"), std::string::npos) << repeated.reason;
  EXPECT_EQ(repeated.rejected, 1U);
  const OdometryOutput reversed = run.give(drive_frame(1));
  EXPECT_NE(reversed.reason.find("older"), std::string::npos) << reversed.reason;
  EXPECT_EQ(reversed.rejected, 2U);
  EXPECT_EQ(reversed.received, 6U);
  run.give_drive(4, 8);
  EXPECT_EQ(run.recorder.frames.back().state, OdometryState::kTracking);
  expect_follows_the_drive(published(run.recorder), 0.015, 0.05);
}

TEST(StereoOdometry, BadImagesAreReportedAndTrackingGoesOn) {
  Playback run(test_config());
  run.give_drive(0, 4);
  const auto refused = [&](const StereoFrame& frame, const std::string& word) {
    const OdometryOutput o = run.give(frame);
    EXPECT_EQ(o.state, OdometryState::kDegraded);
    EXPECT_FALSE(o.pose_valid);
    EXPECT_NE(o.reason.find("left"), std::string::npos) << o.reason;
    EXPECT_NE(o.reason.find(word), std::string::npos) << o.reason;
  };
  const auto without_scale = [&](const StereoFrame& frame, const std::string& word) {
    const OdometryOutput o = run.give(frame);
    EXPECT_EQ(o.state, OdometryState::kDegraded);
    EXPECT_TRUE(o.pose_valid);
    EXPECT_NE(o.reason.find("right"), std::string::npos) << o.reason;
    EXPECT_NE(o.reason.find(word), std::string::npos) << o.reason;
  };
  refused(with_left(drive_frame(4), [](int, int) { return 0; }), "black");
  StereoFrame frame = drive_frame(5);
  frame.left.valid = frame.right.valid = false;
  refused(frame, "missing");
  frame = drive_frame(6);
  frame.left.width = 239;
  refused(frame, "239x180");
  frame = drive_frame(7);
  frame.left.data = std::make_shared<std::vector<std::uint8_t>>(100);
  refused(frame, "shorter");
  frame = drive_frame(7);
  frame.left.data = nullptr;
  refused(frame, "missing");
  EXPECT_EQ(run.recorder.frames.back().rejected, 5U);
  frame = drive_frame(8);
  frame.right.valid = false;
  without_scale(frame, "missing");
  frame = drive_frame(9);
  frame.right.height = 90;
  without_scale(frame, "240x90");
  run.give_drive(10, 16);
  EXPECT_EQ(run.recorder.frames.back().state, OdometryState::kTracking)
      << run.recorder.frames.back().reason;
  expect_follows_the_drive(published(run.recorder), 0.015, 0.05);
  EXPECT_EQ(run.odometry.refined_trajectory().size(), published(run.recorder).size());
}

TEST(StereoOdometry, NothingButBadImagesNeverBegins) {
  StereoOdometryConfig config = test_config();
  config.init = InitMethod::kStereo;
  Playback run(config);
  const OdometryOutput black = run.give(with_left(drive_frame(0), [](int, int) { return 0; }));
  EXPECT_EQ(black.state, OdometryState::kInitializing);
  EXPECT_NE(black.reason.find("black"), std::string::npos) << black.reason;
  StereoFrame frame = drive_frame(1);
  frame.right.valid = false;
  EXPECT_NE(run.give(frame).reason.find("right image"), std::string::npos);
  const OdometryOutput grey = run.give(with_left(drive_frame(2), [](int, int) { return 90; }));
  EXPECT_EQ(grey.state, OdometryState::kInitializing);
  EXPECT_NE(grey.reason.find("matches"), std::string::npos) << grey.reason;
  EXPECT_TRUE(run.odometry.refined_trajectory().empty());
  EXPECT_TRUE(run.give(drive_frame(3)).pose_valid);
}

TEST(StereoOdometry, TellsWhenItIsTheExposuresFault) {
  const auto saturated = [](int x, int) { return x < 220 ? 255 : 120; };
  const auto dark = [](int x, int y) { return y < 170 ? (7 * x + 13 * y) % 6 : 120; };
  const auto reason_of = [](const std::function<int(int, int)>& value, int from) {
    Playback run(test_config());
    run.give_drive(0, from);
    const OdometryOutput out = run.give(with_left(drive_frame(from), value));
    EXPECT_FALSE(out.pose_valid);
    return out.reason;
  };
  for (const int from : {0, 4}) {
    EXPECT_NE(reason_of(saturated, from).find("shorten the exposure"), std::string::npos);
    EXPECT_NE(reason_of(dark, from).find("lengthen the exposure"), std::string::npos);
    const std::string grey = reason_of([](int, int) { return 90; }, from);
    EXPECT_NE(grey, "");
    EXPECT_EQ(grey.find("exposure"), std::string::npos) << grey;
  }
}

/// Of a drive that jolts: every third frame is blurred.
struct JoltedDrive {
  int tracked = 0;
  int keyframes = 0;
  int blurred_keyframes = 0;

  explicit JoltedDrive(const StereoOdometryConfig& config) {
    Playback run(config);
    for (int i = 0; i < 60; ++i) {
      StereoFrame frame = drive_frame(i);
      const bool jolt = i % 3 == 2;
      if (jolt) frame.left = blurred(frame.left, 2);
      if (jolt) frame.right = blurred(frame.right, 2);
      const OdometryOutput out = run.give(frame);
      tracked += out.pose_valid ? 1 : 0;
      keyframes += out.is_keyframe ? 1 : 0;
      blurred_keyframes += out.is_keyframe && jolt ? 1 : 0;
    }
  }
};

TEST(StereoOdometry, BlurredFramesMakeNoKeyframesWhereSharpOnesCome) {
  StereoOdometryConfig config = test_config();
  config.vo.keyframe.flow_translation = 0.015;  // a keyframe every five frames or so
  const JoltedDrive drive(config);
  EXPECT_EQ(drive.tracked, 60);
  EXPECT_GE(drive.keyframes, 5);
  EXPECT_EQ(drive.blurred_keyframes, 0);
  config.vo.keyframe.blurred_sharpness = 0.0;
  EXPECT_GT(JoltedDrive(config).blurred_keyframes, 0) << "the test needs another drive";
}

TEST(StereoOdometry, StagesAreTimedOnceAFrame) {
  class Counter : public StageObserver {
   public:
    void on_stage(Stage stage, double seconds) override {
      EXPECT_GE(seconds, 0.0);
      ++count[static_cast<std::size_t>(stage)];
    }
    void on_window(std::uint32_t points, std::uint32_t residuals) override {
      EXPECT_GT(points, 0U);
      EXPECT_GT(residuals, 0U);
      ++windows;
    }
    std::array<int, static_cast<std::size_t>(Stage::kCount)> count{};
    int windows = 0;
  } counter;
  Recorder recorder;
  StereoOdometry odometry(test_config(), test_cameras(), &recorder, &counter);
  for (int i = 0; i < 12; ++i) odometry.process(drive_frame(i));
  const auto of = [&](Stage s) { return counter.count[static_cast<std::size_t>(s)]; };
  EXPECT_EQ(of(Stage::kFrame), 12);
  EXPECT_EQ(of(Stage::kPyramid), 12);
  EXPECT_EQ(of(Stage::kTracking), 11);
  EXPECT_EQ(of(Stage::kTracing), 11);
  int keyframes = -1;  // the first one is not mapped
  for (const KeyframeOutput& k : recorder.keyframes) keyframes += k.revised ? 0 : 1;
  EXPECT_GT(keyframes, 0);
  EXPECT_EQ(of(Stage::kBundleAdjustment), keyframes);
  EXPECT_EQ(of(Stage::kMarginalization), keyframes);
  EXPECT_EQ(of(Stage::kScaleOptimization), keyframes);
  EXPECT_EQ(counter.windows, keyframes);
}

}  // namespace
}  // namespace sovo
