#include "sovo/driver/live/colour.h"

#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace sovo {
namespace {

using Rgb = std::array<std::uint8_t, 3>;

/// Blocks side by side, four a half.
constexpr std::array<Rgb, 8> kBlocks = {{{250, 10, 10},
                                         {10, 240, 10},
                                         {10, 10, 250},
                                         {100, 100, 100},
                                         {255, 255, 255},
                                         {0, 0, 0},
                                         {220, 210, 20},
                                         {30, 140, 160}}};
constexpr int kBlock = 16;  // [px]
constexpr int kBlocksWidth = kBlock * 8;
constexpr int kBlocksHeight = 16;
constexpr int kNear = 3;  // levels: two roundings, of which blue takes one times 1.8
constexpr CameraFormat kColourFormats[] = {CameraFormat::kYuyv, CameraFormat::kUyvy,
                                           CameraFormat::kNv12, CameraFormat::kMjpeg};

const Rgb& block_at(int x) { return kBlocks.at(static_cast<std::size_t>(x / kBlock)); }

std::uint8_t rounded(double value) {
  return static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
}

double luma_of(const std::uint8_t* c) { return 0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2]; }

/// Luma and colour differences as JFIF defines them.
Rgb to_yuv(const Rgb& c) {
  const double luma = luma_of(c.data());
  return {rounded(luma), rounded(128 + (c[2] - luma) / 1.772),
          rounded(128 + (c[0] - luma) / 1.402)};
}

std::vector<std::uint8_t> blocks_as_jpeg() {
  std::vector<std::uint8_t> rgb;
  for (int i = 0; i < kBlocksWidth * kBlocksHeight; ++i) {
    const Rgb& c = block_at(i % kBlocksWidth);
    rgb.insert(rgb.end(), c.begin(), c.end());
  }
  tjhandle encoder = tjInitCompress();
  unsigned char* out = nullptr;
  unsigned long size = 0;
  EXPECT_EQ(tjCompress2(encoder, rgb.data(), kBlocksWidth, 0, kBlocksHeight, TJPF_RGB, &out, &size,
                        TJSAMP_422, 100, 0),
            0);
  std::vector<std::uint8_t> bytes(out, out + size);
  tjFree(out);
  tjDestroy(encoder);
  return bytes;
}

std::vector<std::uint8_t> blocks_as_yuv(CameraFormat format, int stride) {
  const bool planes = format == CameraFormat::kNv12;
  const int rows = planes ? kBlocksHeight * 3 / 2 : kBlocksHeight;
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(stride) * rows, 0x55);
  for (int y = 0; y < kBlocksHeight; ++y) {
    std::uint8_t* row = bytes.data() + std::ptrdiff_t{y} * stride;
    std::uint8_t* colour = bytes.data() + std::ptrdiff_t{kBlocksHeight + y / 2} * stride;
    for (int x = 0; x < kBlocksWidth; x += 2) {
      const auto [luma, u, v] = to_yuv(block_at(x));
      if (planes) {
        row[x] = row[x + 1] = luma;
        colour[x] = u;
        colour[x + 1] = v;
        continue;
      }
      const bool first = format == CameraFormat::kYuyv;
      const std::array<std::uint8_t, 4> pair =
          first ? std::array{luma, u, luma, v} : std::array{u, luma, v, luma};
      std::copy(pair.begin(), pair.end(), row + 2 * std::ptrdiff_t{x});
    }
  }
  return bytes;
}

ColourImage share(const RawImage& raw) {
  const auto bytes =
      std::make_shared<std::vector<std::uint8_t>>(raw.bytes.begin(), raw.bytes.end());
  return {raw.format, raw.width, raw.height, raw.stride, bytes, 0, raw.width};
}

/// The blocks in a format, rows padded by `padding` bytes.
ColourImage blocks(CameraFormat format, int padding = 0) {
  RawImage raw{format, kBlocksWidth, kBlocksHeight, kBlocksWidth, {}};
  if (format != CameraFormat::kMjpeg && format != CameraFormat::kNv12) raw.stride *= 2;
  raw.stride += padding;
  const auto bytes =
      format == CameraFormat::kMjpeg ? blocks_as_jpeg() : blocks_as_yuv(format, raw.stride);
  raw.bytes = bytes;
  return share(raw);
}

/// A JPEG's colours, of which two pixels share one, are interpolated: two blocks blend at their
/// border.
bool is_blended(const ColourImage& image, int x) {
  return image.format == CameraFormat::kMjpeg && (x % kBlock == 0 || x % kBlock == kBlock - 1);
}

/// The largest distance of any value from those of the blocks.
int distance_from_blocks(const ColourImage& side, const std::vector<std::uint8_t>& rgb) {
  int worst = 0;
  for (std::size_t i = 0; i < rgb.size(); ++i) {
    const int x = side.first_column + static_cast<int>(i / 3) % side.columns;
    if (is_blended(side, x)) continue;
    worst = std::max(worst, std::abs(rgb[i] - block_at(x)[i % 3]));
  }
  return worst;
}

TEST(ColourReader, EveryFormatGivesTheKnownColoursWholeAndHalved) {
  for (const CameraFormat format : kColourFormats) {
    for (const int padding : {0, 1, 10}) {
      ColourReader reader;
      std::vector<std::uint8_t> rgb;
      const ColourImage whole = blocks(format, padding);
      for (const ColourImage& side : {whole, whole.half(false), whole.half(true)}) {
        ASSERT_TRUE(reader.read(side, &rgb)) << to_string(format) << ": " << reader.problem();
        ASSERT_EQ(rgb.size(), 3U * side.columns * kBlocksHeight);
        EXPECT_LE(distance_from_blocks(side, rgb), kNear)
            << to_string(format) << " from column " << side.first_column;
      }
    }
  }
}

TEST(ColourReader, ItsLumaIsTheOneOfTheLumaReader) {
  for (const CameraFormat format : kColourFormats) {
    const ColourImage image = blocks(format);
    ColourReader reader;
    std::vector<std::uint8_t> rgb;
    ASSERT_TRUE(reader.read(image, &rgb));
    std::vector<std::uint8_t> luma(static_cast<std::size_t>(image.width) * image.height);
    LumaReader luma_reader;
    ASSERT_TRUE(luma_reader.read(
        {image.format, image.width, image.height, image.stride, *image.bytes}, luma.data()));
    for (std::size_t i = 0; i < luma.size(); ++i) {
      if (is_blended(image, static_cast<int>(i) % image.width)) continue;
      ASSERT_NEAR(luma_of(&rgb[3 * i]), luma[i], kNear) << to_string(format) << " " << i;
    }
  }
}

TEST(ColourReader, AnOddHalfBeginsWithinAPair) {
  ColourImage image = blocks(CameraFormat::kYuyv);
  image.first_column = kBlock - 1;
  image.columns = 3;
  ColourReader reader;
  std::vector<std::uint8_t> rgb;
  ASSERT_TRUE(reader.read(image, &rgb));
  EXPECT_LE(distance_from_blocks(image, rgb), kNear);
}

TEST(ColourReader, ShortAndSenselessImagesAreRefused) {
  ColourReader reader;
  std::vector<std::uint8_t> rgb;
  const auto is_refused = [&](const ColourImage& image) {
    return !reader.read(image, &rgb) && !reader.problem().empty();
  };
  for (const CameraFormat format :
       {CameraFormat::kYuyv, CameraFormat::kUyvy, CameraFormat::kNv12}) {
    const ColourImage whole = blocks(format);
    for (std::size_t size = 0; size < whole.bytes->size(); size += 7) {
      ColourImage torn = whole;
      torn.bytes = std::make_shared<std::vector<std::uint8_t>>(whole.bytes->begin(),
                                                               whole.bytes->begin() + size);
      EXPECT_TRUE(is_refused(torn)) << to_string(format) << " " << size;
    }
    ColourImage odd = whole;
    odd.width = odd.columns = kBlocksWidth - 1;
    EXPECT_TRUE(is_refused(odd));
    ColourImage narrow = whole;
    narrow.stride = kBlocksWidth - 1;
    EXPECT_TRUE(is_refused(narrow));
    ColourImage beside = whole;
    beside.first_column = 2;
    EXPECT_TRUE(is_refused(beside));
  }
  EXPECT_TRUE(is_refused({}));
  EXPECT_TRUE(is_refused(blocks(CameraFormat::kGrey)));
}

TEST(ColourReader, TornAndMutatedJpegsAreSurvivedAndTornOnesRefused) {
  const ColourImage whole = blocks(CameraFormat::kMjpeg);
  ColourReader reader;
  std::vector<std::uint8_t> rgb;
  ColourImage damaged = whole;
  for (std::size_t size = 0; size + 2 < whole.bytes->size(); size += 5) {
    damaged.bytes = std::make_shared<std::vector<std::uint8_t>>(whole.bytes->begin(),
                                                                whole.bytes->begin() + size);
    EXPECT_FALSE(reader.read(damaged, &rgb)) << size;
  }
  std::mt19937_64 random(12);
  for (int n = 0; n < 1000; ++n) {
    auto mutated = std::make_shared<std::vector<std::uint8_t>>(*whole.bytes);
    for (int k = 0; k < 4; ++k)
      (*mutated)[random() % mutated->size()] = static_cast<std::uint8_t>(random());
    damaged.bytes = mutated;
    if (!reader.read(damaged, &rgb)) {
      EXPECT_FALSE(reader.problem().empty());
    }
  }
  ASSERT_TRUE(reader.read(whole, &rgb)) << reader.problem();
  EXPECT_LE(distance_from_blocks(whole, rgb), kNear);
}

struct Wanted {
  ColourWanted flag = std::make_shared<std::atomic<bool>>(false);
  ColourKeeper keeper{flag};
  std::vector<std::uint8_t> bytes = std::vector<std::uint8_t>(64, 7);
  RawImage raw{CameraFormat::kYuyv, 8, 4, 16, bytes};
};

TEST(ColourKeeper, KeepsBytesOnlyWhileTheyAreWanted) {
  Wanted w;
  EXPECT_FALSE(w.keeper.keep(w.raw).bytes);
  *w.flag = true;
  ColourImage kept = w.keeper.keep(w.raw);
  ASSERT_TRUE(kept.bytes);
  EXPECT_EQ(*kept.bytes, w.bytes);
  EXPECT_EQ(kept.columns, 8);
  EXPECT_EQ(kept.half(true).first_column, 4);
  *w.flag = false;
  EXPECT_FALSE(w.keeper.keep(w.raw).bytes);
  EXPECT_EQ(*kept.bytes, w.bytes) << "who has an image keeps it";
  const std::weak_ptr<const std::vector<std::uint8_t>> memory = kept.bytes;
  kept = {};
  EXPECT_TRUE(memory.expired()) << "memory is held while nobody wants colour";
  EXPECT_EQ(w.keeper.kept(), 1U);
  EXPECT_EQ(w.keeper.skipped(), 0U);
}

TEST(ColourKeeper, GreyImagesHaveNoColour) {
  Wanted w;
  *w.flag = true;
  w.raw.format = CameraFormat::kGrey;
  EXPECT_FALSE(w.keeper.keep(w.raw).bytes);
  EXPECT_FALSE(ColourKeeper(nullptr).keep({CameraFormat::kYuyv, 8, 4, 16, w.bytes}).bytes);
}

TEST(ColourKeeper, AReaderThatIsTooSlowCostsColourAndNothingElse) {
  Wanted w;
  *w.flag = true;
  std::vector<ColourImage> held;
  while (w.keeper.skipped() == 0 && held.size() < 100) held.push_back(w.keeper.keep(w.raw));
  EXPECT_FALSE(held.back().bytes);
  EXPECT_EQ(w.keeper.kept(), held.size() - 1);
  const void* memory = held.front().bytes->data();
  held.front() = {};
  EXPECT_EQ(w.keeper.keep(w.raw).bytes->data(), memory) << "no memory is taken anew";
}

}  // namespace
}  // namespace sovo
