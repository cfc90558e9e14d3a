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

TEST(WindowTest, WhatAnErasedKeyframeSawIsForgottenAndItsSlotUsedAgain) {
  Window window = scene_window(3, 6, 1);
  const auto slot = static_cast<std::size_t>(window[1].slot);
  ASSERT_FALSE(window[0].points.empty());
  Residual& residual = window[0].points[0].residuals[slot];
  residual.state = ResidualState::kOutlier;
  residual.energy = 7.0F;
  window.erase(1);
  EXPECT_EQ(window.size(), 2);
  EXPECT_EQ(residual.state, ResidualState::kAbsent);
  EXPECT_EQ(residual.energy, 0.0F);
  const Keyframe& next = window.insert(make_keyframe(9, nullptr, SE3()));
  EXPECT_EQ(static_cast<std::size_t>(next.slot), slot);
}

}  // namespace
}  // namespace sovo
