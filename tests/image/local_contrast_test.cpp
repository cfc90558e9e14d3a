#include "sovo/image/local_contrast.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace sovo {
namespace {

/// Texture of bands and specks without long waves, mean about 100.
double texture(int x, int y) {
  return 100.0 + 30.0 * std::sin(1.3 * x + 0.2 * y) + 20.0 * std::sin(0.4 * x - 1.1 * y) +
         static_cast<double>((x * 7919 + y * 104729) % 17) - 8.0;
}

/// A beam whose middle is at (cx, cy).
double beam(double x, double y, double cx, double cy) {
  return std::exp(-((x - cx) * (x - cx) + (y - cy) * (y - cy)) / (2.0 * 120.0 * 120.0));
}

template <class F>
ImageF image_of(int width, int height, const F& value) {
  ImageF image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.at(x, y) = static_cast<float>(value(x, y));
  }
  return image;
}

double at_mirrored(const ImageF& image, int x, int y) {
  const auto mirror = [](int i, int n) {
    while (n > 1 && (i < 0 || i >= n)) i = i < 0 ? -i : 2 * (n - 1) - i;
    return n > 1 ? i : 0;
  };
  return double{image.at(mirror(x, image.width()), mirror(y, image.height()))};
}

/// The same in plain loops: means of blocks of 4x4, two boxes over them, factors in between.
ImageF plainly(const ImageF& image, int radius, double floor) {
  const int w = (image.width() + 3) / 4;
  const int h = (image.height() + 3) / 4;
  ImageF blocks = image_of(w, h, [&](int x, int y) {
    double sum = 0.0;
    int count = 0;
    for (int j = 4 * y; j < std::min(image.height(), 4 * y + 4); ++j) {
      for (int i = 4 * x; i < std::min(image.width(), 4 * x + 4); ++i) {
        sum += double{image.at(i, j)};
        ++count;
      }
    }
    return sum / count;
  });
  for (int pass = 0; pass < 2; ++pass) {
    const ImageF before = blocks;
    blocks = image_of(w, h, [&](int x, int y) {
      double sum = 0.0;
      for (int j = -radius; j <= radius; ++j) {
        for (int i = -radius; i <= radius; ++i) sum += at_mirrored(before, x + i, y + j);
      }
      return sum / ((2 * radius + 1) * (2 * radius + 1));
    });
  }
  const auto factor = [&](int x, int y) {
    const int i = std::clamp(x, 0, w - 1);
    const int j = std::clamp(y, 0, h - 1);
    return 100.0 / (double{blocks.at(i, j)} + floor);
  };
  return image_of(image.width(), image.height(), [&](int x, int y) {
    const double u = (x - 1.5) / 4.0;
    const double v = (y - 1.5) / 4.0;
    const int i = static_cast<int>(std::floor(u));
    const int j = static_cast<int>(std::floor(v));
    const double f =
        (1.0 - (v - j)) * ((1.0 - (u - i)) * factor(i, j) + (u - i) * factor(i + 1, j)) +
        (v - j) * ((1.0 - (u - i)) * factor(i, j + 1) + (u - i) * factor(i + 1, j + 1));
    return std::min(255.0, double{image.at(x, y)} * f);
  });
}

void expect_as_plainly(int width, int height) {
  SCOPED_TRACE(std::to_string(width) + "x" + std::to_string(height));
  const ImageF image = image_of(width, height, [width, height](int x, int y) {
    return texture(x, y) * (0.2 + beam(x, y, 0.4 * width, 0.6 * height));
  });
  LocalContrastConfig config;
  config.radius = 0.15;
  config.floor = 5.0;
  const int radius = std::max(1, static_cast<int>(std::lround(0.5 * 0.15 * width / 4)));
  ImageF changed = image;
  LocalContrast contrast(config);
  contrast.apply(&changed);
  const ImageF expected = plainly(image, radius, config.floor);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      ASSERT_NEAR(changed.at(x, y), expected.at(x, y), 2e-3) << x << ", " << y;
    }
  }
  // What was done before leaves no trace.
  ImageF again = image;
  contrast.apply(&again);
  EXPECT_TRUE(std::equal(again.data(), again.data() + again.size(), changed.data()));
}

TEST(LocalContrast, IsWhatItsFormulaSaysAtAnySize) {
  expect_as_plainly(160, 120);
  expect_as_plainly(161, 119);
  expect_as_plainly(37, 23);
  expect_as_plainly(6, 5);
  expect_as_plainly(3, 2);
}

TEST(LocalContrast, AThingLooksAlikeWhereverTheBeamIs) {
  const int width = 320;
  const int height = 240;
  const auto lit = [&](double cx, double cy) {
    return image_of(width, height,
                    [&](int x, int y) { return texture(x, y) * 1.6 * beam(x, y, cx, cy); });
  };
  const auto difference = [](const ImageF& a, const ImageF& b) {
    double largest = 0.0;
    for (int y = 0; y < a.height(); ++y) {
      for (int x = 0; x < a.width(); ++x) {
        largest = std::max(largest, std::abs(double{a.at(x, y)} - double{b.at(x, y)}));
      }
    }
    return largest;
  };
  ImageF left = lit(110.0, 120.0);
  ImageF right = lit(170.0, 90.0);
  ASSERT_GT(difference(left, right), 40.0);
  LocalContrastConfig config;
  config.floor = 0.01;
  LocalContrast contrast(config);
  contrast.apply(&left);
  contrast.apply(&right);
  EXPECT_LT(difference(left, right), 4.0);
  // Its texture is still there.
  EXPECT_GT(difference(left, image_of(width, height, [](int, int) { return 100.0; })), 40.0);
}

TEST(LocalContrast, LevelIsHeldAndTheDarkStaysDark) {
  LocalContrast contrast({});
  for (const float level : {0.0F, 2.0F, 40.0F, 200.0F}) {
    ImageF image = image_of(64, 48, [&](int, int) { return double{level}; });
    contrast.apply(&image);
    EXPECT_NEAR(image.at(13, 7), 100.0F * level / (level + 8.0F), 1e-3F) << level;
  }
  ImageF spark =
      image_of(320, 240, [](int x, int y) { return x == 100 && y == 100 ? 255.0 : 1.0; });
  contrast.apply(&spark);
  EXPECT_EQ(spark.at(100, 100), 255.0F);
  ImageF nothing;
  contrast.apply(&nothing);
  EXPECT_TRUE(nothing.empty());
}

}  // namespace
}  // namespace sovo
