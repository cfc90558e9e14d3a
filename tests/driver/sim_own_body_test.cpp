#include <gtest/gtest.h>

#include <algorithm>

#include "driver/sim_vehicle_rig.h"
#include "sovo/driver/sim/own_body.h"
#include "sovo/driver/sim/sim_source.h"

namespace sovo::sim {
namespace {

using Eigen::Vector3f;

StereoRig body_rig() {
  StereoRig rig = vehicle_rig();
  rig.T_right_left = SE3(SO3::exp({0.006, -0.02, 0.004}), Vec3(-0.2, 0.002, 0.003));
  return rig;
}

OwnBody::Daylight noon() { return {Vector3f(0.0F, -1.0F, 0.0F), 0.4F, 0.8F, 1.0F}; }

ImageF drawn(const OwnBody& body, const OwnBody::Daylight& light, float world) {
  ImageF picture(160, 112);
  picture.fill(world);
  body.draw(light, &picture);
  return picture;
}

class OwnBodyTest : public ::testing::TestWithParam<Body> {};

TEST_P(OwnBodyTest, BothCamerasSeeTheSameBody) {
  const StereoRig rig = body_rig();
  const RayTable left_rays(rig.left);
  const RayTable right_rays(rig.right);
  const OwnBody left(GetParam(), rig, Side::kLeft, left_rays, {});
  const OwnBody right(GetParam(), rig, Side::kRight, right_rays, {});
  EXPECT_GT(left.share(), 0.03);
  EXPECT_LT(left.share(), 0.4);
  int seen_by_both = 0;
  int alike = 0;
  for (int y = 2; y < 110; y += 3) {
    for (int x = 2; x < 158; x += 3) {
      const auto range = left.range_at(Vec2(x, y));
      if (!range) continue;
      const Vec3 point = (*range * left_rays.ray(x, y)).cast<double>();
      const Vec3 in_right = rig.T_right_left * point;
      const auto pixel = rig.right.project(in_right);
      if (!pixel || !rig.right.contains(*pixel, 2)) continue;
      const auto other = right.range_at(*pixel);
      if (!other) continue;
      ++seen_by_both;
      alike += std::abs(*other - static_cast<float>(in_right.norm())) < 0.02F ? 1 : 0;
    }
  }
  EXPECT_GT(seen_by_both, 20);
  EXPECT_GT(alike, 0.85 * seen_by_both) << "but for what one arm hides of the other";
}

TEST_P(OwnBodyTest, LiesOverTheWorldAndHasItsDistances) {
  const StereoRig rig = body_rig();
  const RayTable rays(rig.left);
  const OwnBody body(GetParam(), rig, Side::kLeft, rays, {});
  const ImageF dark = drawn(body, noon(), 0.0F);
  const ImageF bright = drawn(body, noon(), 1.0F);
  ImageF range(160, 112);
  range.fill(10.0F);
  body.cover(&range);
  double covered = 0.0;
  for (int y = 0; y < 112; ++y) {
    for (int x = 0; x < 160; ++x) {
      const float share = 1.0F - (bright.at(x, y) - dark.at(x, y));
      covered += double{share} / (160.0 * 112.0);
      EXPECT_EQ(range.at(x, y) < 10.0F, share > 0.499F) << x << " " << y;
      EXPECT_EQ(body.range_at(Vec2(x, y)).value_or(10.0F), range.at(x, y));
    }
  }
  EXPECT_NEAR(covered, body.share(), 1e-4);
}

INSTANTIATE_TEST_SUITE_P(Kinds, OwnBodyTest, ::testing::Values(Body::kBonnet, Body::kArms));

TEST(OwnBodyTest, IsLitFromItsSideOfTheSunAndByItsLamps) {
  const StereoRig rig = body_rig();
  const RayTable rays(rig.left);
  const OwnBody body(Body::kBonnet, rig, Side::kLeft, rays, {});
  OwnBody::Daylight from_below = noon();
  from_below.to_sun = Vector3f(0.0F, 1.0F, 0.0F);
  OwnBody::Daylight half = noon();
  half.factor = 0.5F;
  const float sun = drawn(body, noon(), 0.0F).at(80, 100);
  const float sky = drawn(body, from_below, 0.0F).at(80, 100);
  EXPECT_GT(sun, 1.5F * sky);
  EXPECT_NEAR(drawn(body, half, 0.0F).at(80, 100), 0.5F * sun, 1e-5F);
  LampConfig lamps;
  lamps.count = 2;
  const OwnBody by_night(Body::kBonnet, rig, Side::kLeft, rays,
                         place_lamps(lamps, rig, Side::kLeft, 0.0));
  OwnBody::Daylight none = noon();
  none.ambient = none.sun = 0.0F;
  EXPECT_GT(drawn(by_night, none, 0.0F).at(80, 100), 0.01F);
  EXPECT_EQ(drawn(body, none, 0.0F).at(80, 100), 0.0F);
}

TEST(OwnBodyTest, NoneIsNowhere) {
  const OwnBody none;
  ImageF picture(160, 112);
  picture.fill(0.3F);
  none.draw(noon(), &picture);
  EXPECT_TRUE(std::all_of(picture.data(), picture.data() + picture.size(),
                          [](float v) { return v == 0.3F; }));
  EXPECT_EQ(none.share(), 0.0);
  EXPECT_FALSE(none.range_at(Vec2(80, 100)).has_value());
}

/// A car's pictures at 9 m/s: the bonnet stays, unblurred; the road does not.
TEST(OwnBodyTest, StaysInItsPlaceWhileTheWorldPasses) {
  SimConfig config;
  config.world = World::kStreet;
  config.own_body = Body::kBonnet;
  config.start = 60;
  config.frames = 2;
  config.sensor.read_noise = config.sensor.shot_noise = 0.0;
  config.sensor.auto_exposure = false;
  auto source = open_sim(config);
  ASSERT_TRUE(source) << source.error();
  std::vector<SideImage> images;
  std::vector<std::int64_t> stamps;
  for (int i = 0; i < 2; ++i) {
    SourceResult result = (*source)->next(std::chrono::seconds(60));
    ASSERT_EQ(result.state, SourceState::kFrame);
    images.push_back(result.frame.left);
    stamps.push_back(result.frame.stamp_ns);
  }
  const auto change = [&](int y) {
    double sum = 0.0;
    for (std::size_t x = 250; x < 390; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * 640 + x;
      sum += std::abs(int{(*images[0].data)[i]} - int{(*images[1].data)[i]}) / 140.0;
    }
    return sum;
  };
  EXPECT_LT(change(380), 1.5) << "but for the light";
  EXPECT_GT(change(260), 4.0);
  const ImageF depth = (*source)->depth_at(stamps[1]);
  EXPECT_LT(depth.at(320, 380), 2.0F);
  EXPECT_GT(depth.at(320, 260), 4.0F);
  const auto at = (*source)->depth_at(stamps[1], {Vec2(320, 380), Vec2(320, 260)});
  EXPECT_NEAR(at[0], depth.at(320, 380), 1e-3F);
  EXPECT_NEAR(at[1], depth.at(320, 260), 1e-3F);
}

}  // namespace
}  // namespace sovo::sim
