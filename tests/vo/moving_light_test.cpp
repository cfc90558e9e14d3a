#include "sovo/vo/moving_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace sovo {
namespace {

using LightPairs = std::vector<std::vector<LightSight>>;

/// What keyframes show of points that move through a light.
class LitSights {
 public:
  Vec6 light = Vec6::Zero();            ///< Terms of the light that moves along.
  Vec6 of_one_keyframe = Vec6::Zero();  ///< How much each has of its own, which no other shares.
  double noise = 0.03;                  ///< Of the logarithm.
  double outliers = 0.0;                ///< Share of sights that are off by up to one.
  double gains = 0.3;                   ///< Of a pair, up to half of it either way.
  int points = 150;                     ///< A pair.

  LightPairs take() {
    Vec6 all = light;
    for (Eigen::Index i = 0; i < 6; ++i) all(i) += of_one_keyframe(i) * normal_(random_);
    LightPairs pairs(3);
    for (auto& pair : pairs) {
      const double gain = gains * centred();
      for (int i = 0; i < points; ++i) pair.push_back(sight(all, gain));
    }
    return pairs;
  }

 private:
  LightSight sight(const Vec6& terms, double gain) {
    LightSight s;
    s.terms << 0.3 * centred(), 0.4 * centred(), 0.3 * centred(), 0.2 * centred(), 0.2 * centred(),
        0.2 * centred();
    s.log_ratio = terms.dot(s.terms) + gain + noise * normal_(random_);
    if (share_(random_) < outliers) s.log_ratio += 2.0 * centred();
    return s;
  }
  double centred() { return share_(random_) - 0.5; }

  std::mt19937 random_{7};
  std::uniform_real_distribution<double> share_{0.0, 1.0};
  std::normal_distribution<double> normal_;
};

/// As of which keyframe the lamps are found; 0: not within `most`.
int found_after(LitSights sights, int most, const MovingLightConfig& config = {}) {
  MovingLight light(config);
  for (int i = 1; i <= most; ++i) {
    light.observe(sights.take());
    if (light.found()) return i;
  }
  return 0;
}

const Vec6 kBeam = (Vec6() << 1.5, 0.3, -0.2, -1.0, 0.1, -1.2).finished();

TEST(MovingLight, IsFoundOnceEnoughKeyframesHaveTold) {
  LitSights sights;
  sights.light = kBeam;
  // Two to learn it from, and four that it explains.
  EXPECT_EQ(found_after(sights, 40), 6);
  MovingLightConfig config;
  config.keyframes = 10;
  EXPECT_EQ(found_after(sights, 40, config), 12);
}

TEST(MovingLight, IsFoundAmongOutliers) {
  LitSights sights;
  sights.light = kBeam;
  sights.outliers = 0.2;
  EXPECT_EQ(found_after(sights, 40), 6);
}

TEST(MovingLight, ALightThatStandsIsNone) {
  LitSights sights;
  EXPECT_EQ(found_after(sights, 60), 0);
  sights.outliers = 0.2;
  sights.gains = 1.0;
  EXPECT_EQ(found_after(sights, 60), 0);
}

/// Clouds, shadows and reflections: each pair can be explained, but not by what the others were.
TEST(MovingLight, ChangesThatDoNotLastAreNone) {
  LitSights sights;
  sights.of_one_keyframe = Vec6::Constant(1.5);
  EXPECT_EQ(found_after(sights, 60), 0);
}

/// With the milder limit it is, which shows that it can be told from none.
void expect_found_only_with(const MovingLightConfig& mild, const LitSights& sights) {
  EXPECT_EQ(found_after(sights, 60), 0);
  EXPECT_GT(found_after(sights, 60, mild), 0);
}

/// Patterns that become smaller lose some brightness, an eighth of what lamps do.
TEST(MovingLight, ALittleOfItIsNotEnough) {
  LitSights sights;
  sights.light = 0.12 * kBeam;
  MovingLightConfig mild;
  mild.most_left = 0.999;
  expect_found_only_with(mild, sights);
}

TEST(MovingLight, WhatHardlyMattersIsLeftAlone) {
  LitSights sights;
  sights.light = 0.1 * kBeam;
  sights.noise = 0.002;
  MovingLightConfig mild;
  mild.least_scatter = 0.001;
  expect_found_only_with(mild, sights);
}

/// Lamps over rough ground, whose sides are lit and not: much else changes, too.
TEST(MovingLight, LessIsEnoughWhereBrightnessScattersMore) {
  LitSights sights;
  sights.light = 0.45 * kBeam;
  sights.noise = 0.1;
  EXPECT_GT(found_after(sights, 60), 0);
  MovingLightConfig as_elsewhere;
  as_elsewhere.most_left_strong = as_elsewhere.most_left;
  EXPECT_EQ(found_after(sights, 60, as_elsewhere), 0);
  sights.light = 0.18 * kBeam;
  sights.noise = 0.04;
  MovingLightConfig mild;
  mild.most_left = mild.most_left_strong;
  expect_found_only_with(mild, sights);
}

TEST(MovingLight, WhatIsBrightAtTheEdgesAndNotNearbyIsNoLamp) {
  LitSights sights;
  sights.light = 2.0 * kBeam;
  sights.light[0] = 0.0;
  EXPECT_GT(found_after(sights, 60), 0);
  sights.light.tail<3>() *= -1.0;
  EXPECT_EQ(found_after(sights, 60), 0);
  sights.light[0] = 2.0;
  EXPECT_GT(found_after(sights, 60), 0);
}

TEST(MovingLight, FewSightsTellNothing) {
  LitSights sights;
  sights.light = kBeam;
  sights.points = 19;
  EXPECT_EQ(found_after(sights, 60), 0) << "a pair";
  sights.points = 30;
  EXPECT_EQ(found_after(sights, 60), 0) << "in all";
  sights.points = 40;
  EXPECT_GT(found_after(sights, 60), 0);
}

TEST(MovingLight, ComesOnLater) {
  MovingLight light{MovingLightConfig()};
  LitSights sights;
  for (int i = 0; i < 60; ++i) light.observe(sights.take());
  EXPECT_FALSE(light.found());
  sights.light = kBeam;
  int keyframes = 0;
  for (; keyframes < 40 && !light.found(); ++keyframes) light.observe(sights.take());
  EXPECT_TRUE(light.found());
  EXPECT_LT(keyframes, 35) << "what was learned by daylight fades";
}

/// By daylight brightness hardly changes, which says nothing about the dark.
TEST(MovingLight, SoItDoesAfterAClearDay) {
  MovingLight light{MovingLightConfig()};
  LitSights sights;
  sights.noise = 0.005;
  for (int i = 0; i < 60; ++i) light.observe(sights.take());
  sights.light = kBeam;
  sights.noise = 0.05;
  int keyframes = 0;
  for (; keyframes < 40 && !light.found(); ++keyframes) light.observe(sights.take());
  EXPECT_LT(keyframes, 15);
}

}  // namespace
}  // namespace sovo
