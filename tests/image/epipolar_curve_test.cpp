#include "sovo/image/epipolar_curve.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/cameras.h"
#include "support/numeric.h"

namespace sovo {
namespace {

/// Straightened left, raw right, both behind panes.
StereoRig rig_through_panes() {
  StereoRig rig;
  rig.left = test::make_camera(640, 400, 420, 420, 316, 203);
  rig.left.port = {.distance = 0.05, .thickness = 0.01};
  rig.left.port->centre = -0.025;
  rig.left.straightened = true;
  rig.right = test::make_camera(640, 400, 300, 301, 322, 198, Distortion::kRadtan,
                                {-0.2, 0.04, 0.0002, -0.0001});
  rig.right.port = {.distance = 0.04, .thickness = 0.012, .normal = Vec3(0.03, 0, 1).normalized()};
  rig.right.port->centre = *centre_behind_port(rig.right);
  rig.T_right_left = SE3(SO3::exp(Vec3(0.01, -0.02, 0.005)), Vec3(-0.15, 0.003, 0.002));
  return rig;
}

TEST(EpipolarCurve, BehindPanesLiesWhereRaysRun) {
  const StereoRig rig = rig_through_panes();
  double most = 0.0;
  for (double u = 60.0; u < 640.0; u += 65.0) {
    for (double v = 20.0; v < 400.0; v += 60.0) {
      const Vec2 pixel(u, v);
      const EpipolarCurve curve = right_curve(rig, rig.T_right_left, pixel);
      const Vec3 ray = *rig.left.unproject(pixel) / rig.left.unproject(pixel)->z();
      for (const double rho : {0.05, 0.5, 1.5}) {
        const Vec3 point = rig.T_right_left * Vec3(rig.left.ray_offset(ray) + ray / rho);
        const auto truth = rig.right.project(rig.right.direction_of(point));
        if (!truth || !rig.right.contains(*truth)) continue;
        // Within 40 degrees of the normal: beyond, where rays pass changes fast.
        if (rig.right.unproject(*truth)->dot(rig.right.port->normal) < 0.766) continue;
        const auto at = curve.at(rho);
        ASSERT_TRUE(at);
        const auto central = rig.right.project(rig.T_right_left * Vec3(ray / rho));
        ASSERT_TRUE(central);
        const double displacement = (*central - *truth).norm();
        most = std::max(most, displacement);
        EXPECT_LT((at->pixel - *truth).norm(), 0.005 + 0.03 * displacement) << pixel.transpose();
        const auto f = [&](const Eigen::Matrix<double, 1, 1>& r) { return curve.at(r[0])->pixel; };
        const Vec2 slope = test::central_differences<2, 1>(f, Eigen::Matrix<double, 1, 1>(rho));
        // That the ray passes elsewhere for another depth is left out of the derivative.
        EXPECT_LT((at->derivative - slope).norm(), 0.12 * slope.norm());
      }
    }
  }
  EXPECT_GT(most, 2.0) << "or the panes do nothing";
}

TEST(EpipolarCurve, BehindPanesLeadsBackToTheLeftPixel) {
  const StereoRig rig = rig_through_panes();
  const SE3 T_left_right = rig.T_right_left.inverse();
  const Vec2 pixel(150.0, 90.0);
  const Vec3 ray = *rig.right.unproject(pixel);
  const EpipolarCurve back(rig.left, T_left_right.rotation() * ray,
                           T_left_right * rig.right.ray_offset(ray), EpipolarCurve::Mat32::Zero());
  const Vec3 point = T_left_right * Vec3(rig.right.ray_offset(ray) + 1.4 * ray);
  const auto at = back.at(1.0 / 1.4);
  ASSERT_TRUE(at);
  EXPECT_LT((at->pixel - *rig.left.project(rig.left.direction_of(point))).norm(), 0.02);
}

}  // namespace
}  // namespace sovo
