#pragma once

#include <deque>
#include <mutex>
#include <optional>
#include <span>

#include "sovo/geometry/lens_change.h"
#include "sovo/geometry/types.h"

namespace sovo {

/// What a window shows of its lens, to first order: the energy of its residuals, in units of their
/// noise, is c^T H c + 2 b^T c in c = (focal, radial), poses, brightnesses and depths being the
/// best for each c.
struct LensEvidence {
  Mat2 H = Mat2::Zero();
  Vec2 b = Vec2::Zero();
  /// Angle between the optical axes of the keyframes of a residual: root of the mean square [rad].
  double turn = 0.0;
  double way = 0.0;  ///< Distance between those keyframes, likewise [mean depths].

  void weigh(double factor) {
    H *= factor;
    b *= factor;
  }
};

/// Turns tell a focal length. Where cameras turn less than this between keyframes [rad], those of a
/// right lens see one that is up to 2 % shorter, one after the other.
inline constexpr double kLeastLensTurn = 0.14;
/// And less than this on the way of a mean depth [rad] is a bend of the road that they are driven
/// along; in the turns of streets and flights it is 0.2 to 2, on bends of highways 0.05.
inline constexpr double kLeastLensTurnOnWay = 0.1;

/// A lens as keyframes agree about it, and how sure that is.
struct LensFit {
  LensChange change, sigma;
};

/// Least squares over `keyframes`, in the order in which they were made. What neighbouring
/// keyframes show is much the same, and errs alike: the standard deviations come from leaving out
/// one tenth of them after the other (jackknife). Keyframes between which the cameras hardly turn
/// do not count; nothing of fewer than ten that do.
std::optional<LensFit> fit_lens(std::span<const LensEvidence> keyframes);

/// Tells while the vehicle moves whether the focal length is not the one that was calibrated.
class LensWatch {
 public:
  /// Takes what a keyframe tells.
  void note(const LensEvidence& keyframe);

  /// How much longer than calibrated keyframes saw the focal length when that was clear last, as a
  /// logarithm; they see a part of it. 0 while it never was. Any thread may ask.
  double focal_error() const;

 private:
  std::deque<LensEvidence> keyframes_;  ///< The newest that turned enough.
  mutable std::mutex mutex_;            ///< Of the result.
  double focal_error_ = 0.0;
};

}  // namespace sovo
