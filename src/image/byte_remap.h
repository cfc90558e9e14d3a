#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sovo/geometry/types.h"
#include "sovo/image/image.h"

namespace sovo {

/// Bilinear resampling of an image of bytes, straight to floats. Eight neighbours of the result
/// mostly come from a few short rows of the raw image, so these are read as a whole and sorted in
/// registers, instead of eight pixels being looked up one by one in an image of floats.
class ByteRemap {
 public:
  /// A table for images of `width` x `height` from raw ones of `raw_width` x `raw_height`, of where
  /// each pixel comes from, row by row, as `raw.contains` says ((-1, -1): from nowhere, becomes
  /// 0). Positions are kept to 1/256 px. None when some eight neighbours come from rows that are
  /// longer than `kWindow`, as where the image shrinks to half its size, or images are smaller.
  static std::optional<ByteRemap> make(int width, int height, int raw_width, int raw_height,
                                       std::span<const Vec2> sources);

  /// `step` is the distance between raw rows [bytes].
  void apply(const std::uint8_t* raw, std::ptrdiff_t step, ImageF* out) const;

  static constexpr int kWindow = 16;  ///< Raw pixels of a row that are read for a block.
  static constexpr int kBlock = 8;    ///< Neighbours in the result.

  /// Of neighbours in the result: the upper left pixel of what they are made of in the raw image,
  /// how many rows, whether all come from somewhere and these rows are few, and where each lies
  /// within [1/256 px].
  struct Block {
    std::uint16_t left = 0, top = 0;
    std::uint8_t rows = 0;
    bool usual = false;
    std::array<std::uint16_t, kBlock> x = {}, y = {};
  };

 private:
  int width_ = 0;
  int height_ = 0;
  std::vector<Block> blocks_;  ///< Row by row; the last of a row ends with it.
};

}  // namespace sovo
