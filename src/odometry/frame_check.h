#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "sovo/image/stereo_frame.h"
#include "sovo/odometry/frame_preparation.h"
#include "sovo/odometry/odometry_output.h"

namespace sovo {

/// Whether a side brings its last image once more, as drivers and bridges do that have no new one
/// in time. No two exposures are alike to the bit, for each has noise of its own; but those that
/// are white all over are, and repeat nothing.
class RepeatedImage {
 public:
  /// Precondition: `FramePreparation::check_side` found nothing.
  void note(const SideImage& side, std::int64_t stamp_ns);

  bool repeats() const { return repeats_; }

  /// For how long there has been no other image than the one noted last [s].
  double since_s() const { return since_s_; }

 private:
  std::optional<std::uint64_t> digest_;
  std::int64_t first_ns_ = 0;  ///< When this image came first.
  bool repeats_ = false;
  double since_s_ = 0.0;
};

/// Finds frames that cannot be tracked.
class FrameCheck {
 public:
  /// A camera whose image stays the same for as long may be frozen [s].
  static constexpr double kFrozen = 1.0;

  explicit FrameCheck(const FramePreparation& preparation) : preparation_(preparation) {}

  /// Why the frame cannot be tracked, and what is wrong with its stamp or its left image; empty
  /// when nothing is. An image that comes once more would have a camera stand, and leap afterwards;
  /// but one without noise, a simulated one, may have come to rest: what stays for
  /// `believed_after_s` is believed [s].
  std::string refuse(const StereoFrame& frame, const std::function<double()>& believed_after_s);

  /// What is wrong with the right image of a frame that was not refused; empty when nothing is.
  std::string right_problem(const StereoFrame& frame);

  /// A frame that has a pose is DEGRADED when its left image has long been the same to the bit.
  void doubt(OdometryOutput* out) const;

  /// What goes wrong, and that it is the exposure's fault, if it is.
  static std::string with_exposure(const std::string& reason, const StereoFrame& frame);

 private:
  const FramePreparation& preparation_;
  std::optional<std::int64_t> last_stamp_ns_;
  RepeatedImage left_, right_;
};

}  // namespace sovo
