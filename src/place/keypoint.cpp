#include "sovo/place/keypoint.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "sovo/image/corners.h"

namespace sovo {
namespace {

constexpr int kLevels = 3;
constexpr std::array<double, kLevels> kLevelShare{0.5, 0.3, 0.2};
constexpr int kDiscRadius = 15;     ///< Of the pixels that tell a keypoint's direction [px].
constexpr int kCompareRadius = 13;  ///< Of those that a descriptor compares.
constexpr int kBorder = kDiscRadius + 2;

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
        spread_corners(response, {.mask = mask,
                                  .level = l,
                                  .border = kBorder,
                                  .wanted = wanted,
                                  .least = static_cast<float>(config.min_corner)});
    if (corners.empty()) continue;
    const ImageF smooth = smoothed(image);
    for (const Corner& corner : corners) {
      keypoints.push_back(keypoint_of(response, smooth, corner, l));
    }
  }
  return keypoints;
}

}  // namespace sovo
