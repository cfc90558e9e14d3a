#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sovo/image/image.h"
#include "sovo/image/photometric.h"
#include "sovo/io/result.h"

namespace sovo {

/// DSO's pcalib.txt: 256 increasing values, the inverse response; scaled so that the last is 255.
Result<std::vector<float>> read_response(const std::string& path);

/// DSO's vignette image (8 or 16 bit), scaled so that the brightest pixel is 1. Pixels that get no
/// light at all (value 0) become 1 in the vignette, so that it can be divided by, and 0 in `mask`
/// (made when it is empty). The size must be the camera's.
Result<ImageF> read_vignette(const std::string& path, int width, int height, ImageU8* mask);

/// A mask image of the camera's size: 0 where the image must not be used.
Result<ImageU8> read_mask(const std::string& path, int width, int height);

/// One line of DSO's times.txt.
struct ExposureTime {
  std::string id;  ///< Name of the image without its suffix.
  std::int64_t stamp_ns = 0;
  double exposure_s = 0.0;  ///< 0 when the file has none.
};

/// DSO's times.txt: id, stamp [s], exposure [ms] (which may be missing).
Result<std::vector<ExposureTime>> read_exposure_times(const std::string& path);

}  // namespace sovo
