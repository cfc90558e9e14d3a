#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sovo/image/pyramid.h"

namespace sovo {

/// 256 comparisons of grey levels around a keypoint, turned with it (Rublee et al., "ORB", 2011).
struct BinaryDescriptor {
  std::array<std::uint64_t, 4> bits{};
};

/// Ones in each byte of a word. std::popcount is a call where the compiler may not suppose that the
/// processor has the instruction.
constexpr std::uint64_t ones_by_byte(std::uint64_t x) {
  x -= (x >> 1U) & 0x5555555555555555U;
  x = (x & 0x3333333333333333U) + ((x >> 2U) & 0x3333333333333333U);
  return (x + (x >> 4U)) & 0x0f0f0f0f0f0f0f0fU;
}

/// Sum of the bytes of a word, at most 255.
constexpr int sum_of_bytes(std::uint64_t x) {
  return static_cast<int>((x * 0x0101010101010101U) >> 56U);
}

/// In how many comparisons two descriptors differ, of 256 (255 where all do).
constexpr int hamming(const BinaryDescriptor& a, const BinaryDescriptor& b) {
  std::uint64_t ones = 0;
  for (std::size_t i = 0; i < a.bits.size(); ++i) ones += ones_by_byte(a.bits[i] ^ b.bits[i]);
  // 256 does not fit into a byte.
  return sum_of_bytes(ones) == 0 && ones != 0 ? 255 : sum_of_bytes(ones);
}

/// A corner that can be found again in another view.
struct Keypoint {
  float u = 0.0F, v = 0.0F;  ///< In level 0, sub-pixel [px].
  std::uint8_t level = 0;    ///< Of the pyramid, where it was found.
  BinaryDescriptor descriptor;
};

struct KeypointConfig {
  int per_image = 500;       ///< Keypoints an image, at most.
  double min_corner = 10.0;  ///< Least mean squared gradient in any direction [(grey levels/px)^2].

  template <class Visitor>
  void visit(Visitor& v) {
    v("per_image", per_image, "keypoints an image, at most");
    v("min_corner", min_corner, "least squared gradient in any direction [(grey levels / px)^2]");
  }
};

/// Corners (Shi, Tomasi 1994) of the three finest levels, spread over the image, with descriptors.
/// `mask`: 0 where nothing is looked for, at level 0; may be empty. The order depends on nothing
/// but the image.
std::vector<Keypoint> detect_keypoints(const ImagePyramid& pyramid, const ImageU8& mask,
                                       const KeypointConfig& config);

}  // namespace sovo
