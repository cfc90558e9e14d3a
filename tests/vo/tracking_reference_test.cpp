#include "sovo/vo/tracking_reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

/// What is far away or lies along the way says nothing of how far one went; a weak texture does,
/// when its pixels count as they err.
TEST(TrackingReference, PixelsOfWeakTextureWeighMoreThanThoseOfEdges) {
  const SyntheticScene scene(3);
  const Window window = window_of_one(scene);
  const std::vector<SeenPoint> points = active_points(window);
  const TrackingReference equal = build_tracking_reference(window, points, 1, 1e6);
  const TrackingReference reference = build_tracking_reference(window, points, 1, 10.0);
  const ReferenceLevel& level = reference.levels[0];
  const ImageF& image = window.newest().image();
  ASSERT_EQ(level.weight.size(), level.size());
  double sum = 0.0;
  std::size_t steepest = 0;
  std::size_t flattest = 0;
  std::vector<double> gradients;
  for (std::size_t i = 0; i < level.size(); ++i) {
    EXPECT_NEAR(equal.levels[0].weight[i], 1.0F, 1e-4F);
    sum += static_cast<double>(level.weight[i]);
    const int x = static_cast<int>(level.u[i]);
    const int y = static_cast<int>(level.v[i]);
    gradients.push_back(0.5 * std::hypot(image.at(x + 1, y) - image.at(x - 1, y),
                                         image.at(x, y + 1) - image.at(x, y - 1)));
    if (gradients[i] > gradients[steepest]) steepest = i;
    if (gradients[i] < gradients[flattest]) flattest = i;
  }
  EXPECT_NEAR(sum / static_cast<double>(level.size()), 1.0, 1e-4);
  const double expected =
      (100.0 + std::pow(gradients[steepest], 2)) / (100.0 + std::pow(gradients[flattest], 2));
  EXPECT_GT(expected, 2.0);
  EXPECT_NEAR(level.weight[flattest] / level.weight[steepest], expected, 1e-3 * expected);
}

/// What is near is seen in a frame or two, so that it is tracked as soon as stereo knows its depth.
TEST(TrackingReference, HasTheMatchedPixelsOfItsKeyframe) {
  const SyntheticScene scene(3);
  Window window = window_of_one(scene);
  Keyframe& k = window[0];
  k.points.clear();
  const auto immature = [&k](float u, float rho, float sigma) {
    ImmaturePoint p;
    p.u = u;
    p.v = 40.0F;
    p.rho_min = 0.9F * rho;
    p.rho_max = 1.1F * rho;
    p.static_information = sigma > 0.0F ? 25.0F / (sigma * sigma) : 0.0F;
    k.immature.push_back(p);
  };
  immature(50.0F, 0.5F, 0.02F);
  immature(60.0F, 0.5F, 0.2F);  // known to two fifths only
  immature(70.0F, 0.5F, 0.0F);  // not matched
  EXPECT_TRUE(active_points(window).empty());
  const TrackingReference reference =
      build_tracking_reference(window, matched_points(window), 1, 50.0);
  ASSERT_EQ(reference.levels[0].size(), 1U);
  EXPECT_EQ(reference.levels[0].u[0], 50.0F);
  EXPECT_EQ(reference.levels[0].v[0], 40.0F);
  EXPECT_NEAR(reference.levels[0].rho[0], 0.5F, 1e-6F);
}

TEST(WeakTexture, BringsThresholdsDownUnlessResidualsAreLarge) {
  const WeakTextureConfig c;
  EXPECT_EQ(threshold_share(c, 30.0, 20.0, 0.0), 1.0);
  EXPECT_EQ(threshold_share(c, c.from_gradient, 20.0, 1.0), 1.0);
  EXPECT_EQ(threshold_share(c, c.to_gradient, 20.0, 0.0), c.least_share);
  EXPECT_EQ(threshold_share(c, 0.0, 20.0, 1.0), c.least_share);
  const double middle = 0.5 * (c.from_gradient + c.to_gradient);
  EXPECT_NEAR(threshold_share(c, middle, 20.0, 0.0), 0.5 * (1.0 + c.least_share), 1e-12);
  EXPECT_NEAR(threshold_share(c, 0.0, 20.0, 4.0), c.least_rms * 4.0 / 20.0, 1e-12);
  EXPECT_EQ(threshold_share(c, 0.0, 20.0, 9.0), 1.0);
}

TEST(WeakTexture, AQuarterOfTheGradientsIsLower) {
  ReferenceLevel level;
  ImageF image(64, 32);
  // Ramps along the rows, steeper every eight of them.
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 64; ++x)
      image.at(x, y) = static_cast<float>(x) * 0.25F * static_cast<float>(y / 8);
  }
  for (int row : {4, 12, 20, 28}) {  // slopes 0, 1/4, 1/2, 3/4
    for (int x = 10; x < 50; ++x) {
      level.u.push_back(static_cast<float>(x));
      level.v.push_back(static_cast<float>(row));
      level.rho.push_back(1.0F);
      level.colour.push_back(image.at(x, row));
    }
  }
  EXPECT_NEAR(lower_gradient(image, level.u, level.v), 0.25, 1e-6);
}

}  // namespace
}  // namespace sovo
