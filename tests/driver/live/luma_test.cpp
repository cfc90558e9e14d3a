#include "sovo/driver/live/luma.h"

#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <cmath>
#include <cstdlib>
#include <random>

namespace sovo {
namespace {

constexpr int kRawWidth = 32;
constexpr int kRawHeight = 6;

std::uint8_t grey_at(int x, int y) { return static_cast<std::uint8_t>(7 * x + 3 * y); }

/// The pattern in a format, rows padded by `padding` bytes.
std::vector<std::uint8_t> make_bytes(CameraFormat format, int padding, int* stride) {
  const bool packed = format == CameraFormat::kYuyv || format == CameraFormat::kUyvy;
  *stride = kRawWidth * (packed ? 2 : 1) + padding;
  const int rows = format == CameraFormat::kNv12 ? kRawHeight * 3 / 2 : kRawHeight;
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(*stride) * rows, 0x80);
  for (int y = 0; y < kRawHeight; ++y) {
    for (int x = 0; x < kRawWidth; ++x) {
      const int column = packed ? 2 * x + (format == CameraFormat::kUyvy ? 1 : 0) : x;
      bytes[static_cast<std::size_t>(y) * *stride + column] = grey_at(x, y);
    }
  }
  return bytes;
}

std::vector<std::uint8_t> make_jpeg(int width, int height) {
  std::vector<std::uint8_t> grey(static_cast<std::size_t>(width) * height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x)
      grey[y * width + x] = static_cast<std::uint8_t>(x < width / 2 ? 60 : 180);
  }
  tjhandle encoder = tjInitCompress();
  unsigned char* out = nullptr;
  unsigned long size = 0;
  EXPECT_EQ(tjCompress2(encoder, grey.data(), width, 0, height, TJPF_GRAY, &out, &size, TJSAMP_GRAY,
                        95, 0),
            0);
  std::vector<std::uint8_t> bytes(out, out + size);
  tjFree(out);
  tjDestroy(encoder);
  return bytes;
}

constexpr CameraFormat kPlain[] = {CameraFormat::kYuyv, CameraFormat::kUyvy, CameraFormat::kGrey,
                                   CameraFormat::kNv12};

TEST(LumaReader, EveryPlainFormatGivesTheSameLuma) {
  for (const CameraFormat format : kPlain) {
    for (const int padding : {0, 10}) {
      RawImage raw{format, kRawWidth, kRawHeight, 0, {}};
      const auto bytes = make_bytes(format, padding, &raw.stride);
      raw.bytes = bytes;
      LumaReader reader;
      std::vector<std::uint8_t> luma(kRawWidth * kRawHeight);
      std::vector<std::uint8_t> left(kRawWidth * kRawHeight / 2);
      std::vector<std::uint8_t> right(left.size());
      ASSERT_TRUE(reader.read(raw, luma.data())) << to_string(format) << reader.problem();
      ASSERT_TRUE(reader.read_halves(raw, left.data(), right.data()));
      for (int y = 0; y < kRawHeight; ++y) {
        for (int x = 0; x < kRawWidth; ++x) {
          EXPECT_EQ(luma[y * kRawWidth + x], grey_at(x, y));
          const auto& half = x < kRawWidth / 2 ? left : right;
          EXPECT_EQ(half[y * kRawWidth / 2 + x % (kRawWidth / 2)], grey_at(x, y));
        }
      }
    }
  }
}

TEST(LumaReader, AShortBufferIsRefusedAtEveryLength) {
  for (const CameraFormat format : kPlain) {
    RawImage raw{format, kRawWidth, kRawHeight, 0, {}};
    const auto bytes = make_bytes(format, 0, &raw.stride);
    LumaReader reader;
    std::vector<std::uint8_t> luma(kRawWidth * kRawHeight);
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      const std::vector<std::uint8_t> torn(bytes.begin(), bytes.begin() + size);
      raw.bytes = torn;
      EXPECT_FALSE(reader.read(raw, luma.data())) << to_string(format) << " " << size;
    }
    raw.bytes = bytes;
    raw.stride = kRawWidth - 1;
    EXPECT_FALSE(reader.read(raw, luma.data()));
  }
}

TEST(LumaReader, JpegIsHalvedAndItsSizeMustBeRight) {
  const auto bytes = make_jpeg(64, 32);
  LumaReader reader;
  std::vector<std::uint8_t> left(32 * 32);
  std::vector<std::uint8_t> right(32 * 32);
  RawImage raw{CameraFormat::kMjpeg, 64, 32, 64, bytes};
  ASSERT_TRUE(reader.read_halves(raw, left.data(), right.data())) << reader.problem();
  for (const std::uint8_t v : left) EXPECT_NEAR(v, 60, 6);
  for (const std::uint8_t v : right) EXPECT_NEAR(v, 180, 6);
  raw.height = 30;
  EXPECT_FALSE(reader.read_halves(raw, left.data(), right.data()));
  EXPECT_NE(reader.problem().find("64x32"), std::string::npos);
}

TEST(LumaReader, TornAndMutatedJpegsAreSurvivedAndTornOnesRefused) {
  const auto bytes = make_jpeg(64, 32);
  LumaReader reader;
  std::vector<std::uint8_t> luma(64 * 32);
  for (std::size_t size = 0; size + 2 < bytes.size(); size += 3) {
    const std::vector<std::uint8_t> torn(bytes.begin(), bytes.begin() + size);
    EXPECT_FALSE(reader.read({CameraFormat::kMjpeg, 64, 32, 64, torn}, luma.data())) << size;
  }
  std::mt19937_64 random(11);
  for (int n = 0; n < 2000; ++n) {
    auto mutated = bytes;
    for (int k = 0; k < 4; ++k)
      mutated[random() % mutated.size()] = static_cast<std::uint8_t>(random());
    if (!reader.read({CameraFormat::kMjpeg, 64, 32, 64, mutated}, luma.data())) {
      EXPECT_FALSE(reader.problem().empty());
    }
  }
  EXPECT_TRUE(reader.read({CameraFormat::kMjpeg, 64, 32, 64, bytes}, luma.data()));
}

}  // namespace
}  // namespace sovo
