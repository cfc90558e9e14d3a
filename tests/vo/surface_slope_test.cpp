#include "sovo/vo/surface_slope.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "sovo/vo/keyframe_slopes.h"
#include "sovo/vo/point_activation.h"
#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

constexpr int kSlopeWidth = 200;
constexpr int kSlopeHeight = 150;
constexpr float kKnownVariance = 1e-4F;

/// Inverse depths every six pixels of the ground below a horizon in row 40.
float ground(float /*u*/, float v) { return 0.004F * (v - 40.0F); }

template <class Surface>
std::vector<SurfaceSample> samples_of(const Surface& surface, int step = 6) {
  std::vector<SurfaceSample> out;
  for (int y = 3; y < kSlopeHeight; y += step) {
    for (int x = 3; x < kSlopeWidth; x += step) {
      const auto u = static_cast<float>(x);
      const auto v = static_cast<float>(y);
      out.push_back({u, v, surface(u, v), kKnownVariance});
    }
  }
  return out;
}

TEST(SurfaceSlopes, OfGroundIsOneOverTheRowsBelowTheHorizon) {
  SurfaceSlopes slopes(kSlopeWidth, kSlopeHeight, samples_of(ground));
  for (const float v : {60.0F, 80.0F, 120.0F, 146.0F}) {
    const SurfaceSlope slope = slopes.at({90.0F, v, ground(90.0F, v), kKnownVariance});
    EXPECT_NEAR(slope.u, 0.0, 1e-3);
    EXPECT_NEAR(slope.v * (v - 40.0F), 1.0, 0.05) << v;
  }
}

TEST(SurfaceSlopes, AreThoseOfThePointsOwnSurface) {
  // A pole before ground.
  const auto surface = [](float u, float v) {
    return std::abs(u - 90.0F) < 7.0F ? 1.0F : ground(u, v);
  };
  SurfaceSlopes slopes(kSlopeWidth, kSlopeHeight, samples_of(surface));
  const SurfaceSlope beside = slopes.at({105.0F, 100.0F, ground(105.0F, 100.0F), kKnownVariance});
  EXPECT_NEAR(beside.v, 1.0 / 60.0, 2e-3);
  EXPECT_NEAR(beside.u, 0.0, 2e-3);
}

TEST(SurfaceSlopes, ThereIsNoneWhereTooLittleIsKnownOrDepthsDoNotAgree) {
  const SurfaceSample at{90.0F, 100.0F, ground(90.0F, 100.0F), kKnownVariance};
  SurfaceSlopes few(kSlopeWidth, kSlopeHeight, samples_of(ground, 25));
  EXPECT_EQ(few.at(at).v, 0.0F);

  std::mt19937 random(5);
  std::uniform_real_distribution<float> anything(0.02F, 2.0F);
  SurfaceSlopes bush(kSlopeWidth, kSlopeHeight,
                     samples_of([&](float, float) { return anything(random); }));
  EXPECT_EQ(bush.at(at).u, 0.0F);
  EXPECT_EQ(bush.at(at).v, 0.0F);

  SurfaceSlopes nothing(kSlopeWidth, kSlopeHeight, {});
  EXPECT_EQ(nothing.at(at).v, 0.0F);
  // Not beyond the image, nor at a point without a depth.
  SurfaceSlopes slopes(kSlopeWidth, kSlopeHeight, samples_of(ground));
  EXPECT_EQ(slopes.at({-500.0F, 1e6F, 1.0F, kKnownVariance}).v, 0.0F);
  EXPECT_EQ(slopes.at({90.0F, 100.0F, 0.0F, kKnownVariance}).v, 0.0F);
}

TEST(SurfaceSlopes, NoisyDepthsTellThemToo) {
  std::mt19937 random(7);
  std::normal_distribution<float> noise(0.0F, 0.03F);
  std::vector<SurfaceSample> known = samples_of(ground);
  for (std::size_t i = 0; i < known.size(); ++i) {
    const bool wrong = i % 4 == 0 && known[i].v > 110.0F;  // on one side only
    known[i].rho *= wrong ? 2.0F : 1.0F + noise(random);
    known[i].variance = 9e-4F;
  }
  SurfaceSlopes slopes(kSlopeWidth, kSlopeHeight, std::move(known));
  for (float u = 30.0F; u < 170.0F; u += 10.0F) {
    const SurfaceSlope slope = slopes.at({u, 110.0F, ground(u, 110.0F), 9e-4F});
    EXPECT_NEAR(slope.u, 0.0, 4e-3);
    EXPECT_NEAR(slope.v, 1.0 / 70.0, 4e-3);
  }
}

/// The true slope of what a pixel of the scene's camera shows.
SurfaceSlope true_slope(const SE3& T_world_camera, const Point& p) {
  static const SyntheticScene scene(3);
  const CameraModel camera = small_camera();
  const auto rho = [&](double du, double dv) {
    return 1.0 / scene.depth(camera, T_world_camera, Vec2(p.u + du, p.v + dv));
  };
  return {static_cast<float>((rho(2, 0) - rho(-2, 0)) / (4.0 * p.rho)),
          static_cast<float>((rho(0, 2) - rho(0, -2)) / (4.0 * p.rho))};
}

/// Of the residuals from the points on ground and walls into the keyframe farthest from theirs.
double energy_of_slanted(const Window& window) {
  double sum = 0.0;
  for (const Point& p : window[0].points) {
    const SurfaceSlope slope = true_slope(window[0].T_world_camera(), p);
    if (std::hypot(slope.u, slope.v) < 0.005F) continue;
    LinearizedResidual r;
    sum += static_cast<double>(linearize(window, WindowConfig(), 0, window.size() - 1, p,
                                         {.state = ResidualState::kIn}, &r));
  }
  return sum;
}

TEST(SurfaceSlopes, APatternThatFollowsItsSurfaceFitsBetter) {
  Window window = scene_window(5, 6);
  const double flat = energy_of_slanted(window);
  for (Point& p : window[0].points) p.slope = true_slope(window[0].T_world_camera(), p);
  const double slanted = energy_of_slanted(window);
  EXPECT_GT(flat, 0.0);
  EXPECT_LT(slanted, 0.5 * flat);
  for (Point& p : window[0].points) p.slope = {-p.slope.u, -p.slope.v};
  EXPECT_GT(energy_of_slanted(window), flat);
}

/// What stereo would know of points: their depths to one in a hundred.
std::vector<ImmaturePoint> matched(const std::vector<Point>& points, const ImageF& image) {
  std::vector<ImmaturePoint> out;
  for (const Point& known : points) {
    ImmaturePoint p;
    if (!make_immature_point(image, known.u, known.v, 1, PointConfig(),
                             WindowConfig().gradient_constant, &p)) {
      continue;
    }
    p.rho_min = p.rho_max = static_cast<float>(known.rho);
    p.static_information = static_cast<float>(25.0 / std::pow(0.01 * known.rho, 2));
    out.push_back(p);
  }
  return out;
}

/// A window whose newest keyframe sees its points, with every `stride`-th pixel of a raster of its
/// own that stereo has matched, and one that it has not.
Window window_with_matches(int stride) {
  Window window = scene_window(4, 6);
  WorkerPool pool(1);
  PhotometricProblem problem(WindowConfig(), collect_points(&window), &window, &pool);
  WindowLinearization at;
  problem.linearize(problem.stored(), {}, &at);
  problem.write_back(at);
  Keyframe& newest = window.newest();
  newest.immature = matched(scene_points(SyntheticScene(3), small_camera(), newest.image(),
                                         {newest.T_world_camera()}, 0, stride),
                            newest.image());
  newest.immature.push_back(newest.immature.front());
  newest.immature.back().static_information = 0.0F;
  return window;
}

/// Of the newest keyframe's matched pixels: the share that has a slope, and how far those are off
/// in the median [1/px].
struct FoundSlopes {
  double share = 0.0, off = 0.0;
};

FoundSlopes found_slopes(const Keyframe& keyframe) {
  std::vector<double> off;
  int matched = 0;
  for (const ImmaturePoint& pixel : keyframe.immature) {
    if (!pixel.from_static_match()) continue;
    ++matched;
    if (pixel.slope.u == 0.0F && pixel.slope.v == 0.0F) continue;
    Point p;
    p.u = pixel.u;
    p.v = pixel.v;
    p.rho = static_cast<double>(pixel.rho_min);
    const SurfaceSlope truth = true_slope(keyframe.T_world_camera(), p);
    off.push_back(std::hypot(pixel.slope.u - truth.u, pixel.slope.v - truth.v));
  }
  if (off.empty()) return {};
  const auto middle = off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2);
  std::nth_element(off.begin(), middle, off.end());
  return {static_cast<double>(off.size()) / matched, *middle};
}

TEST(SurfaceSlopes, OfANewKeyframeComeFromItsOwnMatches) {
  Window window = window_with_matches(9);
  for (int i = 0; i + 1 < window.size(); ++i) window[i].points.clear();
  find_slopes(&window);
  const FoundSlopes found = found_slopes(window.newest());
  EXPECT_GT(found.share, 0.66);
  EXPECT_LT(found.off, 1e-3);
  EXPECT_EQ(window.newest().immature.back().slope.v, 0.0F);  // stereo does not know it
}

TEST(SurfaceSlopes, OfANewKeyframeComeFromTheWindowsPointsToo) {
  Window window = window_with_matches(25);
  Window alone = window_with_matches(25);
  for (int i = 0; i + 1 < alone.size(); ++i) alone[i].points.clear();
  find_slopes(&alone);
  EXPECT_EQ(found_slopes(alone.newest()).share, 0.0) << "too far from each other";
  find_slopes(&window);
  const FoundSlopes found = found_slopes(window.newest());
  EXPECT_GT(found.share, 0.66);
  EXPECT_LT(found.off, 1e-3);
}

TEST(SurfaceSlopes, APointTakesAlongThatOfItsPixel) {
  Window window = scene_window(4, 6);
  window[0].immature = matched(window[0].points, window[0].image());
  window[0].points.clear();
  for (ImmaturePoint& p : window[0].immature) {
    p.state = TraceState::kGood;
    p.slope = {0.001F, 0.002F};
  }
  window.update_geometry();
  WorkerPool pool(1);
  ASSERT_GT(PointActivator(PointConfig(), WindowConfig(), &pool).activate(&window), 20);
  for (const Point& p : window[0].points) {
    EXPECT_EQ(p.slope.u, 0.001F);
    EXPECT_EQ(p.slope.v, 0.002F);
  }
}

}  // namespace
}  // namespace sovo
