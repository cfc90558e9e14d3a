#pragma once

#include <cstdint>

#include "sovo/odometry/exposure_motion.h"
#include "sovo/odometry/frame_preparation.h"
#include "sovo/vo/monocular_backend.h"

namespace sovo {

/// How the left camera moves while a rolling shutter reads its images out, as MonoFrame::rate has
/// it. Without a rolling shutter it never moves.
class ReadoutMotion {
 public:
  explicit ReadoutMotion(const FramePreparation& preparation) : preparation_(preparation) {}

  /// Notes the frame that a map begins with, and every frame that was tracked; tracked again, it
  /// takes the place of what was noted of it before.
  void begin(const ReferenceKeyframe& reference);
  void note(const TrackedFrame& tracked);

  /// As the frames before tell of a new one.
  Vec6 expected(std::int64_t stamp_ns) const;

  /// As it was in the frame that was tracked last, as that and the frames before tell.
  Vec6 found() const { return motion_.rate_after(0.0); }

  /// Whether the image was prepared for another motion than that.
  bool differs(const Vec6& found, const TrackedFrame& tracked) const;

  /// Whether the camera turned about as was expected: else it was knocked.
  bool is_steady(const Vec6& expected) const;

 private:
  const FramePreparation& preparation_;
  ExposureMotion motion_;
  std::int64_t last_stamp_ns_ = 0;
};

}  // namespace sovo
