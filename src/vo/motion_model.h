#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "sovo/vo/monocular_backend.h"

namespace sovo {

double seconds_between(std::int64_t from_ns, std::int64_t to_ns);

/// Where the camera was in the last frame, and where the new one should find it
/// (T_camera_reference).
struct KnownMotion {
  SE3 expected;
  SE3 last;
  SE3 step;            ///< From the frame before the last one to that: T_last_before.
  double steps = 1.0;  ///< Time since then over that between the two frames before.
  /// How far from there it may be, at the greatest acceleration and with what stamps and poses err
  /// by [the map's unit of length]; infinite: not known.
  double reach = std::numeric_limits<double>::infinity();
  /// Standard deviation of where it is by what vehicles do [the map's unit of length]; 0: unknown.
  double sigma = 0.0;

  /// Where the step before leads in `steps` times its time.
  SE3 after(double steps_since) const;
};

/// Whether a camera that was on its way can be where it was found.
bool is_reachable(const KnownMotion& known, const SE3& T_current_reference);

/// Whether a camera can have moved so from the reference, or from where it is expected: from a mean
/// depth away hardly any point looks the same. `mean_rho`: of the reference's points, in one over
/// the unit of `motion`; `farthest`: how many mean depths it may be.
bool is_near(const SE3& motion, double mean_rho, double farthest = 1.0);

/// Whether two motions differ by a pixel or so; `mean_rho` as above.
bool is_nearly(const SE3& a, const SE3& b, double mean_rho);

/// How far a camera was found from where it was expected, in `KnownMotion::sigma`; 0: unknown.
double deviation(const KnownMotion& known, const SE3& T_current_reference);

/// Where the camera was expected, but turned as it was found (T_current_reference).
SE3 expected_place(const KnownMotion& known, const SE3& found);

/// How little image and motion together speak for a pose: minus twice its log-likelihood, but for
/// what is the same of all poses of a frame. `information`: pixels over the variance of their
/// noise [1/grey level^2].
double improbability(const KnownMotion& known, const FrameTracking& pose, double information);

/// The same motion in `factor` times its time.
SE3 scaled_motion(const SE3& motion, double factor);

/// Constant velocity over the true time between frames, some of which may be missing.
class MotionModel {
 public:
  void clear() { past_.clear(); }

  /// Notes where a frame was found; noted again, the same frame was found there instead.
  void note(const ReferenceKeyframe& reference, const SE3& T_camera_reference,
            std::int64_t stamp_ns);

  /// The last frame's T_camera_reference, the identity when there was none.
  struct Forecast {
    SE3 last;
    std::optional<KnownMotion> known;  ///< When two frames before are, a map's first among them.
  };

  /// Of a frame at `stamp_ns`. `max_acceleration`: what `KnownMotion::reach` follows from [the
  /// map's unit of length / s^2]; 0: unknown.
  Forecast forecast(const ReferenceKeyframe& reference, std::int64_t stamp_ns,
                    double max_acceleration) const;

  /// Of the last frame.
  std::optional<std::int64_t> last_stamp_ns() const;

 private:
  struct PastFrame {
    SE3 T_camera_keyframe;
    double log_scale = 0.0;
    std::uint32_t keyframe_id = 0;
    std::int64_t stamp_ns = 0;
  };
  /// T_camera_reference of a past frame, in the reference's scale; nothing when what it hangs on
  /// has left the window.
  static std::optional<SE3> T_past_reference(const PastFrame& past,
                                             const ReferenceKeyframe& reference);
  double steps_to(std::int64_t stamp_ns) const;

  std::vector<PastFrame> past_;  ///< The last two frames, newest last.
};

}  // namespace sovo
