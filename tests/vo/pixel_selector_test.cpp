#include "sovo/vo/pixel_selector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace sovo {
namespace {

/// Noise smoothed over 3x3 pixels: gradient everywhere, in every direction.
ImageF textured(int width, int height, std::uint32_t seed = 5) {
  std::mt19937 generator(seed);
  ImageF noise(width, height);
  for (std::size_t i = 0; i < noise.size(); ++i) {
    noise.data()[i] = static_cast<float>(generator() % 256);
  }
  ImageF out(width, height);
  out.fill(128.0F);
  for (int y = 1; y < height - 1; ++y) {
    for (int x = 1; x < width - 1; ++x) {
      float sum = 0.0F;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) sum += noise.at(x + dx, y + dy);
      }
      out.at(x, y) = sum / 9.0F;
    }
  }
  return out;
}

ImagePyramid plain_pyramid(ImageF image) {
  const int levels = ImagePyramid::num_levels_for(image.width(), image.height());
  return {std::move(image), levels};
}

std::vector<SelectedPixel> select(PixelSelector* selector, const ImagePyramid& pyramid, int wanted,
                                  const ImageU8* mask = nullptr) {
  std::vector<SelectedPixel> pixels;
  selector->select(pyramid, mask, wanted, &pixels);
  return pixels;
}

bool same(const std::vector<SelectedPixel>& a, const std::vector<SelectedPixel>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i].x != b[i].x || a[i].y != b[i].y || a[i].type != b[i].type) return false;
  }
  return true;
}

class PixelSelectorSizes : public testing::TestWithParam<std::pair<int, int>> {};

TEST_P(PixelSelectorSizes, CountBorderUniquenessAndSpread) {
  const auto [width, height] = GetParam();
  const ImagePyramid pyramid = plain_pyramid(textured(width, height));
  PixelSelector selector;
  const int wanted = 1000;
  const auto pixels = select(&selector, pyramid, wanted);
  EXPECT_LE(pixels.size(), 1000U);
  EXPECT_GE(pixels.size(), 800U);

  std::set<std::pair<int, int>> seen;
  std::vector<int> cells(16, 0);
  for (const SelectedPixel& p : pixels) {
    EXPECT_TRUE(seen.insert({p.x, p.y}).second) << p.x << " " << p.y;
    EXPECT_GE(p.x, 4);
    EXPECT_GE(p.y, 4);
    EXPECT_LT(p.x, width - 4);
    EXPECT_LT(p.y, height - 4);
    EXPECT_TRUE(p.type == 1 || p.type == 2 || p.type == 4);
    ++cells[static_cast<std::size_t>(4 * (4 * p.y / height) + 4 * p.x / width)];
  }
  for (const int count : cells) {
    EXPECT_GT(count, 1000 / 16 / 2);
    EXPECT_LT(count, 1000 / 16 * 2);
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, PixelSelectorSizes,
                         testing::Values(std::pair{640, 480}, std::pair{752, 480},
                                         std::pair{641, 479}, std::pair{1241, 376},
                                         std::pair{333, 251}));

TEST(PixelSelector, DensityFollowsTheWantedNumber) {
  const ImagePyramid pyramid = plain_pyramid(textured(640, 480));
  PixelSelector selector;
  for (const int wanted : {200, 4000, 600, 2000, 50, 1500}) {
    const auto pixels = select(&selector, pyramid, wanted);
    EXPECT_LE(pixels.size(), static_cast<std::size_t>(wanted));
    EXPECT_GE(pixels.size(), static_cast<std::size_t>(wanted * 7 / 10)) << wanted;
  }
}

TEST(PixelSelector, ReportsTheGradientOfItsPixels) {
  const ImagePyramid pyramid = plain_pyramid(textured(320, 240));
  PixelSelector selector;
  for (const SelectedPixel& p : select(&selector, pyramid, 500)) {
    const ImageF& image = pyramid[0];
    const float gx = 0.5F * (image.at(p.x + 1, p.y) - image.at(p.x - 1, p.y));
    const float gy = 0.5F * (image.at(p.x, p.y + 1) - image.at(p.x, p.y - 1));
    EXPECT_FLOAT_EQ(p.gradient_squared, gx * gx + gy * gy);
    if (p.type == 1) {
      EXPECT_GT(p.gradient_squared, 49.0F);
    }
  }
}

TEST(PixelSelector, MaskKeepsItsDistance) {
  const ImagePyramid pyramid = plain_pyramid(textured(641, 479));
  ImageU8 mask(641, 479);
  mask.fill(255);
  const auto masked = [](int x, int y) {
    return std::hypot(x - 300.0, y - 200.0) < 90.0 || x > 600;
  };
  for (int y = 0; y < 479; ++y) {
    for (int x = 0; x < 641; ++x) {
      if (masked(x, y)) mask.at(x, y) = 0;
    }
  }
  PixelSelector selector;
  const auto pixels = select(&selector, pyramid, 1500, &mask);
  EXPECT_GE(pixels.size(), 1100U);
  for (const SelectedPixel& p : pixels) {
    for (int dy = -3; dy <= 3; ++dy) {
      for (int dx = -3; dx <= 3; ++dx) EXPECT_FALSE(masked(p.x + dx, p.y + dy));
    }
  }
}

TEST(PixelSelector, AMaskHoldsForItsCallAlone) {
  const ImagePyramid pyramid = plain_pyramid(textured(641, 479));
  const auto half = [](bool left) {
    ImageU8 mask(641, 479);
    for (int y = 0; y < 479; ++y) {
      for (int x = 0; x < 641; ++x) mask.at(x, y) = (x < 320) == left ? 255 : 0;
    }
    return mask;
  };
  const ImageU8 left = half(true);
  const ImageU8 right = half(false);
  const auto share_on_left = [](const std::vector<SelectedPixel>& pixels) {
    const auto n = std::count_if(pixels.begin(), pixels.end(),
                                 [](const SelectedPixel& p) { return p.x < 320; });
    return static_cast<double>(n) / static_cast<double>(pixels.size());
  };
  PixelSelector selector;
  EXPECT_EQ(share_on_left(select(&selector, pyramid, 1000, &left)), 1.0);
  EXPECT_EQ(share_on_left(select(&selector, pyramid, 1000, &left)), 1.0);
  EXPECT_EQ(share_on_left(select(&selector, pyramid, 1000, &right)), 0.0);
  EXPECT_NEAR(share_on_left(select(&selector, pyramid, 1000)), 0.5, 0.1);
}

TEST(PixelSelector, WeakTextureGivesFewPixelsAndNoneWithoutAny) {
  ImageF flat(640, 480);
  flat.fill(90.0F);
  PixelSelector selector;
  EXPECT_TRUE(select(&selector, plain_pyramid(flat), 1000).empty());

  ImageF edge = flat;
  for (int y = 0; y < 480; ++y) {
    for (int x = 320; x < 640; ++x) edge.at(x, y) = 160.0F;
  }
  const auto pixels = select(&selector, plain_pyramid(edge), 1000);
  EXPECT_GE(pixels.size(), 100U);
  for (const SelectedPixel& p : pixels) EXPECT_NEAR(p.x, 319.5, 4.0);
}

TEST(PixelSelector, TheThresholdFollowsTheContrast) {
  constexpr int kWanted = 800;
  const ImageF full = textured(640, 480);
  ImageF weak = full;
  for (std::size_t i = 0; i < weak.size(); ++i) {
    weak.data()[i] = 128.0F + 0.15F * (full.data()[i] - 128.0F);
  }
  const ImagePyramid strong_pyramid = plain_pyramid(full);
  const ImagePyramid weak_pyramid = plain_pyramid(weak);
  PixelSelectorConfig fixed;
  fixed.least_offset = fixed.threshold_offset;
  PixelSelector unyielding(fixed);
  EXPECT_LT(select(&unyielding, weak_pyramid, kWanted).size(), kWanted / 2U)
      << "the test needs too little texture";

  PixelSelector selector;
  for (const SelectedPixel& p : select(&selector, strong_pyramid, kWanted)) {
    EXPECT_EQ(p.threshold_share, 1.0F);
  }
  const auto pixels = select(&selector, weak_pyramid, kWanted);
  EXPECT_GE(pixels.size(), 0.8 * kWanted);
  for (const SelectedPixel& p : pixels) {
    EXPECT_LT(p.threshold_share, 0.7F);
    EXPECT_EQ(p.threshold_share, pixels.front().threshold_share);
  }
  for (int i = 0; i < 20; ++i) select(&selector, strong_pyramid, kWanted);
  EXPECT_EQ(selector.threshold_share(), 1.0) << "with more texture it goes up again";
  select(&selector, weak_pyramid, kWanted);
  selector.reset();
  EXPECT_EQ(selector.threshold_share(), 1.0);
}

/// A horizon gives enough pixels by itself, and the sand before it none.
TEST(PixelSelector, WhereStrongPixelsLieTogetherLessIsAskedOfTheOthers) {
  constexpr int kWanted = 800;
  ImageF image = textured(640, 480);
  for (int y = 0; y < image.height(); ++y) {
    const bool horizon = y >= 60 && y < 110;
    for (int x = 0; x < image.width(); ++x) {
      float& grey = image.at(x, y);
      grey = 128.0F + (horizon ? 1.0F : 0.15F) * (grey - 128.0F);
    }
  }
  const ImagePyramid pyramid = plain_pyramid(image);
  const auto on_sand = [&](double min_spread) {
    PixelSelectorConfig config;
    config.min_spread = min_spread;
    PixelSelector selector(config);
    const auto pixels = select(&selector, pyramid, kWanted);
    EXPECT_GE(pixels.size(), 0.8 * kWanted);
    const auto count = std::count_if(pixels.begin(), pixels.end(),
                                     [](const SelectedPixel& p) { return p.y >= 120; });
    return static_cast<double>(count) / static_cast<double>(pixels.size());
  };
  EXPECT_LT(on_sand(0.0), 0.4) << "the test needs pixels that lie together";
  EXPECT_GT(on_sand(PixelSelectorConfig().min_spread), 0.6);
}

/// However few are wanted: in most regions there is one or none then.
TEST(PixelSelector, FewPixelsOfAnEvenTextureDoNotLieTogether) {
  const ImagePyramid pyramid = plain_pyramid(textured(1248, 384));
  for (const int wanted : {60, 150, 400, 2000}) {
    PixelSelector selector;
    for (int i = 0; i < 3; ++i) select(&selector, pyramid, wanted);
    EXPECT_EQ(selector.threshold_share(), 1.0) << wanted;
  }
}

TEST(PixelSelector, CoarseBlocksTakeOverWhereTheFineLevelIsWeak) {
  // A ramp of 6 grey levels a pixel beside flat ground: below the level-0 threshold of 7, above
  // the level-1 threshold (12 grey levels a level-1 pixel against 7 * sqrt(.75)).
  ImageF image(640, 480);
  image.fill(20.0F);
  for (int y = 0; y < 480; ++y) {
    for (int x = 0; x < 640; ++x) {
      const int phase = x % 80;
      if (phase < 20) image.at(x, y) = 20.0F + 6.0F * static_cast<float>(phase);
      if (phase >= 20 && phase < 40) image.at(x, y) = 20.0F + 6.0F * static_cast<float>(40 - phase);
    }
  }
  PixelSelector selector;
  const auto pixels = select(&selector, plain_pyramid(image), 1000);
  EXPECT_GE(pixels.size(), 500U);
  for (const SelectedPixel& p : pixels) EXPECT_GE(p.type, 2);
}

TEST(PixelSelector, SameHistoryGivesTheSamePixels) {
  const ImagePyramid first = plain_pyramid(textured(640, 480, 1));
  const ImagePyramid second = plain_pyramid(textured(640, 480, 2));
  PixelSelector a, b;
  const auto a1 = select(&a, first, 1000);
  const auto a2 = select(&a, second, 1000);
  EXPECT_TRUE(same(a1, select(&b, first, 1000)));
  EXPECT_TRUE(same(a2, select(&b, second, 1000)));
  a.reset();
  EXPECT_TRUE(same(a1, select(&a, first, 1000)));

  PixelSelectorConfig config;
  config.seed = 2;
  PixelSelector other(config);
  EXPECT_FALSE(same(a1, select(&other, first, 1000)));
}

TEST(PixelSelector, TinyImages) {
  PixelSelector selector;
  EXPECT_TRUE(select(&selector, plain_pyramid(textured(5, 5)), 100).empty());
  EXPECT_FALSE(select(&selector, plain_pyramid(textured(24, 24)), 100).empty());
}

}  // namespace
}  // namespace sovo
