#include "sovo/image/static_matcher.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "support/cameras.h"
#include "support/synthetic_scene.h"

namespace sovo {
namespace {

/// A rig that looks at the synthetic room, with what each camera sees.
struct Views {
  StereoRig rig;
  ImagePyramid left, right;
  ImageF depth;  ///< Of the left camera [m].
};

constexpr double kNoise = 1.0;  // [grey levels]

Views render(const StereoRig& rig, unsigned seed) {
  const test::SyntheticScene scene(seed);
  Views views{rig, {}, {}, {}};
  ImageF left = scene.render(rig.left, SE3(), &views.depth);
  ImageF right = scene.render(rig.right, rig.T_right_left.inverse());
  test::apply_brightness(1.3, -20.0, &right);
  test::add_noise(kNoise, seed + 100, &left);
  test::add_noise(kNoise, seed + 200, &right);
  views.left = ImagePyramid(std::move(left), 4);
  views.right = ImagePyramid(std::move(right), 4);
  return views;
}

CameraModel pinhole() { return test::make_camera(376, 240, 230.0, 230.0, 187.5, 119.5); }

StereoRig plain_rig() {
  StereoRig rig;
  rig.left = rig.right = pinhole();
  rig.T_right_left = SE3(SO3(), Vec3(-0.12, 0.0, 0.0));
  return rig;
}

/// A rig that is far from rectified: other lens, turned, shifted in all directions.
StereoRig fisheye_rig() {
  StereoRig rig = plain_rig();
  rig.right = test::tumvi_right().downscaled(2);
  rig.right.fx *= 1.7;
  rig.right.fy *= 1.7;
  rig.T_right_left = SE3(SO3::exp(Vec3(0.05, -0.03, 0.04)), Vec3(-0.12, 0.01, 0.015));
  return rig;
}

StereoRig radtan_rig() {
  StereoRig rig = plain_rig();
  rig.right = test::euroc_left().downscaled(2);
  rig.T_right_left = SE3(SO3::exp(Vec3(0.02, 0.01, -0.02)), Vec3(-0.12, -0.004, 0.01));
  return rig;
}

/// A vertical rig: the curves run down the image.
StereoRig vertical_rig() {
  StereoRig rig = plain_rig();
  rig.T_right_left = SE3(SO3(), Vec3(0.0, -0.12, 0.0));
  return rig;
}

struct Statistics {
  int points = 0, matched = 0, outliers = 0;
  std::vector<double> normalized;  ///< |error| / sigma.
  std::vector<double> error_px;    ///< |error| of disparity.
};

double quantile(std::vector<double> v, double q) {
  std::sort(v.begin(), v.end());
  return v.empty() ? 0.0 : v[static_cast<std::size_t>(q * static_cast<double>(v.size() - 1))];
}

Statistics match_all(const Views& views, const StaticMatcherConfig& config) {
  Statistics out;
  const StaticMatcher matcher(config, views.rig);
  const double px = views.rig.left.fx * views.rig.baseline();
  for (int y = 6; y < views.rig.left.height - 6; y += 7) {
    for (int x = 6; x < views.rig.left.width - 6; x += 7) {
      ++out.points;
      const StaticMatch m =
          matcher.match(views.left, views.right, static_cast<float>(x), static_cast<float>(y));
      if (m.state != MatchState::kMatched) continue;
      ++out.matched;
      const double error = std::abs(static_cast<double>(m.inverse_depth) -
                                    1.0 / static_cast<double>(views.depth.at(x, y)));
      out.error_px.push_back(error * px);
      out.normalized.push_back(error / static_cast<double>(m.sigma));
      if (error * px > 1.5) ++out.outliers;
    }
  }
  return out;
}

class StaticMatcherOnRig : public testing::TestWithParam<std::pair<const char*, StereoRig (*)()>> {
};

TEST_P(StaticMatcherOnRig, RecoversDepthWithinItsSigma) {
  StaticMatcherConfig config;
  config.min_depth = 0.6;
  const Statistics s = match_all(render(GetParam().second(), 11), config);
  EXPECT_GT(s.matched, 0.6 * s.points);
  EXPECT_LT(s.outliers, 0.01 * s.matched);
  EXPECT_LT(quantile(s.error_px, 0.5), 0.15);
  // Of a normal error 68 % lie within one sigma, 95 % within two; edges of surfaces add a tail.
  EXPECT_LT(quantile(s.normalized, 0.68), 1.3);
  EXPECT_GT(quantile(s.normalized, 0.68), 0.2);
  EXPECT_LT(quantile(s.normalized, 0.93), 3.0);
}

INSTANTIATE_TEST_SUITE_P(Rigs, StaticMatcherOnRig,
                         testing::Values(std::make_pair("plain", &plain_rig),
                                         std::make_pair("fisheye", &fisheye_rig),
                                         std::make_pair("radtan", &radtan_rig),
                                         std::make_pair("vertical", &vertical_rig)),
                         [](const auto& rig) { return std::string(rig.param.first); });

TEST(StaticMatcher, SwappedImagesMatchOnlyBehindInfinity) {
  const Views views = render(plain_rig(), 12);
  const StaticMatcher matcher({}, views.rig);
  int in_front = 0;
  int behind = 0;
  int points = 0;
  for (int y = 10; y < 230; y += 12) {
    for (int x = 10; x < 366; x += 12) {
      ++points;
      const auto u = static_cast<float>(x);
      const auto v = static_cast<float>(y);
      if (matcher.match(views.right, views.left, u, v).state == MatchState::kMatched) ++in_front;
      const StaticMatch m = matcher.match(views.right, views.left, u, v,
                                          {.inverse_depth_range = std::pair(-1.5F, -0.02F)});
      if (m.state != MatchState::kMatched) continue;
      ++behind;
      EXPECT_LT(m.inverse_depth, 0.0F);
      EXPECT_LT(m.disparity_px, 0.0F);
    }
  }
  EXPECT_LT(in_front, 0.04 * points);
  EXPECT_GT(behind, 0.6 * points);
}

TEST(StaticMatcher, DecalibrationShowsAcrossTheCurve) {
  const Views views = render(plain_rig(), 13);
  for (const double shift : {0.0, 0.6, -1.5}) {
    StereoRig believed = views.rig;
    believed.right.cy -= shift;  // the image lies `shift` below where it is expected
    StaticMatcherConfig config;
    config.min_depth = 0.6;
    config.min_zncc = 0.6;
    const StaticMatcher matcher(config, believed);
    std::vector<double> across;
    for (int y = 12; y < 228; y += 12) {
      for (int x = 12; x < 364; x += 12) {
        const StaticMatch m = matcher.match(views.left, views.right, static_cast<float>(x),
                                            static_cast<float>(y), {.across = true});
        if (m.state != MatchState::kMatched || m.across_sigma_px > 0.5F) continue;
        // Across points to the right-hand side of the way to nearer depths: here up the image.
        across.push_back(static_cast<double>(m.across_px));
      }
    }
    ASSERT_GT(across.size(), 50U) << shift;
    EXPECT_NEAR(quantile(across, 0.5), -shift, 0.1);
  }
}

/// Both views of a fronto-parallel wall at 3 m, drawn by `texture` of wall coordinates [m].
template <class Texture>
Views wall(const Texture& texture) {
  Views views{plain_rig(), {}, {}, {}};
  const auto draw = [&](double origin_x) {
    const CameraModel camera = views.rig.left;
    ImageF image(camera.width, camera.height);
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const double s = origin_x + 3.0 * (x - camera.cx) / camera.fx;
        const double t = 3.0 * (y - camera.cy) / camera.fy;
        image.at(x, y) = static_cast<float>(texture(s, t));
      }
    }
    test::add_noise(0.5, origin_x > 0.0 ? 2 : 1, &image);
    return ImagePyramid(std::move(image), 4);
  };
  views.left = draw(0.0);
  views.right = draw(0.12);
  return views;
}

int count_state(const Views& views, MatchState state, int* points) {
  StaticMatcherConfig config;
  config.min_depth = 0.6;
  const StaticMatcher matcher(config, views.rig);
  int count = 0;
  *points = 0;
  for (int y = 30; y < 210; y += 11) {
    for (int x = 70; x < 350; x += 11) {
      ++*points;
      const StaticMatch m =
          matcher.match(views.left, views.right, static_cast<float>(x), static_cast<float>(y));
      if (m.state == state) ++count;
    }
  }
  return count;
}

TEST(StaticMatcher, RepetitiveTextureIsAmbiguous) {
  for (const double period_px : {6.0, 9.5, 14.0}) {
    const double wave = 2.0 * M_PI / (period_px * 3.0 / 230.0);
    const Views tiles = wall([&](double s, double t) {
      return 128.0 + 50.0 * std::sin(wave * s) * std::cos(0.8 * wave * t) +
             15.0 * std::sin(0.5 * wave * t);
    });
    int points = 0;
    const int matched = count_state(tiles, MatchState::kMatched, &points);
    EXPECT_LT(matched, 0.03 * points) << "period " << period_px << " px";
    EXPECT_GT(count_state(tiles, MatchState::kAmbiguous, &points), 0.7 * points)
        << "period " << period_px << " px";
  }
}

TEST(StaticMatcher, UniformAndEpipolarStripesHaveNoTexture) {
  int points = 0;
  const Views grey = wall([](double, double) { return 100.0; });
  EXPECT_EQ(count_state(grey, MatchState::kNoTexture, &points), points);
  const Views stripes = wall([](double, double t) { return 128.0 + 60.0 * std::sin(40.0 * t); });
  EXPECT_GT(count_state(stripes, MatchState::kNoTexture, &points), 0.95 * points);
}

TEST(StaticMatcher, WeakTextureIsMatchedWhenLessIsAsked) {
  const Views wall_of_sand = wall([](double s, double t) {
    return 100.0 + 2.0 * (std::sin(31.0 * s + 7.0 * t) + std::sin(13.7 * s - 23.0 * t) +
                          std::sin(43.3 * s + 19.0 * t) + std::sin(22.1 * s - 39.0 * t) +
                          std::sin(9.3 * s + 5.0 * t) + std::sin(36.9 * s - 3.0 * t));
  });
  const StaticMatcher matcher({}, wall_of_sand.rig);
  const auto disparity = static_cast<float>(wall_of_sand.rig.left.fx * 0.12 / 3.0);
  int refused = 0;
  int matched = 0;
  int right = 0;
  int points = 0;
  for (int y = 20; y < wall_of_sand.rig.left.height - 20; y += 9) {
    for (int x = 60; x < wall_of_sand.rig.left.width - 20; x += 9) {
      const auto match = [&](float share) {
        return matcher.match(wall_of_sand.left, wall_of_sand.right, static_cast<float>(x),
                             static_cast<float>(y), {.gradient_share = share});
      };
      ++points;
      refused += match(1.0F).state == MatchState::kNoTexture ? 1 : 0;
      const StaticMatch weak = match(0.36F);
      if (weak.state != MatchState::kMatched) continue;
      ++matched;
      right += std::abs(weak.disparity_px - disparity) < 1.0F ? 1 : 0;
    }
  }
  EXPECT_GT(refused, 0.9 * points);
  EXPECT_GT(matched, 0.3 * points);
  EXPECT_GT(right, 0.97 * matched);
}

TEST(StaticMatcher, PointsAtInfinityAreMatched) {
  const Views views = render(plain_rig(), 14);
  // Both views from one place: everything is at infinity for this rig.
  const StaticMatcher matcher({}, views.rig);
  ImageF again = views.left[0];
  test::add_noise(kNoise, 5, &again);
  const ImagePyramid right(std::move(again), 4);
  int matched = 0;
  int points = 0;
  for (int y = 20; y < 220; y += 12) {
    for (int x = 20; x < 356; x += 12) {
      ++points;
      const StaticMatch m =
          matcher.match(views.left, right, static_cast<float>(x), static_cast<float>(y));
      if (m.state != MatchState::kMatched) continue;
      ++matched;
      ASSERT_GE(m.inverse_depth, 0.0F);
      ASSERT_GT(m.sigma, 0.0F);
      ASSERT_LT(m.inverse_depth, 6.0F * m.sigma);
    }
  }
  EXPECT_GT(matched, 0.7 * points);
}

TEST(StaticMatcher, ARangeNarrowsTheSearch) {
  const Views views = render(plain_rig(), 15);
  const StaticMatcher matcher({}, views.rig);
  const StaticMatch full = matcher.match(views.left, views.right, 200.0F, 60.0F);
  ASSERT_EQ(full.state, MatchState::kMatched);
  const std::pair around(full.inverse_depth - 0.05F, full.inverse_depth + 0.05F);
  const StaticMatch near =
      matcher.match(views.left, views.right, 200.0F, 60.0F, {.inverse_depth_range = around});
  ASSERT_EQ(near.state, MatchState::kMatched);
  EXPECT_NEAR(near.inverse_depth, full.inverse_depth, 0.2F * full.sigma);
  const std::pair elsewhere(full.inverse_depth + 0.5F, full.inverse_depth + 1.0F);
  EXPECT_NE(
      matcher.match(views.left, views.right, 200.0F, 60.0F, {.inverse_depth_range = elsewhere})
          .state,
      MatchState::kMatched);
}

TEST(StaticMatcher, WhereTheRightCameraDoesNotLookIsOutOfView) {
  Views views = render(plain_rig(), 16);
  views.rig.T_right_left = SE3(SO3::exp(Vec3(0.0, -1.4, 0.0)), Vec3(-0.12, 0.0, 0.0));
  const StaticMatcher matcher({}, views.rig);
  EXPECT_EQ(matcher.match(views.left, views.right, 60.0F, 120.0F).state, MatchState::kOutOfView);
  // A pixel whose patch does not fit into the left image.
  EXPECT_EQ(matcher.match(views.left, views.right, 1.0F, 1.0F).state, MatchState::kOutOfView);
}

}  // namespace
}  // namespace sovo
