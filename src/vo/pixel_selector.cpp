#include "sovo/vo/pixel_selector.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "sovo/image/lanes.h"

namespace sovo {
namespace {

constexpr int kNumDirections = 16;
constexpr int kMaxBlock = 64;
// Smaller blocks hold no choice of pixels, larger ones plenty.
constexpr int kSmallBlock = 2;
constexpr int kLargeBlock = 10;
constexpr double kLower = 0.6;  ///< Steps of the threshold's offset.
constexpr double kRaise = 1.2;
/// Images for which a lowered threshold stays: raised too soon it is lowered again, at the cost of
/// another selection.
constexpr int kPatience = 10;

struct Directions {
  std::array<float, kNumDirections> x{}, y{};
};

Directions make_directions() {
  Directions directions;
  for (std::size_t k = 0; k < kNumDirections; ++k) {
    const double angle = std::numbers::pi * static_cast<double>(k) / kNumDirections;
    directions.x[k] = static_cast<float>(std::cos(angle));
    directions.y[k] = static_cast<float>(std::sin(angle));
  }
  return directions;
}

float squared_gradient(const ImageF& image, int x, int y) {
  const float* row = image.row(y) + x;
  const float gx = 0.5F * (row[1] - row[-1]);
  const float gy = 0.5F * (row[image.width()] - row[-image.width()]);
  return gx * gx + gy * gy;
}

/// |grad I| of pixels of a row in whole grey levels a pixel, at most kMostGradient. Eight pixels at
/// least.
struct GradientSteps {
  template <class F>
  SOVO_LANE_FUNCTION static void steps(const float* row, std::ptrdiff_t width, int x,
                                       std::int32_t* out) {
    constexpr float kMost = static_cast<float>(kMostGradient);
    const F gx = 0.5F * (load_lane<F>(row + x + 1) - load_lane<F>(row + x - 1));
    const F gy = 0.5F * (load_lane<F>(row + x + width) - load_lane<F>(row + x - width));
    const F squared = min_lane(F(gx * gx + gy * gy), F(F{} + kMost * kMost));
    store_mask(to_int(sqrt_lane(squared)), out + x);
  }
  template <class F>
  SOVO_LANE_FUNCTION static void run(const float* row, std::ptrdiff_t width, int first, int last,
                                     std::int32_t* out) {
    constexpr int n = static_cast<int>(lanes_of<F>);
    for (int x = first; x + n <= last; x += n) steps<F>(row, width, x, out);
    steps<F>(row, width, last - n, out);
  }
};

float median_of(const GradientHistogram& histogram) {
  const int count = std::accumulate(histogram.begin(), histogram.end(), 0);
  int below = 0;
  for (std::size_t g = 0; g < histogram.size(); ++g) {
    below += histogram[g];
    if (2 * below >= count) return static_cast<float>(g);
  }
  return 0.0F;
}

/// Rows that are asked for before they are read: an image of a megabyte is in no cache near by.
constexpr int kRowsAhead = 4;

void prefetch_row(const ImageF& image, int y) {
  constexpr std::size_t kLineFloats = 16;
  if (y >= image.height()) return;
  const float* row = image.row(y);
  for (std::size_t x = 0; x < static_cast<std::size_t>(image.width()); x += kLineFloats) {
    __builtin_prefetch(row + x);
  }
}

int region_begin(int region, int num_regions, int size) { return region * size / num_regions; }

int ceil_div(int a, int b) { return (a + b - 1) / b; }

/// A row of an image with those around it, and what its pixels are judged by, a column each.
struct ScoreInput {
  const float *row, *above, *below;
  const float *nx, *ny;    ///< Direction of the block.
  const float* threshold;  ///< Of the squared gradient.
  const float* allowed;    ///< 1 or 0.
};

/// Raises `best` to |grad I * n| of the row's pixels, and sets `best_y` where that is more. Eight
/// pixels at least.
struct ScoreRow {
  template <class F>
  SOVO_LANE_FUNCTION static void score(const ScoreInput& in, int y, int x, float* best,
                                       std::int32_t* best_y) {
    const F gx = 0.5F * (load_lane<F>(in.row + x + 1) - load_lane<F>(in.row + x - 1));
    const F gy = 0.5F * (load_lane<F>(in.below + x) - load_lane<F>(in.above + x));
    const F along = abs_lane(F(gx * load_lane<F>(in.nx + x) + gy * load_lane<F>(in.ny + x)));
    const MaskOf<F> strong = gx * gx + gy * gy > load_lane<F>(in.threshold + x);
    const F value = F(strong ? along : F{}) * load_lane<F>(in.allowed + x);
    const F before = load_lane<F>(best + x);
    const MaskOf<F> better = value > before;
    store_lane(F(better ? value : before), best + x);
    const auto y_before = load_mask<MaskOf<F>>(best_y + x);
    store_mask(MaskOf<F>(better ? y - MaskOf<F>{} : y_before), best_y + x);
  }
  template <class F>
  SOVO_LANE_FUNCTION static void run(const ScoreInput& in, int y, int first, int last, float* best,
                                     std::int32_t* best_y) {
    constexpr int n = static_cast<int>(lanes_of<F>);
    for (int x = first; x + n <= last; x += n) score<F>(in, y, x, best, best_y);
    // The last ones with some before them once more: that changes nothing.
    score<F>(in, y, last - n, best, best_y);
  }
};

}  // namespace

PixelSelector::PixelSelector(const PixelSelectorConfig& config) : config_(config) { reset(); }

void PixelSelector::reset() {
  random_state_ = static_cast<std::uint64_t>(config_.seed);
  block_ = std::clamp(config_.initial_block, 1, kMaxBlock);
  threshold_share_ = 1.0;
  since_lowered_ = 0;
}

/// SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators"), upper half.
std::uint32_t PixelSelector::random() {
  random_state_ += 0x9e3779b97f4a7c15ULL;
  std::uint64_t z = random_state_;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return static_cast<std::uint32_t>((z ^ (z >> 31)) >> 32);
}

void PixelSelector::select(const ImagePyramid& pyramid, const ImageU8* mask, int wanted,
                           std::vector<SelectedPixel>* out) {
  out->clear();
  const ImageF& image = pyramid[0];
  const int border = 2 * std::max(1, config_.border);
  const int least_width = border + static_cast<int>(kWideLanes);
  if (wanted <= 0 || image.width() < least_width || image.height() <= border) return;
  masked_ = mask != nullptr && !mask->empty();
  if (masked_) erode_mask(*mask);
  allowed_row_.assign(static_cast<std::size_t>(image.width()), 1.0F);
  compute_medians(image);
  do {
    compute_thresholds();
    select_enough(pyramid, wanted, out);
  } while (lower_threshold(*out, wanted));
  raise_threshold();
  if (out->size() > static_cast<std::size_t>(wanted)) thin(wanted, out);
}

void PixelSelector::select_enough(const ImagePyramid& pyramid, int wanted,
                                  std::vector<SelectedPixel>* out) {
  for (int attempt = 0; attempt < 2; ++attempt) {
    select_all_levels(pyramid, out);
    // n = K / d^2 pixels from blocks of side d, solved for the largest d that gives enough.
    const double ratio = static_cast<double>(out->size()) / wanted;
    const int used = block_;
    block_ = std::clamp(static_cast<int>(std::sqrt(ratio) * used), 1, kMaxBlock);
    const bool retry = ratio < config_.reselect_below || ratio > config_.reselect_above;
    if (!retry || block_ == used) break;
  }
}

/// Share of the regions over which the pixels are spread: over so many of them, evenly, two pixels
/// would lie in the same one as often (Simpson's index, which few pixels do not bias). 1 where no
/// two lie together.
double PixelSelector::spread_of(const std::vector<SelectedPixel>& selected) const {
  const int side = std::max(8, config_.threshold_block);
  std::vector<double> pixels(medians_.size(), 0.0);
  for (const SelectedPixel& p : selected) {
    const int rx = std::min(p.x / side, regions_x_ - 1);
    const int ry = std::min(p.y / side, regions_y_ - 1);
    pixels[static_cast<std::size_t>(ry * regions_x_ + rx)] += 1.0;
  }
  double together = 0.0;  // pairs of pixels
  for (const double n : pixels) together += n * (n - 1.0);
  if (together == 0.0) return 1.0;
  const auto all = static_cast<double>(selected.size());
  return all * (all - 1.0) / (together * static_cast<double>(pixels.size()));
}

/// When blocks as small as can be gave too few pixels, or all that were found lie together: on the
/// horizon, around a shadow. False: all is well, or it is as low as may be.
bool PixelSelector::lower_threshold(const std::vector<SelectedPixel>& selected, int wanted) {
  const double least = std::min(1.0, config_.least_offset / config_.threshold_offset);
  const bool enough = static_cast<double>(selected.size()) >= config_.reselect_below * wanted;
  const bool few = !enough && block_ <= kSmallBlock;
  if (!(threshold_share_ > least)) return false;
  if (!few && spread_of(selected) >= config_.min_spread) return false;
  threshold_share_ = std::max(least, kLower * threshold_share_);
  since_lowered_ = 0;
  block_ = std::clamp(config_.initial_block, 1, kMaxBlock);
  return true;
}

/// For the next image, when the blocks of this one are so large that each has a choice.
void PixelSelector::raise_threshold() {
  if (block_ >= kLargeBlock && ++since_lowered_ > kPatience) {
    threshold_share_ = std::min(1.0, kRaise * threshold_share_);
  }
}

/// Median of |grad I| over every second pixel of every second row of each region.
void PixelSelector::compute_medians(const ImageF& image) {
  const int w = image.width();
  const int h = image.height();
  const int side = std::max(8, config_.threshold_block);
  regions_x_ = std::max(1, (w + side / 2) / side);
  regions_y_ = std::max(1, (h + side / 2) / side);
  medians_.resize(static_cast<std::size_t>(regions_x_) * regions_y_);
  gradient_row_.resize(static_cast<std::size_t>(w));
  for (int ry = 0; ry < regions_y_; ++ry) {
    histograms_.assign(static_cast<std::size_t>(regions_x_), {});
    const int y1 = std::min(h - 1, region_begin(ry + 1, regions_y_, h));
    for (int y = std::max(1, region_begin(ry, regions_y_, h)); y < y1; y += 2) {
      prefetch_row(image, y + kRowsAhead);
      prefetch_row(image, y + kRowsAhead + 1);
      run_kernel<GradientSteps>(image.row(y), std::ptrdiff_t{w}, 1, w - 1, gradient_row_.data());
      for (int rx = 0; rx < regions_x_; ++rx) {
        auto& histogram = histograms_[static_cast<std::size_t>(rx)];
        const int x1 = std::min(w - 1, region_begin(rx + 1, regions_x_, w));
        for (int x = std::max(1, region_begin(rx, regions_x_, w)); x < x1; x += 2) {
          ++histogram[static_cast<std::size_t>(gradient_row_[static_cast<std::size_t>(x)])];
        }
      }
    }
    for (int rx = 0; rx < regions_x_; ++rx) {
      medians_[static_cast<std::size_t>(ry * regions_x_ + rx)] =
          median_of(histograms_[static_cast<std::size_t>(rx)]);
    }
  }
}

/// Squared, of a region's median and those around it.
void PixelSelector::compute_thresholds() {
  thresholds_.resize(medians_.size());
  const auto offset = static_cast<float>(threshold_share_ * config_.threshold_offset);
  for (int ry = 0; ry < regions_y_; ++ry) {
    for (int rx = 0; rx < regions_x_; ++rx) {
      float sum = 0.0F;
      int count = 0;
      for (int y = std::max(0, ry - 1); y <= std::min(regions_y_ - 1, ry + 1); ++y) {
        for (int x = std::max(0, rx - 1); x <= std::min(regions_x_ - 1, rx + 1); ++x) {
          sum += medians_[static_cast<std::size_t>(y * regions_x_ + x)] + offset;
          ++count;
        }
      }
      const float mean = sum / static_cast<float>(count);
      thresholds_[static_cast<std::size_t>(ry * regions_x_ + rx)] = mean * mean;
    }
  }
}

/// `allowed_`: the minimum of the mask over a square of side 2 mask_border + 1, rows first.
/// Masks hardly ever change: the last one's is kept.
void PixelSelector::erode_mask(const ImageU8& mask) {
  const int w = mask.width();
  const int h = mask.height();
  if (mask_.width() == w && mask_.height() == h &&
      std::equal(mask.data(), mask.data() + mask.size(), mask_.data())) {
    return;
  }
  mask_ = mask;
  const int r = std::max(0, config_.mask_border);
  erosion_rows_.resize(w, h);
  allowed_.resize(w, h);
  for (int y = 0; y < h; ++y) {
    std::uint8_t* out = erosion_rows_.row(y);
    std::copy_n(mask.row(y), w, out);
    for (int k = std::max(0, y - r); k <= std::min(h - 1, y + r); ++k) {
      const std::uint8_t* in = mask.row(k);
      for (int x = 0; x < w; ++x) out[x] = std::min(out[x], in[x]);
    }
  }
  for (int y = 0; y < h; ++y) {
    std::uint8_t* out = allowed_.row(y);
    const std::uint8_t* in = erosion_rows_.row(y);
    std::copy_n(in, w, out);
    for (int shift = 1; shift <= std::min(r, w - 1); ++shift) {
      for (int x = 0; x < w - shift; ++x) out[x] = std::min(out[x], in[x + shift]);
      for (int x = shift; x < w; ++x) out[x] = std::min(out[x], in[x - shift]);
    }
  }
}

void PixelSelector::select_all_levels(const ImagePyramid& pyramid,
                                      std::vector<SelectedPixel>* out) {
  out->clear();
  for (int level = 0; level < std::min(3, pyramid.num_levels()); ++level) {
    select_level(pyramid, level, out);
  }
}

/// Lays out the blocks of a level and marks those within which a finer level has found a pixel.
void PixelSelector::inherit_hits(int level, int w, int h) {
  const std::size_t l = static_cast<std::size_t>(level);
  blocks_x_[l] = ceil_div(w, block_);
  blocks_y_[l] = ceil_div(h, block_);
  hit_[l].assign(static_cast<std::size_t>(blocks_x_[l]) * blocks_y_[l], 0);
  if (level > 0) {
    for (int by = 0; by < blocks_y_[l - 1]; ++by) {
      for (int bx = 0; bx < blocks_x_[l - 1]; ++bx) {
        const int parent_x = std::min(bx / 2, blocks_x_[l] - 1);
        const int parent_y = std::min(by / 2, blocks_y_[l] - 1);
        hit_[l][static_cast<std::size_t>(parent_y * blocks_x_[l] + parent_x)] |=
            hit_[l - 1][static_cast<std::size_t>(by * blocks_x_[l - 1] + bx)];
      }
    }
  }
}

/// One pass: a block of 2^level d pixels at level 0 is a block of d pixels at `level`.
void PixelSelector::select_level(const ImagePyramid& pyramid, int level,
                                 std::vector<SelectedPixel>* out) {
  const ImageF& image = pyramid[level];
  const std::size_t l = static_cast<std::size_t>(level);
  const int w = image.width();
  const int h = image.height();
  const int border = std::max(1, ceil_div(config_.border, 1 << level));
  if (w - 2 * border < static_cast<int>(kWideLanes)) return;
  inherit_hits(level, w, h);
  int region_row = -1;
  for (int by = 0; by < blocks_y_[l]; ++by) {
    std::uint8_t* hits = hit_[l].data() + static_cast<std::ptrdiff_t>(by) * blocks_x_[l];
    if (std::all_of(hits, hits + blocks_x_[l], [](std::uint8_t hit) { return hit != 0; })) continue;
    fill_directions(w);
    const int y0 = std::max(border, by * block_);
    const int y1 = std::min(h - border, (by + 1) * block_);
    for (int y = y0; y < y1; ++y) {
      const int full_y = y << level;
      const int row_of_y = ((full_y + 1) * regions_y_ - 1) / pyramid[0].height();
      if (row_of_y != region_row) fill_thresholds(level, row_of_y, w, pyramid[0].width());
      region_row = row_of_y;
      score_row(image, level, y, border, w - border);
    }
    for (int bx = 0; bx < blocks_x_[l]; ++bx) {
      if (hits[bx] != 0) continue;
      const float* row = best_score_.data();
      const float* best = std::max_element(row + bx * block_, row + std::min(w, (bx + 1) * block_));
      if (*best <= 0.0F) continue;
      const std::ptrdiff_t x = best - row;
      SelectedPixel pixel;
      if (!finest_pixel(pyramid[0], level, static_cast<int>(x),
                        best_y_[static_cast<std::size_t>(x)], &pixel)) {
        continue;
      }
      hits[bx] = 1;
      out->push_back(pixel);
    }
  }
}

/// Draws one direction a block for a row of blocks, and clears the row's scores.
void PixelSelector::fill_directions(int width) {
  static const Directions kDirections = make_directions();
  const std::size_t size = static_cast<std::size_t>(width);
  direction_x_.resize(size);
  direction_y_.resize(size);
  best_score_.assign(size, 0.0F);
  best_y_.assign(size, 0);
  for (int x0 = 0; x0 < width; x0 += block_) {
    const std::size_t k = random() % kNumDirections;
    const int x1 = std::min(width, x0 + block_);
    std::fill(direction_x_.begin() + x0, direction_x_.begin() + x1, kDirections.x[k]);
    std::fill(direction_y_.begin() + x0, direction_y_.begin() + x1, kDirections.y[k]);
  }
}

/// The squared thresholds of a row of regions, one a column of `level`.
void PixelSelector::fill_thresholds(int level, int region_row, int width, int full_width) {
  threshold_row_.resize(static_cast<std::size_t>(width));
  const double factor =
      level == 0 ? 1.0 : (level == 1 ? config_.level_threshold_1 : config_.level_threshold_2);
  const float* row = thresholds_.data() + static_cast<std::ptrdiff_t>(region_row) * regions_x_;
  for (int rx = 0; rx < regions_x_; ++rx) {
    const int x0 = std::min(width, region_begin(rx, regions_x_, full_width) >> level);
    const int x1 = rx + 1 == regions_x_
                       ? width
                       : std::min(width, region_begin(rx + 1, regions_x_, full_width) >> level);
    std::fill(threshold_row_.begin() + x0, threshold_row_.begin() + x1,
              row[rx] * static_cast<float>(factor));
  }
}

/// Updates each column's best |grad I * n| among pixels above the threshold.
void PixelSelector::score_row(const ImageF& image, int level, int y, int first_x, int last_x) {
  if (masked_) {
    const std::uint8_t* allowed = allowed_.row(y << level);
    float* row = allowed_row_.data();
    if (level == 0) {  // most of the work, and apart it is done in lanes
      for (int x = first_x; x < last_x; ++x) row[x] = allowed[x] != 0 ? 1.0F : 0.0F;
    } else {
      for (int x = first_x; x < last_x; ++x) row[x] = allowed[x << level] != 0 ? 1.0F : 0.0F;
    }
  }
  prefetch_row(image, y + kRowsAhead);
  const ScoreInput in = {.row = image.row(y),
                         .above = image.row(y - 1),
                         .below = image.row(y + 1),
                         .nx = direction_x_.data(),
                         .ny = direction_y_.data(),
                         .threshold = threshold_row_.data(),
                         .allowed = allowed_row_.data()};
  run_kernel<ScoreRow>(in, y, first_x, last_x, best_score_.data(), best_y_.data());
}

/// Among the level-0 pixels that pixel (x, y) of `level` covers, the one of the largest gradient
/// that border and mask allow.
bool PixelSelector::finest_pixel(const ImageF& image, int level, int x, int y,
                                 SelectedPixel* pixel) const {
  const int border = std::max(1, config_.border);
  const int side = 1 << level;
  bool found = false;
  for (int py = y * side; py < (y + 1) * side; ++py) {
    for (int px = x * side; px < (x + 1) * side; ++px) {
      if (px < border || py < border || px >= image.width() - border ||
          py >= image.height() - border || (masked_ && allowed_.at(px, py) == 0)) {
        continue;
      }
      const float g2 = squared_gradient(image, px, py);
      if (found && g2 <= pixel->gradient_squared) continue;
      *pixel = {static_cast<std::int16_t>(px), static_cast<std::int16_t>(py),
                static_cast<std::uint8_t>(side), g2, static_cast<float>(threshold_share_)};
      found = true;
    }
  }
  return found;
}

/// Keeps `wanted` pixels, every subset of them equally likely (Knuth, TAOCP 2, algorithm S).
void PixelSelector::thin(int wanted, std::vector<SelectedPixel>* pixels) {
  std::size_t kept = 0;
  std::uint64_t needed = static_cast<std::uint64_t>(wanted);
  std::uint64_t left = pixels->size();
  for (const SelectedPixel& pixel : *pixels) {
    if ((static_cast<std::uint64_t>(random()) * left) >> 32 < needed) {
      (*pixels)[kept++] = pixel;
      --needed;
    }
    --left;
  }
  pixels->resize(kept);
}

}  // namespace sovo
