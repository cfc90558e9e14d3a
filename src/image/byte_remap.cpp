#include "sovo/image/byte_remap.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "sovo/image/lanes.h"

namespace sovo {

namespace {

/// Of a position in a block, kept in 16 bits: a whole number and a fraction.
constexpr int kFractionBits = 8;
constexpr int kOne = 1 << kFractionBits;
/// Most blocks need no more rows; these three are read for each of them, needed or not.
constexpr int kUsualRows = 3;
/// Rows below that are asked for ahead: a frame that a camera has just delivered is in no cache.
constexpr int kRowsAhead = 6;
constexpr int kMostRows = 64;
/// In a row that no block has.
constexpr std::uint16_t kNoSource = 255 * kOne;

using Bytes = std::uint8_t __attribute__((vector_size(16)));
using Shorts = std::uint16_t __attribute__((vector_size(16)));

SOVO_LANE_FUNCTION Shorts load_shorts(const std::uint16_t* p) {
  Shorts v;
  __builtin_memcpy(&v, p, sizeof(v));
  return v;
}

SOVO_LANE_FUNCTION Shorts shorts_of(int x) { return Shorts{} + static_cast<std::uint16_t>(x); }

/// v[index[i] % 16] in each place: one past the end is asked for where a position was rounded up to
/// the last pixel, and then counts for nothing.
SOVO_LANE_FUNCTION Bytes pick(const Bytes& v, const Bytes& index) {
#if defined(__clang__)
  Bytes out;
  for (std::size_t i = 0; i < sizeof(out); ++i) out[i] = v[index[i] % sizeof(out)];
  return out;
#else
  return __builtin_shuffle(v, index);
#endif
}

/// What the pixels of a block take from a row: the left neighbour of each and its right one, by
/// turns, and the right one's share.
struct RowTaps {
  Bytes picked;
  Shorts share;
};
SOVO_LANE_FUNCTION RowTaps row_taps(const Shorts& x) {
  const Shorts left = x >> kFractionBits;
  const Shorts both = (left << 8) + left + shorts_of(1 << 8);
  return {reinterpret_cast<Bytes>(both), x & shorts_of(kOne - 1)};
}

/// A row interpolated, times `kOne`, which 16 bits just hold.
SOVO_LANE_FUNCTION Shorts blend_row(const std::uint8_t* window, const RowTaps& taps) {
  Bytes pixels;
  __builtin_memcpy(&pixels, window, sizeof(pixels));
  const auto both = reinterpret_cast<Shorts>(pick(pixels, taps.picked));
  const Shorts left = both & shorts_of(0xff);
  const Shorts right = both >> 8;
  return left * (shorts_of(kOne) - taps.share) + right * taps.share;
}

/// The rows above and below each pixel of a block.
struct RowPair {
  Shorts top, bottom;
};
SOVO_LANE_FUNCTION RowPair usual_rows(const std::uint8_t* window, std::ptrdiff_t step,
                                      const RowTaps& taps, const Shorts& row) {
  const Shorts first = blend_row(window, taps);
  const Shorts middle = blend_row(window + step, taps);
  const Shorts last = blend_row(window + 2 * step, taps);
  const auto lower = row != shorts_of(0);
  return {lower ? middle : first, lower ? last : middle};
}
SOVO_LANE_FUNCTION RowPair many_rows(const std::uint8_t* window, std::ptrdiff_t step, int rows,
                                     const RowTaps& taps, const Shorts& row) {
  RowPair out = {};
  for (int i = 0; i < rows; ++i) {
    const Shorts blended = blend_row(window + i * step, taps);
    out.top = row == shorts_of(i) ? blended : out.top;
    out.bottom = row + shorts_of(1) == shorts_of(i) ? blended : out.bottom;
  }
  return out;
}

/// Numbers From ... as floats.
template <class F, std::size_t From>
SOVO_LANE_FUNCTION F floats_of(const Shorts& v) {
  if constexpr (lanes_of<F> == kLanes) {
    using Part = std::uint16_t __attribute__((vector_size(8)));
    const Part part = __builtin_shufflevector(v, v, From, From + 1, From + 2, From + 3);
    return to_float<F>(__builtin_convertvector(part, LaneMask));
  } else {
    return to_float<F>(__builtin_convertvector(v, WideLaneMask));
  }
}

/// Pixels From ... of a block between its rows.
template <class F, std::size_t From>
SOVO_LANE_FUNCTION void store_blend(const RowPair& rows, const Shorts& share, float* out) {
  constexpr float kUnit = 1.0F / kOne;
  const F top = floats_of<F, From>(rows.top);
  const F bottom = floats_of<F, From>(rows.bottom);
  const F part = kUnit * floats_of<F, From>(share);
  store_lane(F(kUnit * (top + part * (bottom - top))), out + From);
}

struct RemapBlocks {
  template <class F>
  SOVO_LANE_FUNCTION static void run(const std::uint8_t* raw, std::ptrdiff_t step, int width,
                                     int height, const ByteRemap::Block* block, float* out) {
    for (int y = 0; y < height; ++y, out += width) {
      for (int x = 0; x < width; x += ByteRemap::kBlock, ++block) {
        const RowTaps taps = row_taps(load_shorts(block->x.data()));
        const Shorts at_y = load_shorts(block->y.data());
        const Shorts row = at_y >> kFractionBits;
        const Shorts share = at_y & shorts_of(kOne - 1);
        const std::uint8_t* window = raw + block->top * step + block->left;
        __builtin_prefetch(window + kRowsAhead * step);
        const RowPair rows = block->usual ? usual_rows(window, step, taps, row)
                                          : many_rows(window, step, block->rows, taps, row);
        float* to = out + std::min(x, width - ByteRemap::kBlock);
        store_blend<F, 0>(rows, share, to);
        if constexpr (lanes_of<F> == kLanes) store_blend<F, kLanes>(rows, share, to);
      }
    }
  }
};

/// The raw pixels that a block is made of.
struct BlockExtent {
  int left = std::numeric_limits<int>::max();
  int top = std::numeric_limits<int>::max();
  int right = -1, bottom = -1;
};

/// The upper left of the pixels that `source` lies between.
int cell(double source, int size) { return std::min(static_cast<int>(source), size - 2); }

/// Where `source` lies from pixel `origin` on.
std::uint16_t place(double source, int origin) {
  return static_cast<std::uint16_t>(std::lround((source - origin) * kOne));
}

std::optional<ByteRemap::Block> make_block(const Vec2* sources, int raw_width, int raw_height) {
  BlockExtent extent;
  for (int i = 0; i < ByteRemap::kBlock; ++i) {
    if (sources[i].x() < 0.0) continue;
    const int x = cell(sources[i].x(), raw_width);
    const int y = cell(sources[i].y(), raw_height);
    extent.left = std::min(extent.left, x);
    extent.top = std::min(extent.top, y);
    extent.right = std::max(extent.right, x + 1);
    extent.bottom = std::max(extent.bottom, y + 1);
  }
  ByteRemap::Block block;
  block.y.fill(kNoSource);
  if (extent.right < 0) return block;
  extent.left = std::min(extent.left, raw_width - ByteRemap::kWindow);
  extent.top = std::min(extent.top, raw_height - kUsualRows);
  if (extent.right - extent.left >= ByteRemap::kWindow) return std::nullopt;
  if (extent.bottom - extent.top >= kMostRows) return std::nullopt;
  block.left = static_cast<std::uint16_t>(extent.left);
  block.top = static_cast<std::uint16_t>(extent.top);
  block.rows = static_cast<std::uint8_t>(extent.bottom - extent.top + 1);
  block.usual = block.rows <= kUsualRows;
  for (int i = 0; i < ByteRemap::kBlock; ++i) {
    if (sources[i].x() < 0.0) {
      block.usual = false;
      continue;
    }
    const auto k = static_cast<std::size_t>(i);
    block.x[k] = place(sources[i].x(), extent.left);
    block.y[k] = place(sources[i].y(), extent.top);
    // Rounded up to the last row, from which nothing is taken below.
    if (block.y[k] >> kFractionBits >= kUsualRows - 1) block.usual = false;
  }
  return block;
}

}  // namespace

std::optional<ByteRemap> ByteRemap::make(int width, int height, int raw_width, int raw_height,
                                         std::span<const Vec2> sources) {
  assert(sources.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  constexpr int kMost = std::numeric_limits<std::uint16_t>::max();
  if (width < kBlock || raw_width < kWindow || raw_height < kUsualRows || raw_width > kMost ||
      raw_height > kMost) {
    return std::nullopt;
  }
  ByteRemap out;
  out.width_ = width;
  out.height_ = height;
  for (int y = 0; y < height; ++y) {
    const Vec2* row = sources.data() + static_cast<std::ptrdiff_t>(y) * width;
    for (int x = 0; x < width; x += kBlock) {
      const auto block = make_block(row + std::min(x, width - kBlock), raw_width, raw_height);
      if (!block) return std::nullopt;
      out.blocks_.push_back(*block);
    }
  }
  return out;
}

void ByteRemap::apply(const std::uint8_t* raw, std::ptrdiff_t step, ImageF* out) const {
  out->resize(width_, height_);
  run_kernel<RemapBlocks>(raw, step, width_, height_, blocks_.data(), out->data());
}

}  // namespace sovo
