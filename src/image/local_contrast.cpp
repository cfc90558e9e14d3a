#include "sovo/image/local_contrast.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace sovo {
namespace {

constexpr int kBlock = 4;  ///< Side of the blocks of which means are taken [px].
constexpr float kHalf = 0.5F * (kBlock - 1);
constexpr float kMean = 100.0F;
constexpr float kWhite = 255.0F;

/// Index of the value `i` steps along a line of `n` that is mirrored at its ends.
int mirrored(int i, int n) {
  if (n == 1) return 0;
  const int period = 2 * (n - 1);
  const int at = std::abs(i) % period;
  return at < n ? at : period - at;
}

/// Mean over 2 radius + 1 neighbours along each row; `line` has room for a row and twice the
/// radius.
void smooth_rows(const ImageF& from, int radius, float* line, ImageF* to) {
  const int w = from.width();
  const float share = 1.0F / static_cast<float>(2 * radius + 1);
  for (int y = 0; y < from.height(); ++y) {
    for (int i = 0; i < radius; ++i) {
      line[i] = from.at(mirrored(i - radius, w), y);
      line[radius + w + i] = from.at(mirrored(w + i, w), y);
    }
    std::copy_n(&from.at(0, y), w, line + radius);
    float sum = 0.0F;
    for (int i = 0; i < 2 * radius; ++i) sum += line[i];
    for (int x = 0; x < w; ++x) {
      sum += line[x + 2 * radius];
      to->at(x, y) = share * sum;
      sum -= line[x];
    }
  }
}

/// The same along each column; `sums` has room for a row.
void smooth_columns(const ImageF& from, int radius, float* sums, ImageF* to) {
  const int w = from.width();
  const int h = from.height();
  const float share = 1.0F / static_cast<float>(2 * radius + 1);
  std::fill_n(sums, w, 0.0F);
  for (int y = -radius; y <= radius; ++y) {
    for (int x = 0; x < w; ++x) sums[x] += from.at(x, mirrored(y, h));
  }
  for (int y = 0; y < h; ++y) {
    const float* in = &from.at(0, mirrored(y + radius + 1, h));
    const float* out = &from.at(0, mirrored(y - radius, h));
    float* mean = &to->at(0, y);
    for (int x = 0; x < w; ++x) {
      mean[x] = share * sums[x];
      sums[x] += in[x] - out[x];
    }
  }
}

/// Multiplies a block's pixels of one row with factors between that of its middle and those of its
/// neighbours.
void multiply_block(const float* factor, float* pixels) {
  const float before = (factor[0] - factor[-1]) / kBlock;
  const float after = (factor[1] - factor[0]) / kBlock;
  const std::array<float, kBlock> factors = {factor[0] - 1.5F * before, factor[0] - 0.5F * before,
                                             factor[0] + 0.5F * after, factor[0] + 1.5F * after};
  for (std::size_t i = 0; i < kBlock; ++i) pixels[i] = std::min(kWhite, pixels[i] * factors[i]);
}

}  // namespace

void LocalContrast::apply(ImageF* image) {
  if (image->empty()) return;
  average_blocks(*image);
  // Two boxes, one after the other, reach as far as the triangle.
  const double radius = 0.5 * config_.radius * image->width() / kBlock;
  smooth(std::max(1, static_cast<int>(std::lround(radius))));
  const auto floor = static_cast<float>(config_.floor);
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    blocks_.data()[i] = kMean / (blocks_.data()[i] + floor);
  }
  multiply(image);
}

void LocalContrast::average_blocks(const ImageF& image) {
  const int w = (image.width() + kBlock - 1) / kBlock;
  const int h = (image.height() + kBlock - 1) / kBlock;
  blocks_.resize(w, h);
  scratch_.resize(w, h);
  sums_.resize(static_cast<std::size_t>(w));
  columns_.resize(static_cast<std::size_t>(image.width()));
  for (int y = 0; y < h; ++y) {
    const int rows = std::min(kBlock, image.height() - y * kBlock);
    float* column = columns_.data();
    std::copy_n(&image.at(0, y * kBlock), image.width(), column);
    for (int j = 1; j < rows; ++j) {
      const float* from = &image.at(0, y * kBlock + j);
      for (int x = 0; x < image.width(); ++x) column[x] += from[x];
    }
    for (int x = 0; x < w; ++x) {
      const int count = std::min(kBlock, image.width() - x * kBlock);
      float sum = 0.0F;
      for (int i = 0; i < count; ++i) sum += column[x * kBlock + i];
      blocks_.at(x, y) = sum / static_cast<float>(rows * count);
    }
  }
}

void LocalContrast::smooth(int radius) {
  row_.resize(static_cast<std::size_t>(blocks_.width() + 2 * radius));
  for (int pass = 0; pass < 2; ++pass) {
    smooth_rows(blocks_, radius, row_.data(), &scratch_);
    smooth_columns(scratch_, radius, sums_.data(), &blocks_);
  }
}

/// The factor of a pixel lies between those of the middles of the four blocks around it.
void LocalContrast::multiply(ImageF* image) {
  const int w = blocks_.width();
  const int last = blocks_.height() - 1;
  for (int y = 0; y < image->height(); ++y) {
    const float place = std::max(0.0F, (static_cast<float>(y) - kHalf) / kBlock);
    const int above = std::min(static_cast<int>(place), last);
    const int below = std::min(above + 1, last);
    const float fy = place - static_cast<float>(above);
    float* row = row_.data() + 1;  // with the first and the last repeated beyond the ends
    for (int x = 0; x < w; ++x) {
      row[x] = blocks_.at(x, above) + fy * (blocks_.at(x, below) - blocks_.at(x, above));
    }
    row[-1] = row[0];
    row[w] = row[w - 1];
    float* pixels = &image->at(0, y);
    const int whole = image->width() / kBlock;
    for (int x = 0; x < whole; ++x) multiply_block(row + x, pixels + x * kBlock);
    const int rest = image->width() - whole * kBlock;
    if (rest == 0) continue;
    std::array<float, kBlock> last_pixels{};
    std::copy_n(pixels + whole * kBlock, rest, last_pixels.begin());
    multiply_block(row + whole, last_pixels.data());
    std::copy_n(last_pixels.begin(), rest, pixels + whole * kBlock);
  }
}

}  // namespace sovo
