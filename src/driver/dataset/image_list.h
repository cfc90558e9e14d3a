#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sovo/io/result.h"

namespace sovo {

/// One recorded image.
struct ImageRef {
  std::int64_t stamp_ns = 0;
  std::filesystem::path path;
  float exposure_s = 0.0F;  ///< 0 when unknown.
};

using ImageList = std::vector<ImageRef>;

/// A recorded stereo pair.
struct PairRef {
  ImageRef left;
  ImageRef right;
};

/// The pairs of a dataset and what was left out of them.
struct PairList {
  std::vector<PairRef> pairs;
  std::size_t unpaired = 0;  ///< Images of either side without a partner.
  std::size_t absent = 0;    ///< Pairs listed before the first or after the last that is there.
};

/// Files of a folder that are named as images (png, pgm, ppm, jpg, jpeg), in the order of the
/// number in their names, then of the names.
Result<std::vector<std::filesystem::path>> list_images(const std::filesystem::path& folder);

/// The number an image's name ends in ("000012.png" 12, "frame_7.jpg" 7); nothing without one.
std::optional<std::int64_t> number_in_name(const std::filesystem::path& path);

/// Pairs images whose stamps are each other's nearest and at most half a period (of the left side)
/// apart. Both lists must ascend.
PairList pair_by_stamp(const ImageList& left, const ImageList& right);

/// Pairs the images of two folders by their numbers; every number from the first to the last of
/// either side becomes a pair, so that a gap shows as missing files. Stamps are left at zero.
Result<PairList> pair_by_number(const std::filesystem::path& left,
                                const std::filesystem::path& right);

/// Takes away pairs without files at both ends of the list (recordings are often shortened without
/// their index) and counts them in `absent`.
void trim_absent(PairList* list);

}  // namespace sovo
