#include "sovo/vo/window.h"

#include <gtest/gtest.h>

#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

TEST(WindowTest, PointsThatWentAstrayDoNotMoveTheMeanInverseDepth) {
  Window window = scene_window(3, 6, 1);
  const double before = window.mean_inverse_depth();
  const std::vector<PointRef> points = collect_points(&window);
  for (std::size_t i = 0; i < points.size(); i += 20) points[i].point->rho *= 1e6;
  EXPECT_LT(window.mean_inverse_depth(), 1.4 * before);
  EXPECT_GT(window.mean_inverse_depth(), before);
}

TEST(WindowTest, MeanInverseDepthIsThatOfOrdinaryPoints) {
  Window window = scene_window(3, 6, 1);
  double sum = 0.0;
  const std::vector<PointRef> points = collect_points(&window);
  for (const PointRef& ref : points) sum += ref.point->rho;
  EXPECT_NEAR(window.mean_inverse_depth(), sum / static_cast<double>(points.size()), 1e-12);
}

TEST(WindowTest, AStereoMatchCountsWhereThereIsNoParallax) {
  Point p;
  p.static_information = 5e3F;
  for (const double unit : {0.1, 1.0, 10.0}) {
    p.hessian = 0.5 * kMinRelativeInformation / (unit * unit);
    EXPECT_EQ(depth_information(p, unit), std::max(5e3, p.hessian));
    p.hessian = 2.0 * kMinRelativeInformation / (unit * unit);
    EXPECT_EQ(depth_information(p, unit), p.hessian);
  }
}

}  // namespace
}  // namespace sovo
