#include "sovo/image/photometric.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "support/synthetic_scene.h"

namespace sovo {
namespace {

/// A raw image with padded rows; `levels` of values 0..65535 for 16 bit, 0..255 for 8 bit.
template <class Level>
SideImage make_side(int width, int height, PixelFormat format, const Level& level) {
  SideImage side;
  side.valid = true;
  side.width = width;
  side.height = height;
  side.format = format;
  const int bytes = format == PixelFormat::kMono8 ? 1 : 2;
  side.step = width * bytes + 3;
  std::vector<std::uint8_t> data(static_cast<std::size_t>(side.step) * height, 0xAA);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const unsigned value = level(x, y);
      std::uint8_t* pixel = data.data() + y * side.step + x * bytes;
      pixel[0] = static_cast<std::uint8_t>(value & 0xFFU);
      if (bytes == 2) pixel[1] = static_cast<std::uint8_t>(value >> 8U);
    }
  }
  side.data = std::make_shared<const std::vector<std::uint8_t>>(std::move(data));
  return side;
}

double response(double irradiance) { return 255.0 * std::pow(irradiance / 255.0, 0.6); }

PhotometricCalibration gamma_calibration(int width, int height) {
  PhotometricCalibration calibration;
  for (int i = 0; i < 256; ++i) {
    calibration.inverse_response.push_back(
        static_cast<float>(255.0 * std::pow(i / 255.0, 1.0 / 0.6)));
  }
  calibration.vignette.resize(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double r2 = (x - 0.5 * width) * (x - 0.5 * width) / (width * width * 0.25) +
                        (y - 0.5 * height) * (y - 0.5 * height) / (height * height * 0.25);
      calibration.vignette.at(x, y) = static_cast<float>(1.0 - 0.3 * r2);
    }
  }
  return calibration;
}

TEST(ToFloat, PlainImagesKeepTheirLevels) {
  const auto level8 = [](int x, int y) { return static_cast<unsigned>((7 * x + 31 * y) % 256); };
  const auto level16 = [](int x, int y) {
    return static_cast<unsigned>((5003 * x + 20011 * y) % 65536);
  };
  ImageF image;
  to_float(make_side(37, 11, PixelFormat::kMono8, level8), {}, 1, &image);
  ASSERT_EQ(image.width(), 37);
  ASSERT_EQ(image.height(), 11);
  for (int y = 0; y < 11; ++y) {
    for (int x = 0; x < 37; ++x) ASSERT_EQ(image.at(x, y), static_cast<float>(level8(x, y)));
  }
  to_float(make_side(37, 11, PixelFormat::kMono16, level16), {}, 1, &image);
  for (int y = 0; y < 11; ++y) {
    for (int x = 0; x < 37; ++x) {
      ASSERT_FLOAT_EQ(image.at(x, y), static_cast<float>(level16(x, y)) / 257.0F);
    }
  }
  to_float(make_side(3, 3, PixelFormat::kMono16, [](int, int) { return 65535U; }), {}, 1, &image);
  EXPECT_EQ(image.at(1, 1), 255.0F);
}

TEST(ToFloat, UndoesResponseAndVignette) {
  const int width = 64;
  const int height = 48;
  const PhotometricCalibration calibration = gamma_calibration(width, height);
  const auto irradiance = [](int x, int y) { return 60.0 + x + 1.5 * y; };
  const auto grey = [&](int x, int y) {
    return response(static_cast<double>(calibration.vignette.at(x, y)) * irradiance(x, y));
  };
  ImageF image;
  to_float(make_side(width, height, PixelFormat::kMono8,
                     [&](int x, int y) { return static_cast<unsigned>(std::lround(grey(x, y))); }),
           calibration, 1, &image);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {  // half a level of rounding, times slope and vignette
      ASSERT_NEAR(static_cast<double>(image.at(x, y)), irradiance(x, y), 2.1) << x << ", " << y;
    }
  }
  to_float(
      make_side(width, height, PixelFormat::kMono16,
                [&](int x, int y) { return static_cast<unsigned>(std::lround(257 * grey(x, y))); }),
      calibration, 1, &image);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      ASSERT_NEAR(static_cast<double>(image.at(x, y)), irradiance(x, y), 0.02) << x << ", " << y;
    }
  }
}

TEST(ToFloat, FullScaleWithResponse) {
  PhotometricCalibration calibration = gamma_calibration(4, 4);
  calibration.vignette = {};
  ImageF image;
  to_float(make_side(4, 4, PixelFormat::kMono16, [](int, int) { return 65535U; }), calibration, 1,
           &image);
  EXPECT_FLOAT_EQ(image.at(2, 2), 255.0F);
}

TEST(ToFloat, DownscalesByMeansOfBlocksOfIrradiance) {
  const int width = 2055;  // longer than a chunk, and with remainders
  const int height = 13;
  const PhotometricCalibration calibration = gamma_calibration(width, height);
  const SideImage side = make_side(width, height, PixelFormat::kMono8, [](int x, int y) {
    return static_cast<unsigned>((13 * x + 57 * y) % 251);
  });
  ImageF full;
  to_float(side, calibration, 1, &full);
  for (const int factor : {2, 3, 4}) {
    ImageF image;
    to_float(side, calibration, factor, &image);
    ASSERT_EQ(image.width(), width / factor);
    ASSERT_EQ(image.height(), height / factor);
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        double sum = 0.0;
        for (int i = 0; i < factor * factor; ++i) {
          sum += static_cast<double>(full.at(x * factor + i % factor, y * factor + i / factor));
        }
        ASSERT_NEAR(static_cast<double>(image.at(x, y)), sum / (factor * factor), 1e-3);
      }
    }
  }
}

}  // namespace
}  // namespace sovo
