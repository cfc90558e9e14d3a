#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "driver/sim_vehicle_rig.h"
#include "sovo/driver/sim/lamps.h"
#include "sovo/driver/sim/renderer.h"
#include "sovo/driver/sim/sim_source.h"
#include "sovo/driver/sim/world.h"

namespace sovo::sim {
namespace {

using Eigen::Vector3f;

/// One lamp between the cameras.
LampConfig one_lamp() {
  LampConfig config;
  config.count = 1;
  config.above_m = 0.0;
  return config;
}

TEST(LampsTest, LightFallsWithDistanceTiltAndTheBeam) {
  const StereoRig rig = vehicle_rig();
  const Lamps lamps = place_lamps(one_lamp(), rig, Side::kLeft, 0.0);
  ASSERT_EQ(lamps.lamps.size(), 1U);
  const Vector3f from = lamps.lamps[0].position;
  EXPECT_LT((from - 0.5 * rig.T_right_left.inverse().translation().cast<float>()).norm(), 1e-6F);
  const Vector3f ahead = Vector3f::UnitZ();
  EXPECT_NEAR(lamps.on_surface(from + ahead, -ahead, false), 1.0F, 1e-5F);
  EXPECT_NEAR(lamps.on_surface(from + 2.0F * ahead, -ahead, false), 0.25F, 1e-5F);
  const Vector3f tilted = Vector3f(0, std::sin(1.0F), -std::cos(1.0F));
  EXPECT_NEAR(lamps.on_surface(from + ahead, tilted, false), std::cos(1.0F), 1e-5F);
  EXPECT_EQ(lamps.on_surface(from + ahead, ahead, false), 0.0F);
  EXPECT_NEAR(lamps.on_surface(from + ahead, ahead, true), 1.0F, 1e-5F);
  // Half of the light at the edge of the beam.
  const double half = 0.5 * one_lamp().beam_deg * std::numbers::pi / 180.0;
  const Vec3 edge(std::sin(half), 0, std::cos(half));
  EXPECT_NEAR(lamps.at(from + edge.cast<float>()), 0.5F, 1e-5F);
}

TEST(LampsTest, BothCamerasHaveTheSameLamps) {
  const StereoRig rig = vehicle_rig();
  LampConfig config = one_lamp();
  config.count = 2;
  config.above_m = 0.3;
  const Lamps left = place_lamps(config, rig, Side::kLeft, 0.2);
  const Lamps right = place_lamps(config, rig, Side::kRight, 0.2);
  const float spacing = (left.lamps[0].position - left.lamps[1].position).norm();
  EXPECT_NEAR(spacing, config.spacing_m, 1e-6);
  for (const Vec3& p : {Vec3(0, 0, 1), Vec3(1, -1, 2), Vec3(-0.4, 0.1, 0.5)}) {
    const Vec3 n = Vec3(0.1, 0.2, -1).normalized();
    const Vec3 p_right = rig.T_right_left * p;
    const Vec3 n_right = rig.T_right_left.rotation() * n;
    const float light = left.on_surface(p.cast<float>(), n.cast<float>(), false);
    EXPECT_GT(light, 0.0F);
    EXPECT_NEAR(right.on_surface(p_right.cast<float>(), n_right.cast<float>(), false), light,
                1e-4F * light);
  }
}

TEST(LampsTest, HazeTakesLightAndSendsSomeBack) {
  const StereoRig rig = vehicle_rig();
  const Lamps clear = place_lamps(one_lamp(), rig, Side::kLeft, 0.0);
  const Lamps hazy = place_lamps(one_lamp(), rig, Side::kLeft, 0.5);
  const Vector3f far = clear.lamps[0].position + 3.0F * Vector3f::UnitZ();
  EXPECT_NEAR(hazy.at(far) / clear.at(far), std::exp(-1.5), 1e-4);
  RayBatch rays;
  rays.count = 3;
  for (std::size_t i = 0; i < 3; ++i) {
    rays.dx[i] = rays.dy[i] = 0.0F;
    rays.dz[i] = 1.0F;
    rays.range[i] = i == 2 ? kInfinity : static_cast<float>(2 + 4 * i);
  }
  BatchFloats light{};
  clear.add_backscatter(rays, 3, &light);
  EXPECT_EQ(light[0], 0.0F);
  hazy.add_backscatter(rays, 3, &light);
  EXPECT_GT(light[0], 0.0F);
  EXPECT_GT(light[1], light[0]);
  EXPECT_TRUE(std::isfinite(light[2]));
}

TEST(LampsTest, InTheDarkOnlyTheBeamIsSeen) {
  SimConfig config;
  config.world = World::kHall;
  const Motion motion = own_motion(config.world);
  const Scene scene = build_scene(config.world, motion, 1);
  const StereoRig rig = vehicle_rig();
  LampConfig lamp = one_lamp();
  lamp.beam_deg = 20.0;
  const SE3 pose = motion.at(6.0);
  RenderedImage day;
  RenderedImage night;
  Renderer(scene, rig.left).render(pose, 6.0, &day);
  Renderer by_lamp(scene, rig.left, place_lamps(lamp, rig, Side::kLeft, scene.haze));
  by_lamp.set_daylight(0.0F);
  by_lamp.render(pose, 6.0, &night);
  EXPECT_TRUE(
      std::equal(day.range.data(), day.range.data() + day.range.size(), night.range.data()));
  const auto mean = [](const ImageF& image, int x0, int y0) {
    double sum = 0.0;
    for (int y = y0; y < y0 + 16; ++y) {
      for (int x = x0; x < x0 + 16; ++x) sum += double{image.at(x, y)};
    }
    return sum / 256.0;
  };
  EXPECT_GT(mean(day.light, 4, 4), 0.01);
  EXPECT_LT(mean(night.light, 4, 4), 0.02 * mean(night.light, 72, 48));
}

TEST(LampsTest, DaylightGoesAsOneDivesAndReturns) {
  LampConfig lamps = one_lamp();
  lamps.ambient = 0.01;
  EXPECT_FLOAT_EQ(share_of_daylight(lamps, 0.0), 0.01F);
  EXPECT_FLOAT_EQ(share_of_daylight(lamps, 1e3), 0.01F);
  lamps.ambient_from_s = 2.0;
  lamps.ambient_until_s = 10.0;
  EXPECT_FLOAT_EQ(share_of_daylight(lamps, 1.9), 1.0F);
  EXPECT_FLOAT_EQ(share_of_daylight(lamps, 2.0), 0.01F);
  EXPECT_FLOAT_EQ(share_of_daylight(lamps, 10.0), 1.0F);
  lamps.fade_s = 4.0;
  EXPECT_FLOAT_EQ(share_of_daylight(lamps, 2.0), 1.0F);
  EXPECT_NEAR(share_of_daylight(lamps, 4.0), 0.1, 1e-6);
  EXPECT_NEAR(share_of_daylight(lamps, 6.0), 0.01, 1e-7);
  EXPECT_NEAR(share_of_daylight(lamps, 12.0), 0.1, 1e-6);
  EXPECT_FLOAT_EQ(share_of_daylight(lamps, 14.0), 1.0F);
  lamps.ambient_until_s = 4.0;  // rises again before it is dark
  EXPECT_NEAR(share_of_daylight(lamps, 5.0), 0.1, 1e-6);
  EXPECT_FLOAT_EQ(share_of_daylight(lamps, 8.0), 1.0F);
  lamps.count = 0;
  EXPECT_FLOAT_EQ(share_of_daylight(lamps, 4.0), 1.0F);
}

TEST(LampsTest, ADiveLeadsFromDaylightIntoTheDark) {
  SimConfig config;
  config.world = World::kPool;
  config.frames = 3;
  config.frame_rate = 20.0;
  config.threads = 1;
  config.lamps.count = 2;
  config.lamps.ambient = 0.05;
  const auto frames_of = [&](double from_s, double until_s) {
    config.lamps.ambient_from_s = from_s;
    config.lamps.ambient_until_s = until_s;
    auto source = open_sim(config);
    EXPECT_TRUE(source) << source.error();
    std::vector<std::vector<std::uint8_t>> images;
    for (int i = 0; i < 3; ++i) {
      const auto result = (*source)->next(std::chrono::seconds(20));
      images.push_back(*result.frame.right.data);
    }
    return images;
  };
  config.sensor.auto_exposure = false;
  const auto day = frames_of(1e6, 1e9);
  const auto dark = frames_of(0.0, 1e9);
  const auto dive = frames_of(0.04, 0.08);
  EXPECT_NE(day[1], dark[1]);
  EXPECT_EQ(dive[0], day[0]);
  EXPECT_EQ(dive[1], dark[1]);
  EXPECT_EQ(dive[2], day[2]);
}

TEST(LampsTest, WrongLampsAreRefused) {
  const auto refused = [](const auto& change) {
    SimConfig config;
    change(&config.lamps);
    const auto source = open_sim(config);
    return source ? std::string() : source.error();
  };
  EXPECT_NE(refused([](LampConfig* l) { l->count = 3; }).find("lamps.count"), std::string::npos);
  EXPECT_NE(refused([](LampConfig* l) { l->spacing_m = -1; }).find("spacing"), std::string::npos);
  EXPECT_NE(refused([](LampConfig* l) { l->above_m = 1e9; }).find("above"), std::string::npos);
  EXPECT_NE(refused([](LampConfig* l) { l->beam_deg = 0; }).find("beam_deg"), std::string::npos);
  EXPECT_NE(refused([](LampConfig* l) { l->ambient = 2; }).find("ambient"), std::string::npos);
  EXPECT_NE(refused([](LampConfig* l) { l->ambient_from_s = -1; }).find("ambient_from_s"),
            std::string::npos);
  EXPECT_NE(refused([](LampConfig* l) {
              l->ambient_from_s = 2;
              l->ambient_until_s = 1;
            }).find("ambient_until_s"),
            std::string::npos);
  EXPECT_NE(refused([](LampConfig* l) { l->fade_s = -1; }).find("fade_s"), std::string::npos);
  EXPECT_NE(refused([](LampConfig* l) { l->backscatter = -1; }).find("backscatter"),
            std::string::npos);
}

}  // namespace
}  // namespace sovo::sim
