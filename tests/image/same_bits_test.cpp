#include "support/same_bits.h"

#include <gtest/gtest.h>

#include "sovo/image/photometric.h"
#include "sovo/image/undistorter.h"
#include "support/cameras.h"
#include "support/pyramids.h"

namespace sovo {
namespace {

constexpr int kWidth = 152;
constexpr int kHeight = 104;

SideImage raw_image(PixelFormat format) {
  const std::size_t bytes = format == PixelFormat::kMono16 ? 2 : 1;
  const std::size_t row = bytes * kWidth;
  std::mt19937 random(8);
  std::vector<std::uint8_t> pixels(row * kHeight);
  for (std::uint8_t& pixel : pixels) pixel = static_cast<std::uint8_t>(random() % 256U);
  SideImage side;
  side.valid = true;
  side.width = kWidth;
  side.height = kHeight;
  side.format = format;
  side.step = static_cast<int>(row);
  side.data = std::make_shared<const std::vector<std::uint8_t>>(std::move(pixels));
  return side;
}

PhotometricCalibration calibration() {
  PhotometricCalibration out;
  for (int i = 0; i < 256; ++i) {
    out.inverse_response.push_back(static_cast<float>(i * (i + 255)) / 510.0F);
  }
  out.vignette = ImageF(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      out.vignette.at(x, y) = 1.0F - static_cast<float>(x * x + y * y) / 100000.0F;
    }
  }
  return out;
}

TEST(SameBits, PreparationOfAFrame) {
  const CameraModel raw = test::make_camera(kWidth, kHeight, 110, 111, 75.3, 51.6,
                                            Distortion::kRadtan, {-0.28, 0.07, 2e-4, 2e-5});
  const CameraModel pinhole = test::make_camera(kWidth, kHeight, 100, 100, 75.5, 51.5);
  const Undistorter undistorter(raw, pinhole);
  test::Checksum sum;
  for (const PixelFormat format : {PixelFormat::kMono8, PixelFormat::kMono16}) {
    ImageF grey;
    to_float(raw_image(format), calibration(), 2, &grey);
    sum.add(grey);
    to_float(raw_image(format), calibration(), 1, &grey);
    ImageF undistorted;
    undistorter.apply(grey, &undistorted);
    const ImagePyramid pyramid(std::move(undistorted), 3);
    for (int level = 0; level < pyramid.num_levels(); ++level) sum.add(pyramid[level]);
  }
  EXPECT_EQ(sum.value(), 0xd60feb3bcbe56c38U);
}

TEST(SameBits, BytesUndistorted) {
  const CameraModel raw = test::make_camera(kWidth, kHeight, 110, 111, 75.3, 51.6,
                                            Distortion::kRadtan, {-0.28, 0.07, 2e-4, 2e-5});
  const Undistorter undistorter(raw, test::make_camera(kWidth, kHeight, 100, 100, 75.5, 51.5));
  ASSERT_TRUE(undistorter.takes_bytes());
  const SideImage image = raw_image(PixelFormat::kMono8);
  ImageF undistorted;
  undistorter.apply(image.data->data(), image.step, &undistorted);
  test::Checksum sum;
  sum.add(undistorted);
  EXPECT_EQ(sum.value(), 11914141268158406607U);
}

}  // namespace
}  // namespace sovo
