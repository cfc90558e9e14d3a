#include "sovo/io/image_file.h"

#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "sovo/io/image_codecs.h"

namespace sovo {
namespace {

GreyImage ramp8(int width, int height) {
  GreyImage image{width, height, PixelFormat::kMono8, {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.data.push_back(static_cast<std::uint8_t>((3 * x + 5 * y) % 256));
    }
  }
  return image;
}

GreyImage ramp16(int width, int height) {
  GreyImage image{width, height, PixelFormat::kMono16, {}};
  for (int i = 0; i < width * height; ++i) {
    const int v = (257 * i) % 65536;
    image.data.push_back(static_cast<std::uint8_t>(v % 256));
    image.data.push_back(static_cast<std::uint8_t>(v / 256));
  }
  return image;
}

std::vector<std::uint8_t> bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

TEST(ImageFile, PngRoundTripsBitForBit) {
  for (const GreyImage& image : {ramp8(37, 21), ramp16(37, 21)}) {
    const auto bytes = codecs::encode_png(image);
    ASSERT_TRUE(bytes.ok());
    const auto decoded = decode_grey_image(*bytes);
    ASSERT_TRUE(decoded.ok()) << decoded.error();
    EXPECT_EQ(decoded->width, 37);
    EXPECT_EQ(decoded->height, 21);
    EXPECT_EQ(decoded->format, image.format);
    EXPECT_EQ(decoded->data, image.data);
  }
}

TEST(ImageFile, TruncatedPngIsAnErrorAtEveryLength) {
  const auto bytes = codecs::encode_png(ramp8(37, 21));
  ASSERT_TRUE(bytes.ok());
  for (std::size_t size = 0; size + 1 < bytes->size(); size += 7) {
    EXPECT_FALSE(decode_grey_image(std::span(*bytes).first(size)).ok()) << size;
  }
}

TEST(ImageFile, DamagedPngSaysSo) {
  auto bytes = codecs::encode_png(ramp8(37, 21));
  ASSERT_TRUE(bytes.ok());
  bytes->at(bytes->size() / 2) ^= 0x55;
  const auto decoded = decode_grey_image(*bytes);
  ASSERT_FALSE(decoded.ok());
  EXPECT_NE(decoded.error().find("damaged PNG"), std::string::npos) << decoded.error();
}

TEST(ImageFile, JpegIsDecodedToLuminance) {
  std::vector<std::uint8_t> grey(64 * 48);
  for (int i = 0; i < 64 * 48; ++i) grey[i] = static_cast<std::uint8_t>(2 * (i % 64) + i / 64);
  unsigned char* out = nullptr;
  unsigned long size = 0;
  tjhandle handle = tjInitCompress();
  ASSERT_EQ(tjCompress2(handle, grey.data(), 64, 0, 48, TJPF_GRAY, &out, &size, TJSAMP_GRAY, 95, 0),
            0);
  const std::vector<std::uint8_t> bytes(out, out + size);
  tjFree(out);
  tjDestroy(handle);
  const auto decoded = decode_grey_image(bytes);
  ASSERT_TRUE(decoded.ok()) << decoded.error();
  ASSERT_EQ(decoded->data.size(), grey.size());
  for (std::size_t i = 0; i < grey.size(); ++i) EXPECT_NEAR(decoded->data[i], grey[i], 4);
  EXPECT_FALSE(decode_grey_image(std::span(bytes).first(bytes.size() / 3)).ok());
}

TEST(ImageFile, PgmOfEightAndSixteenBits) {
  const auto eight = decode_grey_image(bytes_of("P5\n# a comment\n2 2\n255\n\x01\x02\x03\x7f"));
  ASSERT_TRUE(eight.ok()) << eight.error();
  EXPECT_EQ(eight->data, (std::vector<std::uint8_t>{1, 2, 3, 127}));
  const auto sixteen = decode_grey_image(bytes_of("P5 1 2 65535\n\x01\x02\x03\x04"));
  ASSERT_TRUE(sixteen.ok()) << sixteen.error();
  EXPECT_EQ(sixteen->format, PixelFormat::kMono16);
  EXPECT_EQ(sixteen->data, (std::vector<std::uint8_t>{2, 1, 4, 3}));
}

TEST(ImageFile, PgmWithASmallerFullScaleIsStretched) {
  const auto image = decode_grey_image(bytes_of("P5 2 1 15\n\x0f\x05"));
  ASSERT_TRUE(image.ok()) << image.error();
  EXPECT_EQ(image->data, (std::vector<std::uint8_t>{255, 85}));
}

TEST(ImageFile, ColourBecomesLuma) {
  const auto image =
      decode_grey_image(bytes_of("P6 3 1 255\n\xff" + std::string("\0\0\0\xff\0\0\0\xff", 8)));
  ASSERT_TRUE(image.ok()) << image.error();
  EXPECT_EQ(image->data, (std::vector<std::uint8_t>{76, 150, 29}));
}

TEST(ImageFile, WhatIsNoImageIsRefusedWithAReason) {
  EXPECT_FALSE(decode_grey_image({}).ok());
  EXPECT_FALSE(decode_grey_image(bytes_of("hello")).ok());
  EXPECT_FALSE(decode_grey_image(bytes_of("P5 4 4 255\nabc")).ok());
  EXPECT_FALSE(decode_grey_image(bytes_of("P5 900000 900000 255\nabc")).ok());
  EXPECT_FALSE(decode_grey_image(bytes_of("P5 0 4 255\nabc")).ok());
}

TEST(ImageFile, FilesAreNamedInErrors) {
  const auto folder = std::filesystem::temp_directory_path() / "sovo_image_file_test";
  std::filesystem::create_directories(folder);
  const std::string path = (folder / "a.png").string();
  ASSERT_TRUE(write_png(path, ramp16(8, 8)).ok());
  const auto image = read_grey_image(path);
  ASSERT_TRUE(image.ok()) << image.error();
  EXPECT_EQ(image->data, ramp16(8, 8).data);
  std::filesystem::remove_all(folder);
  const auto missing = read_grey_image(path);
  ASSERT_FALSE(missing.ok());
  EXPECT_NE(missing.error().find(path), std::string::npos);
}

}  // namespace
}  // namespace sovo
