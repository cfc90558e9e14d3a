#include "sovo/odometry/stereo_start.h"

#include <gtest/gtest.h>

#include <vector>

namespace sovo {
namespace {

std::vector<SelectedPixel> pixels_of(std::size_t usual, std::size_t sparse) {
  std::vector<SelectedPixel> out(usual + sparse);
  for (std::size_t i = usual; i < out.size(); ++i) out[i].sparse = true;
  return out;
}

StaticMatch match_of(MatchState state) {
  StaticMatch out;
  out.state = state;
  out.inverse_depth = 0.5F;
  out.sigma = 0.01F;
  return out;
}

/// What is chosen in addition, where texture is weaker still, is mostly not matched.
TEST(StereoStart, SparsePixelsDoNotTellWhetherAMapCanBegin) {
  const auto pixels = pixels_of(300, 200);
  std::vector<StaticMatch> matches(pixels.size(), match_of(MatchState::kMatched));
  for (std::size_t i = 250; i < matches.size(); ++i)
    matches[i] = match_of(MatchState::kLowCorrelation);
  matches[499] = match_of(MatchState::kMatched);
  const StereoStart start = stereo_start(pixels, matches);
  EXPECT_EQ(start.quality.in_view, 300U);
  EXPECT_EQ(start.quality.good, 250U);
  ASSERT_EQ(start.points.size(), pixels.size());
  EXPECT_GT(start.points[499].depth.sigma, 0.0F) << "but a map may have them";
  EXPECT_TRUE(start.points[499].pixel.sparse);
  EXPECT_EQ(start.points[498].depth.sigma, 0.0F);
}

}  // namespace
}  // namespace sovo
