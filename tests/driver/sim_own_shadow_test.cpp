#include <gtest/gtest.h>

#include <algorithm>

#include "driver/sim_vehicle_rig.h"
#include "sovo/driver/sim/own_shadow.h"
#include "sovo/driver/sim/renderer.h"
#include "sovo/driver/sim/world.h"

namespace sovo::sim {
namespace {

using Eigen::Vector3f;

TEST(OwnShadowTest, HidesTheSunBehindTheHousingAndNowhereElse) {
  StereoRig rig = vehicle_rig();
  rig.T_right_left = SE3(SO3(), Vec3(-0.2, 0.0, 0.0));
  const OwnShadow shadow(rig, Side::kLeft);
  const Vector3f to_sun = Vector3f(0.0F, -1.0F, -1.0F).normalized();
  // Of the housing, which is within 0.04 m of a line through the cameras, 0.05 m behind them.
  const Vector3f housing(0.0F, 0.0F, -0.05F);
  const Vector3f across = Vector3f(0.0F, 1.0F, -1.0F).normalized();
  const Vector3f below = housing - 2.0F * to_sun;
  EXPECT_EQ(shadow.hidden(below, to_sun), 1.0F);
  EXPECT_EQ(shadow.hidden(below + Vector3f(-1.0F, 0.0F, 0.0F), to_sun), 0.0F);
  EXPECT_NEAR(shadow.hidden(below - 0.04F * across, to_sun), 0.5F, 0.02F);
  // The penumbra is as wide as the sun from there: 2 m times 0.0093.
  EXPECT_GT(shadow.hidden(below - 0.035F * across, to_sun), 0.6F);
  EXPECT_GT(shadow.hidden(below - 0.045F * across, to_sun), 0.01F);
  EXPECT_EQ(shadow.hidden(below - 0.055F * across, to_sun), 0.0F);
  // What lies between the sun and the vehicle is lit.
  EXPECT_EQ(shadow.hidden(housing + 2.0F * to_sun, to_sun), 0.0F);
  EXPECT_FALSE(OwnShadow().falls());
  EXPECT_EQ(OwnShadow().hidden(below, to_sun), 0.0F);
}

TEST(OwnShadowTest, BothCamerasSeeTheSameShadow) {
  const StereoRig rig = vehicle_rig();
  const OwnShadow left(rig, Side::kLeft);
  const OwnShadow right(rig, Side::kRight);
  const Vec3 to_sun = Vec3(0.3, -0.7, -0.6).normalized();
  const Vector3f to_sun_right = (rig.T_right_left.rotation() * to_sun).cast<float>();
  int in_penumbra = 0;
  for (double x = -0.3; x < 0.5; x += 0.0013) {
    const Vec3 point = Vec3(x, 0.0, -0.05) - 1.5 * to_sun;
    const float hidden = left.hidden(point.cast<float>(), to_sun.cast<float>());
    const Vector3f point_right = (rig.T_right_left * point).cast<float>();
    EXPECT_NEAR(right.hidden(point_right, to_sun_right), hidden, 2e-3F) << x;
    in_penumbra += hidden > 0.0F && hidden < 1.0F ? 1 : 0;
  }
  EXPECT_GT(in_penumbra, 0);
}

/// A rover's view of sand, with and without its shadow.
struct Views {
  RenderedImage bright, shaded;
};

Views views_at(const SE3& pose, double t) {
  const Motion motion = own_motion(World::kSand);
  const Scene scene = build_scene(World::kSand, motion, 1);
  const StereoRig rig = vehicle_rig();
  Views views;
  Renderer(scene, rig.left).render(pose, t, &views.bright);
  Renderer(scene, rig.left, {}, OwnShadow(rig, Side::kLeft)).render(pose, t, &views.shaded);
  return views;
}

TEST(OwnShadowTest, TakesTheSunsShareAndMovesWithTheCamera) {
  const Motion motion = own_motion(World::kSand);
  const float share =
      0.35F /
      (0.35F +
       1.2F * static_cast<float>(
                  Vec3(-0.7, 0.35, 0.6).normalized().z()));  // of the light that is the sky's
  std::vector<Vec2> centres;
  for (const double t : {0.0, 4.0}) {
    const Views v = views_at(motion.at(t), t);
    Vec2 sum = Vec2::Zero();
    int dark = 0;
    for (int y = 0; y < v.bright.light.height(); ++y) {
      for (int x = 0; x < v.bright.light.width(); ++x) {
        const float ratio = v.shaded.light.at(x, y) / v.bright.light.at(x, y);
        EXPECT_LT(ratio, 1.001F);
        EXPECT_GT(ratio, share - 0.03F);
        if (ratio > 0.5F) continue;
        sum += Vec2(x, y);
        ++dark;
      }
    }
    ASSERT_GT(dark, 200) << "the sun is behind the vehicle here";
    ASSERT_LT(dark, 160 * 112 / 5);
    centres.emplace_back(sum / dark);
    EXPECT_TRUE(std::equal(v.bright.range.data(), v.bright.range.data() + v.bright.range.size(),
                           v.shaded.range.data()));
  }
  // It has gone two metres; a stone would have left the image.
  EXPECT_GT((motion.at(0.0).inverse() * motion.at(4.0)).translation().norm(), 2.0);
  EXPECT_LT((centres[1] - centres[0]).norm(), 6.0);
}

}  // namespace
}  // namespace sovo::sim
