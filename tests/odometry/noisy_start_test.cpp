#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "odometry/odometry_test_support.h"
#include "sovo/odometry/stereo_start.h"

namespace sovo {
namespace {

using namespace test;

/// Like `side`, with so much of its contrast, and noise.
SideImage noisy(const SideImage& side, double contrast, double noise, unsigned seed) {
  SideImage out = side;
  auto data = std::make_shared<std::vector<std::uint8_t>>(*side.data);
  std::mt19937 random(seed);
  std::normal_distribution<double> error(0.0, noise);
  for (std::uint8_t& x : *data) {
    const double grey = 100.0 + contrast * (static_cast<double>(x) - 100.0) + error(random);
    x = static_cast<std::uint8_t>(std::lround(std::clamp(grey, 0.0, 255.0)));
  }
  out.data = std::move(data);
  return out;
}

StereoFrame noisy_frame(int i, double contrast, double noise) {
  StereoFrame frame = drive_frame(i);
  frame.left = noisy(frame.left, contrast, noise, static_cast<unsigned>(2 * i + 1));
  frame.right = noisy(frame.right, contrast, noise, static_cast<unsigned>(2 * i + 2));
  return frame;
}

/// A twentieth of the contrast, with noise that hides most of what is left.
StereoFrame dim_frame(int i) { return noisy_frame(i, 0.05, 2.0); }
/// In this one as many matches are good as a map needs, many of them by chance.
StereoFrame doubtful_frame(int i) { return noisy_frame(i, 0.05, 1.2); }

TEST(NoisyStart, AMapBeginsAtOnceInSmallerImagesWhereThoseAreClearer) {
  Playback run(test_config());
  for (int i = 0; i < 30; ++i) {
    const OdometryOutput out = run.give(dim_frame(i));
    ASSERT_TRUE(out.pose_valid) << i;
    EXPECT_EQ(out.halvings, 1) << i;
    if (i > 0) continue;
    EXPECT_NE(out.reason.find("reduced to 1/2"), std::string::npos) << out.reason;
  }
  run.odometry.finish();
  const DriveError error = drive_error(published(run.recorder));
  EXPECT_LT(error.rms, 0.04);
  EXPECT_NEAR(error.scale, 1.0, 0.03);
}

TEST(NoisyStart, WholeImagesAreNotClearEnoughThere) {
  StereoOdometryConfig config = test_config();
  config.max_halvings = 0;
  Playback run(config);
  EXPECT_FALSE(run.give(dim_frame(0)).pose_valid);
}

TEST(NoisyStart, AfterAMapOfNoiseThatDidNotLastTheNextOneIsOfSmallerImages) {
  constexpr int kElsewhere = 80;
  Playback fresh(test_config());
  ASSERT_TRUE(fresh.give(doubtful_frame(kElsewhere)).pose_valid);
  EXPECT_EQ(fresh.recorder.frames.back().halvings, 0) << "nothing is known against whole ones";

  Playback run(test_config());
  EXPECT_EQ(run.give(doubtful_frame(0)).halvings, 0);
  EXPECT_EQ(run.give(doubtful_frame(kElsewhere)).state, OdometryState::kLost);
  const OdometryOutput next = run.give(doubtful_frame(kElsewhere + 1));
  EXPECT_TRUE(next.pose_valid);
  EXPECT_EQ(next.segment, 1U);
  EXPECT_EQ(next.halvings, 1);

  run.odometry.reset();
  StereoFrame later = doubtful_frame(0);
  later.stamp_ns = doubtful_frame(kElsewhere + 2).stamp_ns;
  EXPECT_EQ(run.give(later).halvings, 0) << "forgotten";
}

StaticMatch match(MatchState state, float inverse_depth, float sigma) {
  StaticMatch out;
  out.state = state;
  out.inverse_depth = inverse_depth;
  out.sigma = sigma;
  return out;
}

TEST(StereoStart, CountsWhatIsInViewAndWhatIsGood) {
  std::vector<SelectedPixel> pixels(4);
  pixels[1].x = 7;
  for (SelectedPixel& p : pixels) p.threshold_share = 1.0F;
  const StereoStart start = stereo_start(
      pixels,
      {match(MatchState::kMatched, 0.5F, 0.05F), match(MatchState::kMatched, 0.2F, 0.01F),
       match(MatchState::kOutOfView, 0.1F, 0.01F), match(MatchState::kAmbiguous, 0.3F, 0.01F)});
  EXPECT_EQ(start.quality.good, 2U);
  EXPECT_EQ(start.quality.in_view, 3U);
  EXPECT_FALSE(start.quality.weak_texture);
  EXPECT_DOUBLE_EQ(start.quality.good_share(), 2.0 / 3.0);
  ASSERT_EQ(start.points.size(), 4U);
  EXPECT_EQ(start.points[1].pixel.x, 7);
  EXPECT_FLOAT_EQ(start.points[1].depth.rho, 0.2F);
  EXPECT_EQ(start.points[3].depth.sigma, 0.0F) << "an ambiguous match is no depth";
  // Relative errors of 10 and 5 %: information 100 and 400.
  EXPECT_NEAR(start.scale_sigma, 1.0 / std::sqrt(500.0), 1e-6);
  pixels.front().threshold_share = 0.5F;
  EXPECT_TRUE(stereo_start(pixels, std::vector<StaticMatch>(4)).quality.weak_texture);
}

TEST(StereoStart, AsksForMoreMatchesOfWeakTexture) {
  EXPECT_TRUE((StereoQuality{100, 300, false}.is_enough(0.3)));
  EXPECT_FALSE((StereoQuality{99, 300, false}.is_enough(0.3)));
  EXPECT_FALSE((StereoQuality{100, 400, false}.is_enough(0.3)));
  EXPECT_FALSE((StereoQuality{199, 300, true}.is_enough(0.3)));
  EXPECT_TRUE((StereoQuality{200, 300, true}.is_enough(0.3)));
  EXPECT_FALSE((StereoQuality{0, 0, false}.is_enough(0.3)));
}

TEST(StereoStart, NoiseIsWhatFewMatchesOfWeakTextureTellOf) {
  EXPECT_TRUE((StereoQuality{440, 1000, true}.is_noisy()));
  EXPECT_FALSE((StereoQuality{460, 1000, true}.is_noisy()));
  EXPECT_FALSE((StereoQuality{440, 1000, false}.is_noisy())) << "it repeats, or is hidden";
  const StereoQuality whole{400, 1000, true};
  EXPECT_TRUE((StereoQuality{610, 1000, true}.is_clearer_than(whole)));
  EXPECT_FALSE((StereoQuality{590, 1000, true}.is_clearer_than(whole)));
}

}  // namespace
}  // namespace sovo
