#include <gtest/gtest.h>

#include <filesystem>
#include <numbers>

#include "sovo/driver/sim/noise.h"
#include "sovo/driver/sim/sensor.h"
#include "sovo/driver/sim/world.h"
#include "support/cameras.h"

namespace sovo::sim {
namespace {

TEST(MotionTest, PassesThroughItsSamplesWithoutJumps) {
  Trajectory samples;
  for (int i = 0; i < 30; ++i) {
    const double t = 0.1 * i + 0.02 * (i % 3);
    samples.push_back(
        {static_cast<std::int64_t>(1e9 * t),
         SE3(SO3::exp({0.3 * std::sin(t), t, 0.2 * t * t}), Vec3(t, t * t, std::cos(t)))});
  }
  const Motion motion(samples);
  for (const StampedPose& s : samples) {
    const double t = 1e-9 * static_cast<double>(s.stamp_ns - samples.front().stamp_ns);
    EXPECT_LT((motion.at(t).inverse() * s.T_world_body).log().norm(), 1e-7);
    if (t < 0.05 || t > motion.duration_s() - 0.05) continue;
    constexpr double h = 1e-4;
    const Vec6 before = (motion.at(t - h).inverse() * motion.at(t)).log() / h;
    const Vec6 after = (motion.at(t).inverse() * motion.at(t + h)).log() / h;
    EXPECT_LT((before - after).norm(), 2e-2);
  }
  // Between samples it follows the curve they were taken from.
  const SE3 truth(SO3::exp({0.3 * std::sin(1.55), 1.55, 0.2 * 1.55 * 1.55}),
                  Vec3(1.55, 1.55 * 1.55, std::cos(1.55)));
  EXPECT_LT((motion.at(1.55).inverse() * truth).log().norm(), 2e-3);
}

TEST(MotionTest, WalkAroundTheSquareReturnsAndTurnsAtMostAsFastAsSaid) {
  const Motion walk = own_motion(World::kLawn);
  const Vec3 gap = walk.samples().back().T_world_body.translation() -
                   walk.samples().front().T_world_body.translation();
  EXPECT_LT(gap.norm(), 0.1);
  EXPECT_NEAR(walk.length_m(), 30.0, 3.0);
  double fastest = 0.0;
  for (double t = 0.0; t + 0.05 < walk.duration_s(); t += 0.05) {
    const SO3 turn = walk.at(t).rotation().inverse() * walk.at(t + 0.05).rotation();
    fastest = std::max(fastest, turn.log().norm() / 0.05);
  }
  EXPECT_NEAR(fastest, 0.5 * std::numbers::pi, 0.35);
}

TEST(MotionTest, LanesOfThePoolAre3600MillimetresApart) {
  const Motion mow = own_motion(World::kPool);
  double y = 0.0;
  for (const StampedPose& s : mow.samples()) y = std::max(y, s.T_world_body.translation().y());
  EXPECT_NEAR(y, 3 * 3.6, 0.02);
}

/// No trajectory of the worlds jumps, turns on the spot like a machine, or dives into the ground.
TEST(MotionTest, OwnTrajectoriesAreOnesThatVehiclesCouldFollow) {
  for (const World world :
       {World::kLawn, World::kPool, World::kStreet, World::kHall, World::kSand, World::kHighway}) {
    for (const std::string& name : own_trajectories(world)) {
      const Motion motion = own_motion(world, name);
      constexpr double h = 0.05;
      for (double t = 0.0; t + h < motion.duration_s(); t += h) {
        const SE3 step = motion.at(t).inverse() * motion.at(t + h);
        EXPECT_LT(step.translation().norm() / h, world == World::kHighway ? 30.0 : 23.0)
            << name << " at " << t;
        EXPECT_LT(step.rotation().log().norm() / h, 3.4) << name << " at " << t;
        EXPECT_GT(motion.at(t).translation().z(), 0.3) << name << " at " << t;
      }
    }
  }
  EXPECT_GT(own_motion(World::kStreet, "town").length_m(), 300.0);
  EXPECT_GT(own_motion(World::kStreet, "expressway").length_m(), 500.0);
}

TEST(MotionTest, TheRaceEndsInStandstill) {
  const Motion race = own_motion(World::kHall, "race");
  const double end = race.duration_s();
  const SE3 moved = race.at(end - 5.0).inverse() * race.at(end);
  EXPECT_LT(moved.translation().norm(), 1e-6);
  EXPECT_LT((race.at(13.0).inverse() * race.at(13.1)).translation().norm(), 0.6);
  EXPECT_GT((race.at(13.0).inverse() * race.at(13.1)).translation().norm(), 0.1);
}

/// A drive in the frame of its first camera, as KITTI has it, comes to lie level with z up; a
/// flight of EuRoC's body, whose x axis is up, keeps the world and gets the camera.
TEST(MotionTest, FilesOfOtherConventionsAreBroughtIntoTheWorld) {
  const std::string file = (std::filesystem::path(::testing::TempDir()) / "poses.txt").string();
  Trajectory drive;
  for (int i = 0; i < 100; ++i) {
    const double yaw = 0.01 * i;
    drive.push_back(
        {i * 100'000'000LL, SE3(SO3::exp({0, yaw, 0}), Vec3(0.2 * i, -0.02 * i, 0.8 * i))});
  }
  ASSERT_TRUE(write_kitti_poses(file, drive));
  SimConfig config;
  config.world = World::kStreet;
  config.trajectory = file;
  auto motion = load_motion(config, own_rig(config.world));
  ASSERT_TRUE(motion) << motion.error();
  const SE3 end = motion->samples().back().T_world_body;
  EXPECT_NEAR(end.translation().x(), 0.8 * 99, 1e-6);
  EXPECT_NEAR(end.translation().y(), -0.2 * 99, 1e-6);
  EXPECT_NEAR(end.translation().z(), 1.65, 0.2);
  EXPECT_NEAR((end.rotation() * Vec3::UnitY()).z(), -1.0, 1e-6);

  Trajectory flight;
  Mat3 level;  // x up, z ahead
  level << 0, 0, 1, 0, -1, 0, 1, 0, 0;
  for (int i = 0; i < 100; ++i) {
    flight.push_back({i * 50'000'000LL + 1'000'000'000LL,
                      SE3(SO3::exp({0, 0, 0.02 * i}) * SO3(level), Vec3(0.05 * i, 0.02 * i, 1.0))});
  }
  ASSERT_TRUE(write_tum(file, flight));
  config.world = World::kHall;
  motion = load_motion(config, own_rig(config.world));
  ASSERT_TRUE(motion) << motion.error();
  const SO3 r = motion->samples().front().T_world_body.rotation();
  EXPECT_NEAR((r * Vec3::UnitY()).z(), -1.0, 1e-6);
  EXPECT_NEAR((r * Vec3::UnitZ()).x(), 1.0, 1e-6);
}

/// Bad positions of a vehicle that stands still, as GPS gives them, do not dive through the road.
TEST(MotionTest, StaysAboveLevelGround) {
  const std::string file = (std::filesystem::path(::testing::TempDir()) / "dive.txt").string();
  Trajectory drive;
  for (int i = 0; i < 100; ++i) {
    const double dive = 4.0 * std::exp(-0.01 * (i - 50) * (i - 50));
    drive.push_back({i * 100'000'000LL, SE3(SO3(), Vec3(0.0, dive, 0.2 * i))});
  }
  ASSERT_TRUE(write_kitti_poses(file, drive));
  SimConfig config;
  config.trajectory = file;
  for (const World world : {World::kStreet, World::kLawn}) {
    config.world = world;
    const auto motion = load_motion(config, own_rig(world));
    ASSERT_TRUE(motion) << motion.error();
    double lowest = 10.0;
    for (const StampedPose& p : motion->samples()) {
      lowest = std::min(lowest, p.T_world_body.translation().z());
    }
    EXPECT_NEAR(lowest, 0.35, 1e-9);
  }
}

TEST(MotionBlurTest, TurnSmearsAcrossAndRestLeavesAlone) {
  const CameraModel camera = test::make_camera(64, 48, 100.0, 100.0, 31.5, 23.5);
  const RayTable rays(camera);
  RenderedImage image{ImageF(64, 48), ImageF(64, 48)};
  image.light.fill(0.0F);
  image.range.fill(5.0F);
  for (int y = 0; y < 48; ++y) image.light.at(32, y) = 1.0F;
  ImageF blurred;
  blur_by_motion(rays, image, Vec6::Zero(), 0.01, &blurred);
  EXPECT_EQ(blurred.at(32, 20), 1.0F);
  Vec6 velocity = Vec6::Zero();
  velocity[4] = 4.0;  // 4 rad/s over 10 ms at f = 100: 4 px
  blur_by_motion(rays, image, velocity, 0.01, &blurred);
  double sum = 0.0;
  for (int x = 0; x < 64; ++x) sum += double{blurred.at(x, 23)};
  EXPECT_NEAR(sum, 1.0, 0.1);
  EXPECT_LT(blurred.at(32, 23), 0.4F);
  EXPECT_GT(blurred.at(33, 23), 0.1F);
  EXPECT_EQ(blurred.at(38, 23), 0.0F);
  velocity.setZero();
  velocity[1] = 10.0;  // along the line, which it leaves as it is
  blur_by_motion(rays, image, velocity, 0.01, &blurred);
  EXPECT_NEAR(blurred.at(32, 24), 1.0F, 1e-3);
}

TEST(SensorTest, ExposureFollowsTheLightAndNoiseIsAsConfigured) {
  SensorConfig config;
  config.vignette = 0.0;
  ExposureControl exposure(config, 0.004);
  const Sensor sensor(config, 100, 80);
  ImageF light(100, 80);
  light.fill(0.5F);
  exposure.settle(light);
  const auto mean_of = [](const std::vector<std::uint8_t>& pixels) {
    double sum = 0.0;
    for (const std::uint8_t p : pixels) sum += p;
    return sum / static_cast<double>(pixels.size());
  };
  auto pixels = sensor.expose(light, exposure, false, 3);
  const double mean = mean_of(pixels);
  EXPECT_NEAR(mean, config.target_grey, 0.5);
  double variance = 0.0;
  for (const std::uint8_t p : pixels) variance += (p - mean) * (p - mean) / 8000.0;
  const double expected = 0.6 * 0.6 + 0.8 * 0.8 * mean / 255.0 + 1.0 / 12.0;
  EXPECT_NEAR(variance, expected, 0.15 * expected);
  light.fill(0.05F);
  for (int i = 0; i < 40; ++i) {
    pixels = sensor.expose(light, exposure, false, 4);
    exposure.observe(pixels);
  }
  EXPECT_NEAR(mean_of(pixels), config.target_grey, 4.0);
  EXPECT_GT(exposure.gain_db(), 3.0);  // beyond the longest exposure
  EXPECT_NEAR(exposure.exposure_s(), 0.015, 1e-9);
}

/// A sine moves by a third of a texel as a sine does, at full resolution and on every level.
TEST(TextureTest, IsLookedUpBetweenTexelsAndItsLevelsKeepTheMean) {
  ImageF pattern(64, 64);
  const auto wave = [](double u) { return 0.5 + 0.4 * std::sin(2.0 * std::numbers::pi * u); };
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) pattern.at(x, y) = static_cast<float>(wave((x + 0.5) / 64.0));
  }
  const Texture texture(pattern);
  EXPECT_NEAR(texture.mean(), 0.5, 0.003);
  for (const float level : {0.0F, 0.5F, 1.0F, 2.0F}) {
    for (double u = -1.7; u < 1.7; u += 0.0137) {
      EXPECT_NEAR(texture.sample(u, 0.31, level), wave(u), 0.012) << u << " " << level;
    }
  }
}

}  // namespace
}  // namespace sovo::sim
