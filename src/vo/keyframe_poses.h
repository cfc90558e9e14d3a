#pragma once

#include <cstdint>
#include <vector>

#include "sovo/geometry/se3.h"

namespace sovo {

/// A keyframe's pose as the window knows it, or as it was when it left.
struct KeyframePose {
  std::uint32_t id = 0;
  std::int64_t stamp_ns = 0;
  SE3 T_world_camera;
  /// From the keyframe before it, in that one's axes, as when the two were last in the window
  /// together; similarities later than this keyframe's own are undone. Of the first one: where the
  /// map began.
  Vec3 step = Vec3::Zero();
  double later_scale = 1.0;  ///< Product of the similarities since this keyframe was the newest.
  double log_scale = 0.0;    ///< Sum of all similarities applied up to its own.
};

/// A keyframe as it stands in the window.
struct WindowPose {
  std::uint32_t id = 0;
  std::int64_t stamp_ns = 0;
  SE3 T_world_camera;
};

/// Keeps the poses of all keyframes of a map while the window moves over them. Every method takes
/// the window's keyframes as they are now, oldest first, none missing but those that left.
class KeyframePoses {
 public:
  /// Of all keyframes of the map, by id.
  const std::vector<KeyframePose>& poses() const { return poses_; }
  const KeyframePose& operator[](std::uint32_t id) const { return poses_[id]; }
  void clear() { poses_.clear(); }

  /// Takes the window's poses; before keyframes leave it and after it changed. `log_scale`: sum of
  /// all similarities so far.
  void record(const std::vector<WindowPose>& window, double log_scale);

  /// Takes a window that was rescaled by `scale`, as measured at its newest keyframe. `log_scale`:
  /// sum of all similarities, this one included.
  void rescale(const std::vector<WindowPose>& window, double scale, double log_scale);

  /// The same where the map had no scale before: what left the window is rescaled, too, about
  /// `centre`.
  void rescale_all(const std::vector<WindowPose>& window, double scale, const Vec3& centre,
                   double log_scale);

 private:
  std::vector<KeyframePose> poses_;
};

}  // namespace sovo
