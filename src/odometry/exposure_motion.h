#pragma once

#include <cstdint>
#include <optional>

#include "sovo/geometry/se3.h"
#include "sovo/image/stereo_frame.h"
#include "sovo/vo/motion_model.h"

namespace sovo {

/// From the exposure of the left image to that of the right one [ns]; what stamps of cameras that
/// are triggered together err by is none.
std::int64_t exposure_offset_ns(const StereoFrame& frame);

/// How the left camera moves about the instant of a frame: as in the frames before, with the
/// acceleration that they show. It tells where the camera goes until the right one exposes, where
/// the two are not triggered together, and while a rolling shutter reads an image out.
class ExposureMotion {
 public:
  /// Notes where a frame was found; noted again, the same frame was found there instead.
  void note(const ReferenceKeyframe& reference, const SE3& T_camera_reference,
            std::int64_t stamp_ns);

  /// T_later_left: the camera at the newest frame into where it is `offset_ns` later, in the unit
  /// of that frame's map. The identity while no two frames are known.
  SE3 until(std::int64_t offset_ns) const;

  /// log(T_later_earlier) a second, (translation, rotation), as it is `seconds` after the newest
  /// frame, in the unit of that frame's map. Zero while no two frames are known.
  Vec6 rate_after(double seconds) const;

  /// Whether two frames are known.
  bool known() const { return newest_.has_value(); }

 private:
  /// Between two frames.
  struct Step {
    Vec6 rate;  ///< log(T_later_earlier) a second, (translation, rotation).
    double seconds = 0.0;
  };

  MotionModel frames_;
  double log_scale_ = 0.0;  ///< Of the map at the newest frame.
  std::optional<Step> newest_, before_;
};

}  // namespace sovo
