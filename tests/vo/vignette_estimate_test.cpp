#include "sovo/vo/vignette_estimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "support/cameras.h"
#include "vo/window_test_support.h"

namespace sovo {
namespace {

using Pairs = std::vector<std::vector<VignetteSight>>;

Vec3 basis_at(double s) { return Vec3(RadialVignette::basis(s).data()); }

/// What a keyframe shows of points that have moved over images of this vignette, as images that are
/// freed of `known` have it.
class Sights {
 public:
  explicit Sights(const RadialVignette& truth) : truth_(truth) {}

  double noise = 0.02;    ///< Of the logarithm.
  double outliers = 0.0;  ///< Share of sights that are off by up to a half.
  double road = 0.0;      ///< Of the logarithm, in the lower quarter of the image.
  double seen = 1.0;      ///< Share of what is not corrected that is to be seen.
  int points = 300;       ///< A pair.

  Pairs take(const RadialVignette& known) {
    Pairs pairs(3);
    for (auto& pair : pairs) {
      const double brightness = 0.2 * centred(random_);
      for (int i = 0; i < points; ++i) pair.push_back(sight(known, brightness));
    }
    return pairs;
  }

 private:
  VignetteSight sight(const RadialVignette& known, double brightness) {
    VignetteSight s;
    s.quarter = static_cast<int>(4.0 * share_(random_)) % 4;
    const double from = share_(random_);
    const double outwards = road > 0.0 && s.quarter == 1 ? 0.15 : 0.0;  // it comes nearer
    const double to = std::clamp(from + outwards + 0.3 * centred(random_), 0.0, 1.0);
    s.basis = basis_at(to) - basis_at(from);
    s.log_known = known.log_at(to) - known.log_at(from);
    const double whole = truth_.log_at(to) - truth_.log_at(from);
    s.log_ratio = seen * (whole - s.log_known) + brightness + noise * normal_(random_);
    if (s.quarter == 1) s.log_ratio += road;
    if (share_(random_) < outliers) s.log_ratio += centred(random_);
    return s;
  }
  double centred(std::mt19937& random) { return share_(random) - 0.5; }

  RadialVignette truth_;
  std::mt19937 random_{5};
  std::uniform_real_distribution<double> share_{0.0, 1.0};
  std::normal_distribution<double> normal_;
};

const CameraModel& some_camera() {
  static const CameraModel camera = test::make_camera(320, 200, 225, 225, 160, 100);
  return camera;
}

RadialVignette after(Sights* sights, int keyframes) {
  VignetteEstimate estimate(some_camera());
  for (int i = 0; i < keyframes; ++i) estimate.observe(sights->take(estimate.current()));
  return estimate.current();
}

void expect_like(const RadialVignette& found, const RadialVignette& truth, double error) {
  for (const double s : {0.25, 0.5, 0.75, 1.0}) {
    EXPECT_NEAR(found.log_at(s), truth.log_at(s), error) << s;
  }
}

const RadialVignette kTrueVignette{{-0.2, -0.1, -0.2}};

TEST(VignetteEstimate, FindsAVignetteThatHalfIsSeenOf) {
  Sights sights(kTrueVignette);
  sights.seen = 0.5;
  expect_like(after(&sights, 20), kTrueVignette, 0.02);
}

TEST(VignetteEstimate, SettlesWhereAllOfItIsSeen) {
  Sights sights(kTrueVignette);
  expect_like(after(&sights, 20), kTrueVignette, 0.02);
}

TEST(VignetteEstimate, GoesThereInSteps) {
  Sights sights(kTrueVignette);
  sights.seen = 0.5;
  VignetteEstimate estimate(some_camera());
  estimate.observe(sights.take(estimate.current()));
  const double first = estimate.current().log_at(1.0);
  EXPECT_LT(first, -0.05);
  EXPECT_GT(first, -0.1) << "no larger steps";
}

TEST(VignetteEstimate, OutliersAndBrightnessOfAQuarterAreNoVignette) {
  Sights sights(kTrueVignette);
  sights.seen = 0.5;
  sights.outliers = 0.2;
  sights.road = 0.15;
  expect_like(after(&sights, 20), kTrueVignette, 0.03);
}

TEST(VignetteEstimate, ImagesWithoutOneStayAsTheyAre) {
  Sights sights((RadialVignette()));
  expect_like(after(&sights, 20), {}, 0.01);
}

TEST(VignetteEstimate, CornersThatBrightenAreNone) {
  Sights sights(RadialVignette{{0.2, 0.1, 0.1}});
  EXPECT_FALSE(after(&sights, 20).any());
}

TEST(VignetteEstimate, LeavesAFifthOfTheLight) {
  Sights sights(RadialVignette{{-1.0, -1.0, -1.5}});
  EXPECT_NEAR(after(&sights, 40).log_at(1.0), -1.6, 0.01);
}

TEST(VignetteEstimate, AFewPointsSayNothing) {
  Sights sights(kTrueVignette);
  sights.points = 15;
  EXPECT_FALSE(after(&sights, 20).any());
}

/// A dark spot on a wall that faces the camera.
struct Spot {
  int u, v;      ///< In the image of a camera at rest [px].
  double depth;  ///< [m].
};

/// What a camera sees of spots after it went `way` ahead [m].
ImageF view_of_spots(const std::vector<Spot>& spots, const CameraModel& camera, double way) {
  ImageF image(camera.width, camera.height);
  std::fill_n(image.data(), image.size(), 150.0F);
  for (const Spot& spot : spots) {
    const double nearer = spot.depth / (spot.depth - way);
    const double u = camera.cx + nearer * (spot.u - camera.cx);
    const double v = camera.cy + nearer * (spot.v - camera.cy);
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const double away = ((x - u) * (x - u) + (y - v) * (y - v)) / (nearer * nearer);
        const double grey = 150.0 - 100.0 * std::exp(-away / 2.0);
        image.at(x, y) = std::min(image.at(x, y), static_cast<float>(grey));
      }
    }
  }
  return image;
}

/// The spots' window: the first keyframe hosts a point in the middle of each.
Window window_of_spots(const std::vector<Spot>& spots, double way) {
  Window window(some_camera());
  for (const double at : {0.0, way}) {
    const ImageF image = view_of_spots(spots, some_camera(), at);
    window.insert(test::make_keyframe(at == 0.0 ? 0 : 1, test::pyramid_of(image),
                                      {SO3(), Vec3(0.0, 0.0, at)}));
  }
  for (const Spot& spot : spots) {
    Point point = test::make_point(window[0].image(), spot.u, spot.v, 1.0 / spot.depth);
    point.residuals[static_cast<std::size_t>(window[1].slot)].state = ResidualState::kIn;
    window[0].points.push_back(point);
  }
  window.update_geometry();
  return window;
}

TEST(VignetteEstimate, SpotsThatGrowDarkerAsTheyComeNearerAreNone) {
  // Within as many pixels; and what is near goes outwards most.
  std::vector<Spot> spots;
  for (int v = 10; v < 190; v += 15) {
    for (int u = 10; u < 310; u += 15) spots.push_back({u, v, (u + v) % 2 == 0 ? 3.0 : 100.0});
  }
  const Window window = window_of_spots(spots, 1.0);
  VignetteEstimate estimate(some_camera());
  for (int i = 0; i < 10; ++i) estimate.observe(window, test::sights_in_newest(window));
  EXPECT_GT(estimate.current().log_at(1.0), -0.02);
}

TEST(SolveWithoutPositive, IsTheLeastOfAllThatAreAllowed) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int run = 0; run < 50; ++run) {
    Mat3 A;
    Vec3 g;
    for (int i = 0; i < 9; ++i) A.data()[i] = normal(random);
    for (int i = 0; i < 3; ++i) g(i) = normal(random);
    const Mat3 H = A * A.transpose() + 0.1 * Mat3::Identity();
    const Vec3 c = solve_without_positive(H, g);
    EXPECT_LE(c.maxCoeff(), 0.0);
    // The conditions of Karush, Kuhn and Tucker.
    const Vec3 gradient = H * c - g;
    for (int i = 0; i < 3; ++i) {
      EXPECT_LE(gradient(i), 1e-9);
      EXPECT_NEAR(gradient(i) * c(i), 0.0, 1e-9);
    }
  }
}

}  // namespace
}  // namespace sovo
