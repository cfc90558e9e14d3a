#include "sovo/vo/sparse_regions.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace sovo {
namespace {

constexpr int kWidth = 128;  // four regions by three
constexpr int kHeight = 96;

/// Pixels a region apart by `step`, in rows from `first` up to `end`.
void add_pixels(int first, int end, int step, std::vector<SelectedPixel>* out) {
  for (int y = first; y < end; y += step) {
    for (int x = 0; x < kWidth; x += step) {
      SelectedPixel p;
      p.x = static_cast<std::int16_t>(x);
      p.y = static_cast<std::int16_t>(y);
      out->push_back(p);
    }
  }
}

TEST(SparseRegions, AreNoneWherePixelsAreSpreadEvenly) {
  std::vector<SelectedPixel> pixels;
  add_pixels(0, kHeight, 4, &pixels);
  const SparseRegions sparse = sparse_regions(pixels, ImageU8(), kWidth, kHeight);
  EXPECT_EQ(sparse.share, 0.0);
  for (std::size_t i = 0; i < sparse.mask.size(); ++i) EXPECT_EQ(sparse.mask.data()[i], 0);
}

TEST(SparseRegions, AreThoseWithFewOfThePixels) {
  std::vector<SelectedPixel> pixels;
  add_pixels(0, 64, 16, &pixels);
  add_pixels(64, kHeight, 2, &pixels);
  const SparseRegions sparse = sparse_regions(pixels, ImageU8(), kWidth, kHeight);
  EXPECT_DOUBLE_EQ(sparse.share, 2.0 / 3.0);
  EXPECT_EQ(sparse.mask.at(0, 0), 0) << "a pixel itself";
  EXPECT_EQ(sparse.mask.at(1, 0), 255);
  EXPECT_EQ(sparse.mask.at(kWidth - 1, 63), 255);
  EXPECT_EQ(sparse.mask.at(0, 64), 0);
  EXPECT_EQ(sparse.mask.at(kWidth - 1, kHeight - 1), 0);
}

TEST(SparseRegions, LeaveOutWhereNoPixelMayBe) {
  ImageU8 allowed(kWidth, kHeight);
  for (int y = 32; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) allowed.at(x, y) = 255;
  }
  std::vector<SelectedPixel> pixels;
  add_pixels(64, kHeight, 4, &pixels);
  const SparseRegions sparse = sparse_regions(pixels, allowed, kWidth, kHeight);
  EXPECT_DOUBLE_EQ(sparse.share, 0.5);
  EXPECT_EQ(sparse.mask.at(0, 31), 0);
  EXPECT_EQ(sparse.mask.at(0, 32), 255);
}

/// Half of a region that no pixel may be in does not make the other half sparse.
TEST(SparseRegions, CountPixelsByTheAreaTheyMayBeIn) {
  ImageU8 allowed(kWidth, kHeight);
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < kWidth; ++x) allowed.at(x, y) = 255;
  }
  std::vector<SelectedPixel> pixels;
  add_pixels(0, 80, 4, &pixels);
  EXPECT_EQ(sparse_regions(pixels, allowed, kWidth, kHeight).share, 0.0);
}

TEST(SparseRegions, WithoutPixelsOrPlaceThereIsNothingToShare) {
  EXPECT_EQ(sparse_regions({}, ImageU8(kWidth, kHeight), kWidth, kHeight).share, 0.0);
  EXPECT_EQ(sparse_regions({}, ImageU8(), kWidth, kHeight).share, 0.0);
}

}  // namespace
}  // namespace sovo
