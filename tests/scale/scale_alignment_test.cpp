#include "sovo/scale/scale_alignment.h"

#include <gtest/gtest.h>

#include "scale/scale_test_support.h"

namespace sovo {
namespace {

using test::Right;

/// A snapshot of random points, whatever the images show.
KeyframeSnapshot random_keyframe(const CameraModel& camera, int count) {
  KeyframeSnapshot keyframe;
  keyframe.camera = camera;
  std::mt19937 random(11);
  for (int i = 0; i < count; ++i) {
    keyframe.points.u.push_back(static_cast<float>(test::uniform(random, 0, camera.width - 1)));
    keyframe.points.v.push_back(static_cast<float>(test::uniform(random, 0, camera.height - 1)));
    keyframe.points.inverse_depth.push_back(static_cast<float>(test::uniform(random, 0.1, 1.0)));
    keyframe.points.sigma.push_back(0.01F);
  }
  return keyframe;
}

class ProjectionTest : public testing::TestWithParam<Right> {};

TEST_P(ProjectionTest, AgreesWithTheCameraModelAndItsDerivative) {
  const StereoRig rig = test::make_rig(GetParam());
  const auto keyframe = random_keyframe(rig.left, 203);
  ScalePoints points;
  points.prepare(keyframe, rig, SE3(), 0.01);
  ScaleProjections found;
  for (const int level : {0, 2}) {
    const double sigma = 0.3;
    RightProjection(rig.right).project(points, sigma, level, &found);
    const CameraModel right = rig.right.at_level(level);
    int compared = 0;
    for (std::size_t i = 0; i < keyframe.points.size(); ++i) {
      const double depth = 1.0 / static_cast<double>(keyframe.points.inverse_depth[i]);
      const Vec2 pixel(static_cast<double>(keyframe.points.u[i]),
                       static_cast<double>(keyframe.points.v[i]));
      const Vec3 ray = *rig.left.unproject(pixel);
      const auto at = [&](double s) {
        return right.project(rig.T_right_left * Vec3(std::exp(s) * depth / ray.z() * ray));
      };
      const auto here = at(sigma);
      if (!here || !right.contains(*here)) continue;
      const double h = 1e-5;
      const Vec2 slope = (*at(sigma + h) - *at(sigma - h)) / (2.0 * h);
      EXPECT_NEAR(found.x[i], here->x(), 2e-3);
      EXPECT_NEAR(found.y[i], here->y(), 2e-3);
      EXPECT_NEAR(found.jx[i], slope.x(), 1e-3 * slope.norm() + 1e-4);
      EXPECT_NEAR(found.jy[i], slope.y(), 1e-3 * slope.norm() + 1e-4);
      ++compared;
    }
    EXPECT_GT(compared, 120);
  }
}

TEST_P(ProjectionTest, BehindPortsAgreesWithTheCameraModelsAndItsDerivative) {
  StereoRig rig = test::make_rig(GetParam());
  rig.left.port = {.distance = 0.06, .thickness = 0.02, .normal = Vec3(0.02, 0.03, 1).normalized()};
  rig.right.port = {.distance = 0.05, .thickness = 0.02, .normal = Vec3(-0.03, 0, 1).normalized()};
  for (CameraModel* camera : {&rig.left, &rig.right}) {
    camera->port->centre = *centre_behind_port(*camera);
  }
  CameraModel tracked = rig.left;
  tracked.distortion = Distortion::kNone;
  tracked.straightened = true;
  const auto keyframe = random_keyframe(tracked, 203);
  ScalePoints points;
  points.prepare(keyframe, rig, SE3(), 0.01);
  ScaleProjections found;
  for (const int level : {0, 2}) {
    const double sigma = 0.3;
    RightProjection(rig.right).project(points, sigma, level, &found);
    const CameraModel right = rig.right.at_level(level);
    int compared = 0;
    double most = 0.0;
    for (std::size_t i = 0; i < keyframe.points.size(); ++i) {
      const double depth = 1.0 / static_cast<double>(keyframe.points.inverse_depth[i]);
      const Vec2 pixel(static_cast<double>(keyframe.points.u[i]),
                       static_cast<double>(keyframe.points.v[i]));
      const Vec3 ray = *tracked.unproject(pixel) / tracked.unproject(pixel)->z();
      const auto point_at = [&](double s) {
        return Vec3(rig.T_right_left * (tracked.ray_offset(ray) + std::exp(s) * depth * ray));
      };
      const auto at = [&](double s) { return right.project(right.direction_of(point_at(s))); };
      const auto here = at(sigma);
      if (!here || !right.contains(*here)) continue;
      const double h = 1e-5;
      const Vec2 slope = (*at(sigma + h) - *at(sigma - h)) / (2.0 * h);
      EXPECT_NEAR(found.x[i], here->x(), 5e-3);
      EXPECT_NEAR(found.y[i], here->y(), 5e-3);
      // That the right ray passes elsewhere when the scale changes is left out.
      EXPECT_NEAR(found.jx[i], slope.x(), 0.02 * slope.norm());
      EXPECT_NEAR(found.jy[i], slope.y(), 0.02 * slope.norm());
      const auto central = right.project(rig.T_right_left * Vec3(std::exp(sigma) * depth * ray));
      if (central) most = std::max(most, (*central - *here).norm());
      ++compared;
    }
    EXPECT_GT(compared, 80);
    EXPECT_GT(most, level == 0 ? 0.4 : 0.1) << "or the ports do nothing";
  }
}

INSTANTIATE_TEST_SUITE_P(Cameras, ProjectionTest,
                         testing::Values(Right::kRectified, Right::kRadtan, Right::kEquidistant));

TEST(RightProjection, PointsBehindAndBeyondTheFoldAreNowhere) {
  StereoRig rig = test::make_rig(Right::kRadtan);
  rig.T_right_left = SE3(SO3::exp(Vec3(0, 2.5, 0)), Vec3(-0.2, 0, 0));  // looks backwards
  const auto keyframe = random_keyframe(rig.left, 64);
  ScalePoints points;
  points.prepare(keyframe, rig, SE3(), 0.01);
  ScaleProjections found;
  RightProjection(rig.right).project(points, 3.0, 0, &found);
  for (std::size_t i = 0; i < 64; ++i) {
    EXPECT_FALSE(rig.right.contains(Vec2(found.x[i], found.y[i])));
  }
}

/// An image whose values and derivatives are known everywhere; wavelengths are long, so that
/// interpolation adds little of its own.
double smooth(const Vec2& p) {
  return 120.0 + 40.0 * std::sin(0.05 * p.x() + 0.02 * p.y()) +
         30.0 * std::cos(0.04 * p.y() - 0.03 * p.x());
}

TEST(ScaleAlignment, JacobianAgreesWithCentralDifferences) {
  for (const Right kind : {Right::kRectified, Right::kRadtan, Right::kEquidistant}) {
    const StereoRig rig = test::make_rig(kind);
    auto keyframe = random_keyframe(rig.left, 400);
    ImageF image(rig.right.width, rig.right.height);
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        image.at(x, y) = static_cast<float>(smooth(Vec2(x, y)));
      }
    }
    keyframe.pyramid = test::pyramid_of(image);
    ScaleWorkspace workspace;
    workspace.points.prepare(keyframe, rig, SE3(), 0.01);
    const ScaleOptimizerConfig config;
    const RightProjection projection(rig.right);
    ScaleAlignment alignment(config, projection, *keyframe.pyramid, *keyframe.pyramid, &workspace);
    alignment.set_level(0);
    alignment.linearize(0.2);
    int compared = 0;
    double error2 = 0.0;
    double slope2 = 0.0;
    for (std::size_t i = 0; i < keyframe.points.size(); ++i) {
      if (workspace.samples.mask[i] == 0.0F) continue;
      const Vec3 ray = *rig.left.unproject(Vec2(static_cast<double>(keyframe.points.u[i]),
                                                static_cast<double>(keyframe.points.v[i])));
      const Vec3 X = ray / ray.z() / static_cast<double>(keyframe.points.inverse_depth[i]);
      const auto value = [&](double s) {
        return smooth(*rig.right.project(rig.T_right_left * Vec3(std::exp(s) * X)));
      };
      const double h = 1e-4;
      const double slope = (value(0.2 + h) - value(0.2 - h)) / (2.0 * h);
      const double J = static_cast<double>(workspace.samples.gradient[i]);
      EXPECT_NEAR(J, slope, 2e-3 * std::abs(slope) + 0.1);
      error2 += (J - slope) * (J - slope);
      slope2 += slope * slope;
      ++compared;
    }
    EXPECT_GT(compared, 150);
    EXPECT_LT(std::sqrt(error2 / slope2), 1e-3);
  }
}

TEST(ScaleAlignment, PointsBehindANearerOneAreHidden) {
  // Two points of different depth that fall on the same place of the right image, and a lone one.
  const StereoRig rig = test::make_rig(Right::kRectified);
  KeyframeSnapshot keyframe;
  keyframe.camera = rig.left;
  ImageF image(rig.left.width, rig.left.height);
  image.fill(100.0F);
  keyframe.pyramid = test::pyramid_of(image);
  const float near = 0.5F;   // disparity 26 px
  const float far = 0.125F;  // disparity 6.5 px
  keyframe.points.u = {180.0F, 160.5F, 60.0F};
  keyframe.points.v = {100.0F, 100.0F, 100.0F};
  keyframe.points.inverse_depth = {near, far, far};
  keyframe.points.sigma = {0.001F, 0.001F, 0.001F};
  ScaleWorkspace workspace;
  workspace.points.prepare(keyframe, rig, SE3(), 0.01);
  const ScaleOptimizerConfig config;
  const RightProjection projection(rig.right);
  ScaleAlignment alignment(config, projection, *keyframe.pyramid, *keyframe.pyramid, &workspace);
  alignment.find_occlusions(0.0);
  EXPECT_EQ(workspace.points.visible[0], 1.0F);
  EXPECT_EQ(workspace.points.visible[1], 0.0F);
  EXPECT_EQ(workspace.points.visible[2], 1.0F);
}

}  // namespace
}  // namespace sovo
