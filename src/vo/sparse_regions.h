#pragma once

#include <span>

#include "sovo/image/image.h"
#include "sovo/vo/pixel_selector.h"

namespace sovo {

/// Where in an image hardly any of the pixels lie that were selected from it.
struct SparseRegions {
  /// 255 there, 0 elsewhere, where no pixel may be selected, and in the pixels themselves.
  ImageU8 mask;
  double share = 0.0;  ///< Of the part of the image from which pixels may be selected.
};

/// Squares of 32 px with less than half as many pixels as they would have if all were spread evenly
/// over what may be selected. `allowed`: of the image's size, 0 where no pixel may be selected;
/// when empty they may be everywhere.
SparseRegions sparse_regions(std::span<const SelectedPixel> pixels, const ImageU8& allowed,
                             int width, int height);

}  // namespace sovo
