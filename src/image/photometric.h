#pragma once

#include <vector>

#include "sovo/image/image.h"
#include "sovo/image/stereo_frame.h"

namespace sovo {

/// Photometric calibration of one camera: I(x) = G(t V(x) B(x)) with response G, vignette V,
/// exposure t and irradiance B (Engel, Usenko, Cremers, "A photometrically calibrated benchmark
/// for monocular visual odometry").
struct PhotometricCalibration {
  /// G^-1: grey level to irradiance, scaled so that level 255 gives 255; identity when empty.
  std::vector<float> inverse_response;
  /// V in (0, 1], of the size of the raw image; 1 everywhere when empty.
  ImageF vignette;
  bool empty() const { return inverse_response.empty() && vignette.empty(); }
};

/// Raw pixels to float grey levels in [0, 255] (16-bit images are divided by 257), response and
/// vignette undone, then reduced by the whole number `downscale` (mean of blocks). Where the
/// vignette is dark, values may exceed 255. Pixels at full scale are divided by the vignette like
/// their neighbours: left at 255 they would draw an edge around every overexposed region.
/// Precondition: side.valid and the sizes fit.
void to_float(const SideImage& side, const PhotometricCalibration& calibration, int downscale,
              ImageF* out);

}  // namespace sovo
