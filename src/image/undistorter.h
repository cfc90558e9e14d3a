#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/types.h"
#include "sovo/image/byte_remap.h"
#include "sovo/image/image.h"

namespace sovo {

struct UndistortionConfig {
  double max_fov_deg = 100.0;  ///< Horizontal and vertical field of view of the result, at most.

  template <class Visitor>
  void visit(Visitor& v) {
    v("max_fov_deg", max_fov_deg, "field of view of the undistorted left image, at most [deg]");
  }
};

/// The pinhole camera without distortion, straightened where there is a port, with square pixels
/// (fx = fy), that keeps as much as it can of `raw`'s view while every pixel of the result sees a
/// pixel of the raw image (up to one pixel at the edge), the same image size, and no more than the
/// configured field of view. A camera without distortion is returned as it is.
CameraModel optimal_pinhole(const CameraModel& raw, const UndistortionConfig& config);

/// Resamples images of `raw` as `pinhole` would see them. The table is made once.
class Undistorter {
 public:
  Undistorter(const CameraModel& raw, const CameraModel& pinhole);

  /// Bilinear resampling; pixels without a source become 0 and are left out by `valid_mask`.
  void apply(const ImageF& raw, ImageF* out) const;

  /// The same from bytes, to 1/256 px and in half the time, which not all cameras allow.
  bool takes_bytes() const { return from_bytes_.has_value(); }
  /// `step` is the distance between rows [bytes]. Precondition: `takes_bytes`.
  void apply(const std::uint8_t* raw, std::ptrdiff_t step, ImageF* out) const {
    from_bytes_->apply(raw, step, out);
  }

  /// 255 where the result has a source in the raw image at least one pixel from its edge and
  /// `raw_mask` (may be empty: all allowed) is not zero there; 0 elsewhere.
  ImageU8 valid_mask(const ImageU8& raw_mask) const;

  bool is_identity() const { return identity_; }

  /// Where pixel (x, y) of the result comes from in the raw image; (-1, -1) where from nowhere.
  Vec2 source(int x, int y) const;

 private:
  int width_ = 0;
  int height_ = 0;
  int raw_width_ = 0;
  int raw_height_ = 0;
  bool identity_ = false;
  /// Bilinear interpolation from the raw pixels offset, offset + 1 and the two below them; the
  /// offset is negative where there is no source.
  AlignedVector<std::int32_t> offset_;
  AlignedVector<float> fx_, fy_;  ///< Position between them.
  std::optional<ByteRemap> from_bytes_;
};

}  // namespace sovo
