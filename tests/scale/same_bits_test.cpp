#include "support/same_bits.h"

#include <gtest/gtest.h>

#include "scale/scale_test_support.h"
#include "sovo/scale/scale_alignment.h"

namespace sovo {
namespace {

ScalePoints plain_points(const CameraModel& camera) {
  ScalePoints out;
  out.size = 803;
  out.padded = 808;
  out.t[0] = -0.2F;
  out.t[1] = 0.006F;
  out.t[2] = 0.01F;
  const auto padded = static_cast<std::size_t>(out.padded);
  for (auto* array :
       {&out.u, &out.v, &out.mx, &out.my, &out.inverse_depth, &out.reference, &out.visible}) {
    array->assign(padded, 0.0F);
  }
  out.mz.assign(padded, 1.0F);
  out.relative_variance.assign(padded, 1e-4F);
  std::mt19937 random(6);
  const auto fraction = [&random] { return static_cast<float>(random() % 4096U) / 4096.0F; };
  for (std::size_t i = 0; i < static_cast<std::size_t>(out.size); ++i) {
    out.u[i] = 2.0F + fraction() * static_cast<float>(camera.width - 5);
    out.v[i] = 2.0F + fraction() * static_cast<float>(camera.height - 5);
    out.mx[i] = (out.u[i] - static_cast<float>(camera.cx)) / static_cast<float>(camera.fx);
    out.my[i] = (out.v[i] - static_cast<float>(camera.cy)) / static_cast<float>(camera.fy);
    out.inverse_depth[i] = 0.1F + fraction();
    out.visible[i] = 1.0F;
  }
  return out;
}

TEST(SameBits, ScaleAlignment) {
  for (const auto& [kind, expected] : {std::pair(test::Right::kRadtan, 0x7043d8e7089561c9U),
                                       std::pair(test::Right::kEquidistant, 0x49b95462df758b3eU)}) {
    const StereoRig rig = test::make_rig(kind);
    const auto left = test::pyramid_of(test::noise_image(rig.left.width, rig.left.height, 4));
    const auto right = test::pyramid_of(test::noise_image(rig.right.width, rig.right.height, 5));
    const ScaleOptimizerConfig config;
    const RightProjection projection(rig.right);
    ScaleWorkspace workspace;
    workspace.points = plain_points(rig.left);
    ScaleAlignment alignment(config, projection, *left, *right, &workspace);
    test::Checksum sum;
    for (const int level : {1, 0}) {
      alignment.set_level(level);
      alignment.linearize(0.0);
      alignment.fit_brightness();
      EXPECT_GT(alignment.used(), 400);
      const ScaleSums sums = alignment.sums();
      for (const double x : {sums.H, sums.b, sums.W_e2, sums.inliers, sums.count}) sum.add(x);
      sum.add(alignment.brightness().gain);
      sum.add(alignment.brightness().bias);
    }
    EXPECT_EQ(sum.value(), expected);
  }
}

}  // namespace
}  // namespace sovo
