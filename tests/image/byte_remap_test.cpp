#include "sovo/image/byte_remap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "sovo/image/undistorter.h"
#include "support/cameras.h"

namespace sovo {
namespace {

struct RawImage {
  int width, height, step;
  std::vector<std::uint8_t> pixels;

  /// Bilinear interpolation in doubles.
  double at(const Vec2& p) const {
    const int x = std::min(static_cast<int>(p.x()), width - 2);
    const int y = std::min(static_cast<int>(p.y()), height - 2);
    const auto pixel = [&](int i, int j) {
      return static_cast<double>(pixels[static_cast<std::size_t>((y + j) * step + x + i)]);
    };
    const double fx = p.x() - x;
    const double fy = p.y() - y;
    const double top = pixel(0, 0) + fx * (pixel(1, 0) - pixel(0, 0));
    const double bottom = pixel(0, 1) + fx * (pixel(1, 1) - pixel(0, 1));
    return top + fy * (bottom - top);
  }
};

/// Noise, in rows with room between them; no byte more than there must be.
RawImage noise(int width, int height, int step) {
  std::mt19937 random(5);
  RawImage out{width, height, step, {}};
  out.pixels.resize(static_cast<std::size_t>((height - 1) * step + width));
  for (std::uint8_t& pixel : out.pixels) pixel = static_cast<std::uint8_t>(random() % 256U);
  return out;
}

/// To 1/256 px, as the table keeps it.
Vec2 rounded(const Vec2& p) {
  return {std::round(256.0 * p.x()) / 256.0, std::round(256.0 * p.y()) / 256.0};
}

constexpr int kColumns = 61;  // not a multiple of a block
constexpr int kRows = 40;

/// Where each pixel of the result comes from, by a turn and a stretch about the middle.
std::vector<Vec2> turned(double angle, double stretch) {
  std::vector<Vec2> out;
  for (int y = 0; y < kRows; ++y) {
    for (int x = 0; x < kColumns; ++x) {
      const double dx = stretch * (x - 30.3);
      const double dy = stretch * (y - 19.8);
      const Vec2 p(30.3 + std::cos(angle) * dx - std::sin(angle) * dy,
                   19.8 + std::sin(angle) * dx + std::cos(angle) * dy);
      const bool inside =
          p.x() >= 0.0 && p.y() >= 0.0 && p.x() <= kColumns - 1 && p.y() <= kRows - 1;
      out.push_back(inside ? p : Vec2(-1.0, -1.0));
    }
  }
  return out;
}

void expect_bilinear(const RawImage& raw, const std::vector<Vec2>& sources) {
  const auto remap = ByteRemap::make(kColumns, kRows, raw.width, raw.height, sources);
  ASSERT_TRUE(remap);
  ImageF out;
  remap->apply(raw.pixels.data(), raw.step, &out);
  ASSERT_EQ(out.size(), sources.size());
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const double expected = sources[i].x() < 0.0 ? 0.0 : raw.at(rounded(sources[i]));
    ASSERT_NEAR(static_cast<double>(out.data()[i]), expected, 1e-3) << "pixel " << i;
  }
}

TEST(ByteRemap, IsBilinearInterpolation) {
  const RawImage raw = noise(kColumns, kRows, kColumns);
  expect_bilinear(raw, turned(0.0, 1.0));
  expect_bilinear(raw, turned(0.02, 0.95));
  expect_bilinear(raw, turned(-0.1, 1.3));
}

TEST(ByteRemap, OfNeighboursInManyRows) {
  const RawImage raw = noise(kColumns, kRows, kColumns);
  expect_bilinear(raw, turned(0.8, 1.1));
  expect_bilinear(raw, turned(1.571, 1.0));
}

TEST(ByteRemap, OfRowsWithRoomBetween) {
  expect_bilinear(noise(kColumns, kRows, kColumns + 13), turned(0.05, 0.9));
}

TEST(ByteRemap, OfEveryPixelAsItIs) {
  const RawImage raw = noise(kColumns, kRows, kColumns);
  std::vector<Vec2> sources;
  for (int y = 0; y < kRows; ++y) {
    for (int x = 0; x < kColumns; ++x) sources.emplace_back(x, y);
  }
  expect_bilinear(raw, sources);
  // What is rounded up to the last pixel has no neighbour in the window.
  for (Vec2& p : sources) p = (p + Vec2(0.9999, 0.9999)).cwiseMin(Vec2(kColumns - 1, kRows - 1));
  expect_bilinear(raw, sources);
}

TEST(ByteRemap, IsNotMadeWhereNeighboursLieTooFarApart) {
  EXPECT_TRUE(ByteRemap::make(kColumns, kRows, kColumns, kRows, turned(0.0, 1.9)));
  EXPECT_FALSE(ByteRemap::make(kColumns, kRows, kColumns, kRows, turned(0.0, 2.2)));
  const std::vector<Vec2> nowhere(7 * 7, Vec2(-1.0, -1.0));
  EXPECT_FALSE(ByteRemap::make(7, 7, kColumns, kRows, nowhere));
  EXPECT_FALSE(ByteRemap::make(7, 7, 15, kRows, nowhere));
}

TEST(ByteRemap, UndistortsLikeFloats) {
  for (const CameraModel& camera : {test::euroc_left(), test::tumvi_left()}) {
    const RawImage raw = noise(camera.width, camera.height, camera.width);
    ImageF floats(camera.width, camera.height);
    std::copy(raw.pixels.begin(), raw.pixels.end(), floats.data());
    const Undistorter undistorter(camera, optimal_pinhole(camera, {}));
    ASSERT_TRUE(undistorter.takes_bytes());
    ImageF from_floats;
    ImageF from_bytes;
    undistorter.apply(floats, &from_floats);
    undistorter.apply(raw.pixels.data(), raw.step, &from_bytes);
    // Positions are rounded by 1/512 px each way, where neighbours differ by 255 at most.
    double sum = 0.0;
    for (std::size_t i = 0; i < from_floats.size(); ++i) {
      const auto error = static_cast<double>(from_bytes.data()[i] - from_floats.data()[i]);
      ASSERT_NEAR(error, 0.0, 1.0);
      sum += error;
    }
    EXPECT_NEAR(sum / static_cast<double>(from_floats.size()), 0.0, 0.01);
  }
}

}  // namespace
}  // namespace sovo
