#pragma once

#include <vector>

#include "sovo/vo/direct_config.h"
#include "sovo/vo/image_cells.h"
#include "sovo/vo/tracking_reference.h"

namespace sovo {

/// How an image bears out a motion, in shares of a reference's points.
struct MotionEvidence {
  double moved = 0.0;     ///< Agree better where the motion takes them,
  double in_place = 0.0;  ///< or where they were, as others beside them do.
  double expected = 0.0;  ///< Are in view, and taken so far that it matters.

  /// As much stays as hardly ever does when a motion is right, but for what moves along.
  bool is_doubtful() const { return in_place > 0.05; }
  /// It explains the image hardly better than a camera at rest would. Of right motions two thirds
  /// of what is expected has moved, on open highways a third in the worst frames.
  bool is_missing() const { return expected > 0.5 && moved < 0.25 * expected; }
};

/// Share of the points with texture that an image shows within `stays_below` pixels of where a
/// motion takes them, by their residuals over its gradients there; every fourth point is asked.
/// `transfer`: of brightness, reference to image.
double agreeing_share(const CoMovingConfig& config, const TrackingReference& reference,
                      const ImageF& image, const SE3& T_current_reference,
                      const BrightnessTransfer& transfer);

/// Tells a motion that is none of the world's. One between those of two things that an image shows
/// in parts alike, the vehicle itself and what it moves past, fits both somewhat, and in haze a
/// wrong one fits nearly everywhere: few residuals are large. But points agree no better than in
/// their places.
class MotionCheck {
 public:
  MotionCheck(const CoMovingConfig& config, int width, int height);

  /// Points are compared in squares, of those that the motion takes `min_displacement` away or
  /// more. `transfer`: of brightness, reference to image.
  MotionEvidence of(const TrackingReference& reference, const ImageF& image,
                    const SE3& T_current_reference, const BrightnessTransfer& transfer);
  /// Squares that agreed much better where they were than where the last motion took them.
  const ChosenCells& staying() const { return staying_; }

 private:
  struct Sums {
    float in_place = 0.0F, moved = 0.0F;  ///< Absolute residuals [grey levels].
    int points = 0;
  };
  /// Whether points of a square agree much better by the first of two sums of absolute residuals.
  bool agree(const Sums& sums, float residuals, float others) const;

  CoMovingConfig config_;
  ImageCells cells_;
  std::vector<Sums> sums_;
  ChosenCells staying_;
};

}  // namespace sovo
