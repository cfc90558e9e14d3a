#include "sovo/place/keypoint.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "support/synthetic_scene.h"

namespace sovo {
namespace {

constexpr int kSize = 240;

/// A texture seen by a camera that looks at it squarely, turned by `angle` about the image's centre
/// [rad] and `zoom` times as large.
ImagePyramid texture_view(double angle, double zoom = 1.0) {
  std::mt19937 random(5);
  const test::ProceduralTexture texture(random, 6.0, 80.0);
  ImageF image(kSize, kSize);
  const double centre = 0.5 * (kSize - 1);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const double dx = (x - centre) / zoom;
      const double dy = (y - centre) / zoom;
      image.at(x, y) = static_cast<float>(texture(std::cos(angle) * dx + std::sin(angle) * dy,
                                                  std::cos(angle) * dy - std::sin(angle) * dx));
    }
  }
  test::add_noise(1.0, 7, &image);
  return {std::move(image), 4};
}

/// Of the keypoints of the view as it is, those in the middle that are seen in the turned view,
/// too, and of these those whose nearest descriptor there is theirs.
struct Recognized {
  int all = 0, again = 0, right = 0;
};

Recognized recognized(double angle, double zoom = 1.0) {
  const auto upright = detect_keypoints(texture_view(0.0), {}, {});
  const auto turned = detect_keypoints(texture_view(angle, zoom), {}, {});
  const double centre = 0.5 * (kSize - 1);
  Recognized sum;
  for (const Keypoint& k : upright) {
    const double dx = zoom * (k.u - centre);
    const double dy = zoom * (k.v - centre);
    const double u = centre + std::cos(angle) * dx - std::sin(angle) * dy;
    const double v = centre + std::sin(angle) * dx + std::cos(angle) * dy;
    if (std::hypot(dx, dy) > 0.38 * kSize) continue;
    const auto is_there = [&](const Keypoint& other) {
      return std::hypot(other.u - u, other.v - v) < 3.0 * (1 << k.level);
    };
    ++sum.all;
    if (std::none_of(turned.begin(), turned.end(), is_there)) continue;
    ++sum.again;
    const auto bits = [&](const Keypoint& other) {
      return hamming(k.descriptor, other.descriptor);
    };
    const auto best =
        std::min_element(turned.begin(), turned.end(),
                         [&](const auto& one, const auto& two) { return bits(one) < bits(two); });
    sum.right += is_there(*best) ? 1 : 0;
  }
  return sum;
}

TEST(Keypoint, IsRecognizedHoweverTheCameraIsTurned) {
  for (const double degrees : {0.0, 20.0, 45.0, 90.0, 137.0, 180.0}) {
    const Recognized r = recognized(degrees * M_PI / 180.0);
    EXPECT_GT(r.again, 100) << degrees;
    EXPECT_GT(r.again, 0.7 * r.all) << degrees;
    // Quarter turns bring pixels onto pixels; other ones blur what is compared.
    EXPECT_GT(r.right, (std::fmod(degrees, 90.0) == 0.0 ? 0.8 : 0.6) * r.again) << degrees;
  }
}

TEST(Keypoint, IsRecognizedFromTwiceAsNear) {
  const Recognized r = recognized(0.3, 2.0);
  EXPECT_GT(r.again, 20);
  EXPECT_GT(r.right, 0.5 * r.again);
}

TEST(Keypoint, HammingCountsTheBitsThatDiffer) {
  std::mt19937 random(1);
  const BinaryDescriptor zero;
  EXPECT_EQ(hamming(zero, zero), 0);
  for (int trial = 0; trial < 100; ++trial) {
    BinaryDescriptor d;
    int ones = 0;
    for (auto& word : d.bits) {
      word = (static_cast<std::uint64_t>(random()) << 32U) | random();
      ones += std::popcount(word);
    }
    EXPECT_EQ(hamming(d, zero), ones);
  }
  BinaryDescriptor all;
  all.bits.fill(~std::uint64_t{0});
  EXPECT_EQ(hamming(all, zero), 255);
  all.bits[0] ^= 1U;
  EXPECT_EQ(hamming(all, zero), 255);
}

TEST(Keypoint, IsWhereTheCornerIsToAPartOfAPixel) {
  // A bright square on grey: its corners, smoothed as a lens does.
  ImageF image(120, 120);
  image.fill(60.0F);
  const auto edge = [](double x) { return 0.5 * (1.0 + std::tanh(x)); };
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 120; ++x) {
      const double inside = edge(x - 40.3) * edge(80.3 - x) * edge(y - 40.7) * edge(80.7 - y);
      image.at(x, y) += static_cast<float>(120.0 * inside);
    }
  }
  const auto keypoints = detect_keypoints(ImagePyramid(std::move(image), 1), {}, {});
  ASSERT_EQ(keypoints.size(), 4U);
  // Moments around a corner have their summit a little inside of it, alike at all four.
  double u = 0.0;
  double v = 0.0;
  for (const Keypoint& k : keypoints) {
    u += 0.25 * k.u;
    v += 0.25 * k.v;
  }
  EXPECT_NEAR(u, 60.3, 0.1);
  EXPECT_NEAR(v, 60.7, 0.1);
}

TEST(Keypoint, NoneWhereNothingIsToBeSeen) {
  ImageF flat(kSize, kSize);
  flat.fill(100.0F);
  test::add_noise(1.0, 3, &flat);
  EXPECT_TRUE(detect_keypoints(ImagePyramid(std::move(flat), 4), {}, {}).empty());
  EXPECT_TRUE(detect_keypoints(ImagePyramid(ImageF(20, 20), 1), {}, {}).empty());
}

TEST(Keypoint, NoneWhereTheMaskForbidsIt) {
  ImageU8 mask(kSize, kSize);
  for (int y = 0; y < kSize; ++y) {
    for (int x = kSize / 2; x < kSize; ++x) mask.at(x, y) = 255;
  }
  const auto keypoints = detect_keypoints(texture_view(0.0), mask, {});
  EXPECT_GT(keypoints.size(), 50U);
  for (const Keypoint& k : keypoints) EXPECT_GT(k.u, kSize / 2 - 4.0F);
}

TEST(Keypoint, AreAsManyAsAskedForAndSpread) {
  KeypointConfig config;
  config.per_image = 100;
  const auto keypoints = detect_keypoints(texture_view(0.0), {}, config);
  EXPECT_LE(keypoints.size(), 100U);
  EXPECT_GT(keypoints.size(), 60U);
  std::array<int, 4> quarters{};
  for (const Keypoint& k : keypoints) {
    ++quarters[(k.u > kSize / 2 ? 1U : 0U) + (k.v > kSize / 2 ? 2U : 0U)];
  }
  for (const int n : quarters) EXPECT_GT(n, 10);
}

}  // namespace
}  // namespace sovo
