#include "sovo/loop/keypoint.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace sovo {
namespace {

constexpr int kLevels = 3;
constexpr std::array<double, kLevels> kLevelShare{0.5, 0.3, 0.2};
constexpr int kDiscRadius = 15;     ///< Of the pixels that tell a keypoint's direction [px].
constexpr int kCompareRadius = 13;  ///< Of those that a descriptor compares.
constexpr int kBorder = kDiscRadius + 2;
constexpr int kTensorRadius = 2;  ///< Of the square whose gradients make a corner.
constexpr int kTensorSide = 2 * kTensorRadius + 1;
constexpr int kPerCell = 2;  ///< Corners in a cell of the grid that spreads them.

struct Offset {
  float x, y;
};
struct Comparison {
  Offset a, b;
};

/// Pairs of a Gaussian with a fifth of the patch as standard deviation (Calonder et al., "BRIEF",
/// 2010), always the same.
std::array<Comparison, 256> make_comparisons() {
  std::mt19937 generator(20111);  // NOLINT(cert-msc51-cpp): descriptors must stay comparable
  const auto uniform = [&] { return static_cast<float>(generator() >> 8U) / 16777216.0F - 0.5F; };
  // Twelve uniform numbers have the variance of one normal number.
  const auto normal = [&] {
    float sum = 0.0F;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return sum;
  };
  const auto offset = [&] {
    constexpr float kSigma = 31.0F / 5.0F;
    for (;;) {
      const Offset o{kSigma * normal(), kSigma * normal()};
      if (std::hypot(o.x, o.y) <= static_cast<float>(kCompareRadius)) return o;
    }
  };
  std::array<Comparison, 256> comparisons{};
  for (Comparison& c : comparisons) c = {offset(), offset()};
  return comparisons;
}

struct Corner {
  float response = 0.0F;
  int x = 0, y = 0;
};

/// Products of an image's gradients, one image each.
struct GradientProducts {
  ImageF xx, xy, yy;
};

GradientProducts gradient_products(const ImageF& image) {
  const int w = image.width();
  const int h = image.height();
  GradientProducts out{ImageF(w, h), ImageF(w, h), ImageF(w, h)};
  for (int y = 1; y + 1 < h; ++y) {
    const float* above = image.row(y - 1);
    const float* row = image.row(y);
    const float* below = image.row(y + 1);
    for (int x = 1; x + 1 < w; ++x) {
      const float gx = 0.5F * (row[x + 1] - row[x - 1]);
      const float gy = 0.5F * (below[x] - above[x]);
      out.xx.at(x, y) = gx * gx;
      out.xy.at(x, y) = gx * gy;
      out.yy.at(x, y) = gy * gy;
    }
  }
  return out;
}

/// Sums over columns of kTensorSide pixels around row `y`.
void sum_columns(const ImageF& image, int y, std::vector<float>* sums) {
  sums->assign(static_cast<std::size_t>(image.width()), 0.0F);
  for (int k = -kTensorRadius; k <= kTensorRadius; ++k) {
    const float* row = image.row(y + k);
    for (std::size_t x = 0; x < sums->size(); ++x) (*sums)[x] += row[x];
  }
}

float sum_around(const std::vector<float>& columns, int x) {
  float sum = 0.0F;
  for (int k = -kTensorRadius; k <= kTensorRadius; ++k) {
    sum += columns[static_cast<std::size_t>(x + k)];
  }
  return sum;
}

/// Lesser eigenvalue of the gradients' second moments around every pixel, their mean over a square
/// of kTensorSide pixels.
ImageF corner_response(const ImageF& image) {
  const int w = image.width();
  const int h = image.height();
  constexpr int kReach = kTensorRadius + 1;
  const GradientProducts products = gradient_products(image);
  ImageF response(w, h);
  std::vector<float> xx;
  std::vector<float> xy;
  std::vector<float> yy;
  for (int y = kReach; y + kReach < h; ++y) {
    sum_columns(products.xx, y, &xx);
    sum_columns(products.xy, y, &xy);
    sum_columns(products.yy, y, &yy);
    for (int x = kReach; x + kReach < w; ++x) {
      const float a = sum_around(xx, x);
      const float b = sum_around(xy, x);
      const float c = sum_around(yy, x);
      const float half = 0.5F * (a - c);
      response.at(x, y) =
          (0.5F * (a + c) - std::sqrt(half * half + b * b)) / (kTensorSide * kTensorSide);
    }
  }
  return response;
}

bool is_maximum(const ImageF& response, int x, int y) {
  const float r = response.at(x, y);
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      // Of equal neighbours the first one is taken.
      const bool before = dy < 0 || (dy == 0 && dx < 0);
      const float other = response.at(x + dx, y + dy);
      if (other > r || (before && other == r)) return false;
    }
  }
  return true;
}

/// The best corners of each cell of a grid that has room for `wanted`.
std::vector<Corner> spread_corners(const ImageF& response, const ImageU8& mask, int level,
                                   int wanted, float least) {
  const int w = response.width();
  const int h = response.height();
  if (w <= 2 * kBorder || h <= 2 * kBorder || wanted <= 0) return {};
  const double area = static_cast<double>(w) * h;
  const int side = std::max(8, static_cast<int>(std::sqrt(area * kPerCell / wanted)));
  const int columns = (w + side - 1) / side;
  const int rows = (h + side - 1) / side;
  std::vector<std::array<Corner, kPerCell>> cells(static_cast<std::size_t>(columns) * rows);
  for (int y = kBorder; y < h - kBorder; ++y) {
    for (int x = kBorder; x < w - kBorder; ++x) {
      const float r = response.at(x, y);
      if (r < least || !is_maximum(response, x, y)) continue;
      if (!mask.empty() && mask.at(std::min(x << level, mask.width() - 1),
                                   std::min(y << level, mask.height() - 1)) == 0) {
        continue;
      }
      auto& cell = cells[static_cast<std::size_t>(y / side) * columns + x / side];
      Corner corner{r, x, y};
      for (Corner& kept : cell) {
        if (corner.response > kept.response) std::swap(corner, kept);
      }
    }
  }
  std::vector<Corner> corners;
  for (const auto& cell : cells) {
    std::copy_if(cell.begin(), cell.end(), std::back_inserter(corners),
                 [](const Corner& c) { return c.response > 0.0F; });
  }
  std::stable_sort(corners.begin(), corners.end(),
                   [](const Corner& a, const Corner& b) { return a.response > b.response; });
  if (corners.size() > static_cast<std::size_t>(wanted)) {
    corners.resize(static_cast<std::size_t>(wanted));
  }
  return corners;
}

/// Where a parabola through three values has its summit, from the middle one.
float summit(float before, float middle, float after) {
  const float curvature = before - 2.0F * middle + after;
  return curvature < 0.0F ? std::clamp(0.5F * (before - after) / curvature, -0.5F, 0.5F) : 0.0F;
}

/// Binomial smoothing: single noisy pixels are nothing to compare.
ImageF smoothed(const ImageF& image) {
  const int w = image.width();
  const int h = image.height();
  const auto blend = [](float a, float b, float c, float d, float e) {
    return 0.0625F * (a + e) + 0.25F * (b + d) + 0.375F * c;
  };
  ImageF rows(w, h);
  ImageF out(w, h);
  for (int y = 0; y < h; ++y) {
    const float* r = image.row(y);
    for (int x = 2; x + 2 < w; ++x) {
      rows.at(x, y) = blend(r[x - 2], r[x - 1], r[x], r[x + 1], r[x + 2]);
    }
  }
  for (int y = 2; y + 2 < h; ++y) {
    for (int x = 2; x + 2 < w; ++x) {
      out.at(x, y) = blend(rows.at(x, y - 2), rows.at(x, y - 1), rows.at(x, y), rows.at(x, y + 1),
                           rows.at(x, y + 2));
    }
  }
  return out;
}

/// Unit vector from the keypoint to the centroid of the grey levels around it.
Offset direction_of(const ImageF& image, int x, int y) {
  float mx = 0.0F;
  float my = 0.0F;
  for (int dy = -kDiscRadius; dy <= kDiscRadius; ++dy) {
    const float* row = image.row(y + dy) + x;
    for (int dx = -kDiscRadius; dx <= kDiscRadius; ++dx) {
      if (dx * dx + dy * dy > kDiscRadius * kDiscRadius) continue;
      mx += static_cast<float>(dx) * row[dx];
      my += static_cast<float>(dy) * row[dx];
    }
  }
  const float length = std::sqrt(mx * mx + my * my);
  return length > 0.0F ? Offset{mx / length, my / length} : Offset{1.0F, 0.0F};
}

BinaryDescriptor describe(const ImageF& image, int x, int y) {
  static const std::array<Comparison, 256> kComparisons = make_comparisons();
  const Offset axis = direction_of(image, x, y);
  const auto grey = [&](const Offset& o) {
    const float dx = axis.x * o.x - axis.y * o.y;
    const float dy = axis.y * o.x + axis.x * o.y;
    return image.at(x + static_cast<int>(std::lround(dx)), y + static_cast<int>(std::lround(dy)));
  };
  BinaryDescriptor descriptor;
  for (std::size_t i = 0; i < kComparisons.size(); ++i) {
    const bool less = grey(kComparisons[i].a) < grey(kComparisons[i].b);
    descriptor.bits[i / 64] |= static_cast<std::uint64_t>(less) << (i % 64);
  }
  return descriptor;
}

Keypoint keypoint_of(const ImageF& response, const ImageF& smooth, const Corner& corner,
                     int level) {
  const int x = corner.x;
  const int y = corner.y;
  const float r = response.at(x, y);
  const float dx = summit(response.at(x - 1, y), r, response.at(x + 1, y));
  const float dy = summit(response.at(x, y - 1), r, response.at(x, y + 1));
  const auto scale = static_cast<float>(1 << level);
  Keypoint keypoint;
  keypoint.u = (static_cast<float>(x) + dx + 0.5F) * scale - 0.5F;
  keypoint.v = (static_cast<float>(y) + dy + 0.5F) * scale - 0.5F;
  keypoint.level = static_cast<std::uint8_t>(level);
  keypoint.descriptor = describe(smooth, x, y);
  return keypoint;
}

}  // namespace

std::vector<Keypoint> detect_keypoints(const ImagePyramid& pyramid, const ImageU8& mask,
                                       const KeypointConfig& config) {
  std::vector<Keypoint> keypoints;
  for (int l = 0; l < std::min(kLevels, pyramid.num_levels()); ++l) {
    const ImageF& image = pyramid[l];
    const ImageF response = corner_response(image);
    const int wanted =
        static_cast<int>(config.per_image * kLevelShare[static_cast<std::size_t>(l)]);
    const std::vector<Corner> corners =
        spread_corners(response, mask, l, wanted, static_cast<float>(config.min_corner));
    if (corners.empty()) continue;
    const ImageF smooth = smoothed(image);
    for (const Corner& corner : corners) {
      keypoints.push_back(keypoint_of(response, smooth, corner, l));
    }
  }
  return keypoints;
}

}  // namespace sovo
