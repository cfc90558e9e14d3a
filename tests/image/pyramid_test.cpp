#include "sovo/image/pyramid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sovo/image/interpolation.h"

namespace sovo {
namespace {

/// A smooth image with known value and gradient everywhere.
struct Wave {
  static double value(double x, double y) {
    return 120.0 + 40.0 * std::sin(0.11 * x + 0.3) * std::cos(0.07 * y) + 0.2 * x;
  }
  static double gx(double x, double y) {
    return 40.0 * 0.11 * std::cos(0.11 * x + 0.3) * std::cos(0.07 * y) + 0.2;
  }
  static double gy(double x, double y) {
    return -40.0 * 0.07 * std::sin(0.11 * x + 0.3) * std::sin(0.07 * y);
  }
};

ImageF wave_image(int width, int height) {
  ImageF image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.at(x, y) = static_cast<float>(Wave::value(x, y));
  }
  return image;
}

TEST(ImagePyramid, LevelsAreMeansOfBlocks) {
  const ImageF image = wave_image(101, 67);
  const ImagePyramid pyramid(image, 4);
  ASSERT_EQ(pyramid.num_levels(), 4);
  for (int level = 0; level < 4; ++level) {
    const int factor = 1 << level;
    ASSERT_EQ(pyramid[level].width(), 101 / factor);
    ASSERT_EQ(pyramid[level].height(), 67 / factor);
    for (int y = 0; y < pyramid[level].height(); ++y) {
      for (int x = 0; x < pyramid[level].width(); ++x) {
        double sum = 0.0;
        for (int i = 0; i < factor * factor; ++i) {
          sum += static_cast<double>(image.at(x * factor + i % factor, y * factor + i / factor));
        }
        ASSERT_NEAR(static_cast<double>(pyramid[level].at(x, y)), sum / (factor * factor), 1e-4);
      }
    }
  }
}

TEST(ImagePyramid, NumberOfLevels) {
  EXPECT_EQ(ImagePyramid::num_levels_for(752, 480), 5);   // 480 -> 30
  EXPECT_EQ(ImagePyramid::num_levels_for(1241, 376), 4);  // 376 -> 47
  EXPECT_EQ(ImagePyramid::num_levels_for(4096, 4096), 6);
  EXPECT_EQ(ImagePyramid::num_levels_for(4096, 4096, 3), 3);
  EXPECT_EQ(ImagePyramid::num_levels_for(40, 40), 1);
  EXPECT_EQ(ImagePyramid::num_levels_for(48, 48), 2);
}

TEST(Interpolation, SampleIsExactOnPixelsAndBilinearBetween) {
  const ImageF image = wave_image(20, 10);
  EXPECT_EQ(sample(image, 7.0F, 4.0F), image.at(7, 4));
  EXPECT_EQ(sample(image, 0.0F, 0.0F), image.at(0, 0));
  EXPECT_NEAR(sample(image, 7.25F, 4.0F), 0.75F * image.at(7, 4) + 0.25F * image.at(8, 4), 1e-4F);
  EXPECT_NEAR(sample(image, 7.0F, 4.75F), 0.25F * image.at(7, 4) + 0.75F * image.at(7, 5), 1e-4F);
  const float last = std::nextafter(19.0F, 0.0F);
  EXPECT_NEAR(sample(image, last, 3.0F), image.at(19, 3), 1e-3F);
}

TEST(Interpolation, ValueAndGradientOfASmoothImage) {
  const ImageF image = wave_image(80, 60);
  for (float y = 1.0F; y < 57.5F; y += 3.37F) {
    for (float x = 1.0F; x < 77.5F; x += 2.91F) {
      const Sample s = sample_with_gradient(image, x, y);
      const auto dx = static_cast<double>(x);
      const auto dy = static_cast<double>(y);
      ASSERT_NEAR(s.value, sample(image, x, y), 1e-3F);
      // Bilinear: off by at most an eighth of the second derivative in each direction.
      ASSERT_NEAR(static_cast<double>(s.value), Wave::value(dx, dy), 0.09);
      ASSERT_NEAR(static_cast<double>(s.gx), Wave::gx(dx, dy), 0.03);
      ASSERT_NEAR(static_cast<double>(s.gy), Wave::gy(dx, dy), 0.03);
    }
  }
}

TEST(Interpolation, GradientIsThatOfTheCentralDifferences) {
  const ImageF image = wave_image(40, 30);
  const Sample s = sample_with_gradient(image, 11.0F, 9.0F);
  EXPECT_FLOAT_EQ(s.gx, 0.5F * (image.at(12, 9) - image.at(10, 9)));
  EXPECT_FLOAT_EQ(s.gy, 0.5F * (image.at(11, 10) - image.at(11, 8)));
  // Between pixels it is interpolated bilinearly.
  const Sample right = sample_with_gradient(image, 12.0F, 9.0F);
  const Sample middle = sample_with_gradient(image, 11.25F, 9.0F);
  EXPECT_NEAR(middle.gx, 0.75F * s.gx + 0.25F * right.gx, 1e-4F);
  EXPECT_NEAR(middle.gy, 0.75F * s.gy + 0.25F * right.gy, 1e-4F);
}

TEST(Interpolation, InImageIsExactlyWhereReadingIsAllowed) {
  // A heap block of exactly this size: a read beyond it is an error under AddressSanitizer.
  const ImageF image = wave_image(16, 12);
  EXPECT_TRUE(in_image(image, 1.0F, 1.0F));
  EXPECT_FALSE(in_image(image, std::nextafter(1.0F, 0.0F), 5.0F));
  EXPECT_FALSE(in_image(image, 5.0F, std::nextafter(1.0F, 0.0F)));
  EXPECT_FALSE(in_image(image, 14.0F, 5.0F));
  EXPECT_FALSE(in_image(image, 5.0F, 10.0F));
  const float x = std::nextafter(14.0F, 0.0F);
  const float y = std::nextafter(10.0F, 0.0F);
  ASSERT_TRUE(in_image(image, x, y));
  EXPECT_NEAR(sample_with_gradient(image, x, y).value, image.at(14, 10), 1e-2F);
  EXPECT_NEAR(sample_with_gradient(image, 1.0F, 1.0F).value, image.at(1, 1), 1e-4F);
  EXPECT_FALSE(in_image(image, 3.0F, 5.0F, 2.5F));
  EXPECT_TRUE(in_image(image, 3.5F, 5.0F, 2.5F));
  EXPECT_FALSE(in_image(image, std::nanf(""), 5.0F));
}

}  // namespace
}  // namespace sovo
