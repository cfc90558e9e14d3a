#include "sovo/vo/epipolar_search.h"

#include <gtest/gtest.h>

#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

/// A plane of constant depth seen by two cameras that are one step to the side of each other, in an
/// image whose gradient is all along the step. Everything is known in closed form.
class PlaneSearch : public ::testing::Test {
 protected:
  static constexpr double kDepth = 4.0;
  static constexpr double kStep = 0.12;

  static double texture(double u, double v) {
    return 120.0 + 60.0 * std::sin(0.33 * u) + 30.0 * std::sin(0.071 * u + 0.02 * v + 1.0);
  }
  double disparity() const { return camera_.fx * kStep / kDepth; }

  PlaneSearch() : host_(camera_.width, camera_.height), target_(camera_.width, camera_.height) {
    for (int y = 0; y < camera_.height; ++y) {
      for (int x = 0; x < camera_.width; ++x) {
        host_.at(x, y) = static_cast<float>(texture(x, y));
        target_.at(x, y) = static_cast<float>(texture(x + disparity(), y));
      }
    }
    geometry_ = host_geometry(camera_, SE3(SO3(), Vec3(-kStep, 0, 0)), {});
  }

  ImmaturePoint point_at(int u, int v) const {
    ImmaturePoint p;
    EXPECT_TRUE(make_immature_point(host_, static_cast<float>(u), static_cast<float>(v), 1, config_,
                                    50.0, &p));
    return p;
  }

  CameraModel camera_ = small_camera();
  PointConfig config_;
  ImageF host_, target_;
  HostGeometry geometry_;
};

TEST_F(PlaneSearch, FindsThePositionToATenthOfAPixel) {
  // Gauss-Newton along the line with a wrong Jacobian would stop short or overshoot.
  double worst = 0.0;
  int found = 0;
  for (int u = 40; u < 170; u += 3) {
    ImmaturePoint p = point_at(u, 60);
    p.rho_min = static_cast<float>(0.4 / kDepth);
    p.rho_max = static_cast<float>(2.0 / kDepth);
    if (p.gxx < 8 * 25.0F) continue;
    ASSERT_EQ(trace(target_, geometry_, config_, &p), TraceState::kGood) << u;
    const double rho = 0.5 * (p.rho_min + p.rho_max);
    worst = std::max(worst, std::abs(rho * camera_.fx * kStep - disparity()));
    ++found;
  }
  EXPECT_GT(found, 20);
  EXPECT_LT(worst, 0.1) << "px";
}

TEST_F(PlaneSearch, NewIntervalIsThePixelErrorBothWays) {
  ImmaturePoint p = point_at(94, 60);
  p.rho_min = static_cast<float>(0.4 / kDepth);
  p.rho_max = static_cast<float>(2.0 / kDepth);
  ASSERT_EQ(trace(target_, geometry_, config_, &p), TraceState::kGood);
  EXPECT_LE(p.rho_min, 1.0 / kDepth);
  EXPECT_GE(p.rho_max, 1.0 / kDepth);
  const double width = (p.rho_max - p.rho_min) * camera_.fx * kStep;
  EXPECT_NEAR(width, p.interval_px, 1e-3 * width);
  // All gradient lies along the line: the error is at its least, twice 0.4 px.
  EXPECT_NEAR(width, 0.8, 0.02);
}

TEST_F(PlaneSearch, StartsFromInfinityWhenNothingIsKnown) {
  ImmaturePoint p = point_at(94, 60);
  ASSERT_TRUE(std::isnan(p.rho_max));
  ASSERT_EQ(trace(target_, geometry_, config_, &p), TraceState::kGood);
  EXPECT_LE(p.rho_min, 1.0 / kDepth);
  EXPECT_GE(p.rho_max, 1.0 / kDepth);
}

TEST_F(PlaneSearch, BrightnessTransferIsTakenIntoAccount) {
  ImageF brighter = target_;
  apply_brightness(1.3, -20.0, &brighter);
  geometry_ = host_geometry(camera_, SE3(SO3(), Vec3(-kStep, 0, 0)), {1.3, -20.0});
  ImmaturePoint p = point_at(94, 60);
  p.rho_max = static_cast<float>(2.0 / kDepth);
  ASSERT_EQ(trace(brighter, geometry_, config_, &p), TraceState::kGood);
  EXPECT_NEAR(0.5 * (p.rho_min + p.rho_max), 1.0 / kDepth, 0.01 / kDepth);
}

TEST_F(PlaneSearch, NarrowIntervalIsLeftAlone) {
  ImmaturePoint p = point_at(94, 60);
  p.rho_min = static_cast<float>(0.9 / kDepth);
  p.rho_max = static_cast<float>(1.1 / kDepth);
  const ImmaturePoint before = p;
  EXPECT_EQ(trace(target_, geometry_, config_, &p), TraceState::kSkipped);
  EXPECT_EQ(p.rho_min, before.rho_min);
  EXPECT_EQ(p.rho_max, before.rho_max);
  EXPECT_NEAR(p.interval_px, 0.2 * disparity(), 1e-3);
}

TEST_F(PlaneSearch, GradientAcrossTheLineCannotImproveTheInterval) {
  // The motion is across the texture's gradient.
  geometry_ = host_geometry(camera_, SE3(SO3(), Vec3(0, -kStep, 0)), {});
  for (int y = 0; y < camera_.height; ++y) {
    for (int x = 0; x < camera_.width; ++x) {
      host_.at(x, y) = target_.at(x, y) = static_cast<float>(120.0 + 60.0 * std::sin(0.33 * x));
    }
  }
  ImmaturePoint p = point_at(94, 60);
  p.rho_min = static_cast<float>(0.5 / kDepth);
  p.rho_max = static_cast<float>(2.0 / kDepth);
  EXPECT_EQ(trace(target_, geometry_, config_, &p), TraceState::kBadCondition);
  EXPECT_FLOAT_EQ(p.rho_max, static_cast<float>(2.0 / kDepth));
}

TEST_F(PlaneSearch, OccludedPointIsAnOutlierAndTheSecondTimeGone) {
  ImageF other = target_;
  for (int y = 0; y < camera_.height; ++y) {
    for (int x = 0; x < camera_.width; ++x) other.at(x, y) = (x / 2 + y / 2) % 2 == 0 ? 5.F : 250.F;
  }
  ImmaturePoint p = point_at(94, 60);
  p.rho_max = static_cast<float>(2.0 / kDepth);
  EXPECT_EQ(trace(other, geometry_, config_, &p), TraceState::kOutlier);
  ImmaturePoint comes_back = p;
  EXPECT_EQ(trace(target_, geometry_, config_, &comes_back), TraceState::kGood);
  EXPECT_EQ(trace(other, geometry_, config_, &p), TraceState::kOutOfView);
  EXPECT_EQ(trace(target_, geometry_, config_, &p), TraceState::kOutOfView) << "final";
}

TEST_F(PlaneSearch, PointThatLeavesTheImageIsOutOfView) {
  geometry_ = host_geometry(camera_, SE3(SO3(), Vec3(-3.0, 0, 0)), {});
  ImmaturePoint p = point_at(60, 60);
  p.rho_min = static_cast<float>(0.9 / kDepth);
  p.rho_max = static_cast<float>(1.1 / kDepth);
  EXPECT_EQ(trace(target_, geometry_, config_, &p), TraceState::kOutOfView);
  geometry_ = host_geometry(camera_, SE3(SO3::exp(Vec3(0, M_PI, 0)), Vec3::Zero()), {});
  ImmaturePoint behind = point_at(94, 60);
  behind.rho_max = 0.5F;
  EXPECT_EQ(trace(target_, geometry_, config_, &behind), TraceState::kOutOfView);
}

TEST_F(PlaneSearch, PointWhoseDepthHalvesIsGivenUpUnlessStereoKnowsIt) {
  const auto interval_at = [&](int u, int v) {
    ImmaturePoint p = point_at(u, v);
    p.rho_min = static_cast<float>(0.95 / kDepth);
    p.rho_max = static_cast<float>(1.05 / kDepth);
    return p;
  };
  geometry_ = host_geometry(camera_, SE3(SO3(), Vec3(0, 0, -0.5 * kDepth)), {});
  ImmaturePoint p = interval_at(100, 66);
  EXPECT_EQ(trace(target_, geometry_, config_, &p), TraceState::kOutOfView);
  p = interval_at(100, 66);
  p.static_information = 1e4F;
  const ImmaturePoint before = p;
  EXPECT_EQ(trace(target_, geometry_, config_, &p), TraceState::kSkipped);
  EXPECT_EQ(p.rho_min, before.rho_min);
  EXPECT_EQ(p.rho_max, before.rho_max);
  EXPECT_GT(p.interval_px, 0.0F);
  // Four times as large its pattern is another.
  geometry_ = host_geometry(camera_, SE3(SO3(), Vec3(0, 0, -0.75 * kDepth)), {});
  EXPECT_EQ(trace(target_, geometry_, config_, &p), TraceState::kOutOfView);
}

TEST_F(PlaneSearch, PatternThatIsBlindOrOutsideMakesNoPoint) {
  ImmaturePoint p;
  EXPECT_FALSE(make_immature_point(host_, 2.0F, 60.0F, 1, config_, 50.0, &p));
  host_.at(94, 62) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(make_immature_point(host_, 94.0F, 60.0F, 1, config_, 50.0, &p));
}

TEST_F(PlaneSearch, BlurAddsItsVariance) {
  // A kernel adds its variance to a parabola x^2, and along an axis nothing to what is linear
  // there.
  constexpr float kVertex = 40.0F;
  for (int y = 0; y < host_.height(); ++y) {
    for (int x = 0; x < host_.width(); ++x) {
      const float from = static_cast<float>(x) - kVertex;
      host_.at(x, y) = from * from + 3.0F * static_cast<float>(y);
    }
  }
  const ColourBlur blur = point_at(44, 60).blur;
  for (std::size_t i = 0; i < kPatternSize; ++i) {
    EXPECT_NEAR(blur.narrow_u[i], 0.5F, 1e-3F);
    EXPECT_NEAR(blur.narrow_u[i] + blur.wide_u[i], 2.0F, 1e-3F);
    EXPECT_NEAR(blur.narrow_v[i], 0.0F, 1e-3F);
    EXPECT_NEAR(blur.wide_v[i], 0.0F, 1e-3F);
  }
  // As near to the border as a point may lie, the row beyond the first is read as the first: 3 grey
  // levels more, of which the outermost place of the wide kernel has three sixty-fourths.
  EXPECT_NEAR(point_at(4, 4).blur.wide_v[0], 3.0F * 3.0F / 64.0F, 1e-3F);
}

/// Of the pattern's pixels, the i-th.
float nth(const std::array<Lane, 2>& lanes, std::size_t i) { return lanes[i / kLanes][i % kLanes]; }

TEST(LineResiduals, SlopesAreCentralDifferencesOfTheResiduals) {
  const WaveImage host_wave{.phase = 0.4};
  const WaveImage target_wave{.phase = -0.9};
  const ImageF host = host_wave.sampled(200, 150);
  const ImageF target = target_wave.sampled(200, 150);
  ImmaturePoint p;
  ASSERT_TRUE(make_immature_point(host, 120.0F, 70.0F, 1, PointConfig(), 50.0, &p));
  const BrightnessTransfer transfer{1.3, -12.0};
  const HostGeometry g = host_geometry(
      small_camera(), SE3(SO3::exp(Vec3(0.02, -0.03, 0.25)), Vec3(-0.1, 0.02, 0.0)), transfer);
  const SearchPattern pattern = search_pattern(g, p);
  constexpr float kU = 96.3F;
  constexpr float kV = 64.8F;
  constexpr float kStep = 0.5F;
  for (int k = 0; k < 16; ++k) {
    const float dx = std::cos(static_cast<float>(2.0 * M_PI * k / 16.0));
    const float dy = std::sin(static_cast<float>(2.0 * M_PI * k / 16.0));
    const auto at = [&](float t) {
      return line_residuals(target, pattern, kU + t * dx, kV + t * dy, dx, dy);
    };
    const LineResiduals here = at(0.0F);
    const LineResiduals ahead = at(kStep);
    const LineResiduals behind = at(-kStep);
    float steepest = 0.0F;
    for (std::size_t i = 0; i < kPatternSize; ++i) {
      const double expected =
          target_wave(kU + nth(pattern.x, i), kV + nth(pattern.y, i)) -
          (transfer.gain * host_wave(120.0 + kPattern[i].x, 70.0 + kPattern[i].y) + transfer.bias);
      EXPECT_NEAR(nth(here.r, i), expected, 0.01) << "direction " << k << ", pixel " << i;
      const float slope = (nth(ahead.r, i) - nth(behind.r, i)) / (2.0F * kStep);
      EXPECT_NEAR(nth(here.slope, i), slope, 1e-3) << "direction " << k << ", pixel " << i;
      steepest = std::max(steepest, std::abs(slope));
    }
    EXPECT_GT(steepest, 0.02F) << "nothing to be wrong about in direction " << k;
  }
}

TEST(LineResiduals, PatternIsWarpedAsTheImageTurns) {
  // A quarter turn about the optical axis of a camera with square pixels.
  const CameraModel camera = make_camera(200, 150, 170, 170, 99.5, 74.5);
  const HostGeometry g =
      host_geometry(camera, SE3(SO3::exp(Vec3(0, 0, M_PI / 2)), Vec3::Zero()), {});
  const SearchPattern pattern = search_pattern(g, {});
  for (std::size_t i = 0; i < kPatternSize; ++i) {
    EXPECT_NEAR(nth(pattern.x, i), -kPattern[i].y, 1e-5) << i;
    EXPECT_NEAR(nth(pattern.y, i), kPattern[i].x, 1e-5) << i;
  }
}

TEST(SceneSearch, NarrowsIntervalsAroundTheTruthOverSeveralFrames) {
  const SyntheticScene scene(3);
  const CameraModel camera = small_camera();
  const ImageF host = scene.render(camera, SE3());
  std::vector<SE3> poses;
  for (int i = 1; i <= 4; ++i) poses.push_back(keyframe_pose(i));
  poses.insert(poses.begin(), SE3());
  const PointConfig config;
  std::vector<ImmaturePoint> points;
  for (const Point& p : scene_points(scene, camera, host, poses, 0, 6)) {
    ImmaturePoint immature;
    ASSERT_TRUE(make_immature_point(host, p.u, p.v, 1, config, 50.0, &immature));
    points.push_back(immature);
  }
  ASSERT_GT(points.size(), 100U);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const ImageF image = scene.render(camera, poses[i]);
    const HostGeometry geometry = host_geometry(camera, poses[i].inverse() * poses[0], {});
    for (ImmaturePoint& p : points) trace(image, geometry, config, &p);
  }
  std::size_t bounded = 0;
  std::size_t right = 0;
  std::vector<double> widths;
  for (const ImmaturePoint& p : points) {
    const bool good = p.state != TraceState::kOutlier && p.state != TraceState::kOutOfView;
    if (!good || !std::isfinite(p.rho_max) || p.quality < 3.0F) continue;
    ++bounded;
    const double depth = scene.depth(camera, SE3(), Vec2(p.u, p.v));
    const double slack = 0.25 * (p.rho_max - p.rho_min);
    right += p.rho_min - slack < 1.0 / depth && 1.0 / depth < p.rho_max + slack ? 1 : 0;
    widths.push_back((p.rho_max - p.rho_min) * depth);
  }
  EXPECT_GT(bounded, points.size() / 3);
  EXPECT_GT(static_cast<double>(right), 0.93 * static_cast<double>(bounded));
  std::nth_element(widths.begin(), widths.begin() + widths.size() / 2, widths.end());
  EXPECT_LT(widths[widths.size() / 2], 0.15) << "of the depth";
}

}  // namespace
}  // namespace sovo
