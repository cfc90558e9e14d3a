#pragma once

#include <mutex>
#include <vector>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/types.h"
#include "sovo/vo/point_sights.h"

namespace sovo {

struct MovingLightConfig {
  int keyframes = 4;               ///< That must have told, before lamps are believed.
  double most_left = 0.75;         ///< Of the scatter of brightness, once lamps explain it.
  double least_scatter = 0.02;     ///< Of the logarithm of brightness: less is worth no lamps.
  double strong_scatter = 0.08;    ///< Daylight hardly makes that much:
  double most_left_strong = 0.82;  ///< then lamps need not explain as much of it.

  template <class Visitor>
  void visit(Visitor& v) {
    v("keyframes", keyframes, "that must have told, before lamps are believed");
    v("most_left", most_left, "share of the scatter of brightness that lamps leave unexplained");
    v("least_scatter", least_scatter, "of the logarithm of brightness, that is worth looking into");
    v("strong_scatter", strong_scatter,
      "of the logarithm of brightness, that daylight hardly makes");
    v("most_left_strong", most_left_strong, "most_left where there is more than that");
  }
};

/// How the brightness of a point has changed from one keyframe to another.
struct LightSight {
  Vec6 terms = Vec6::Zero();  ///< Of the light at its places (MovingLight), target less host.
  double log_ratio = 0.0;     ///< Of the grey levels of its pattern, target to host.
};

/// Tells whether the lamps that light the scene move along with the cameras, as those of a diver
/// do: what comes nearer or into the middle of the beam is brighter then, in the same way in all
/// keyframes.
///
/// The light is modelled as exp(a log(1/z) + a quadratic of the place in the image), and fitted to
/// how the logarithm of points' brightness changes between keyframes. What was fitted to the
/// keyframes before is tried on what the newest one shows: by daylight it explains hardly anything
/// there, by lamps a quarter of the scatter and more; less is enough where brightness scatters more
/// than daylight makes it. Lamps light what is near, or in the middle.
class MovingLight {
 public:
  explicit MovingLight(const MovingLightConfig& config) : config_(config) {}

  /// Takes what is `seen` from the newest keyframe, after its bundle adjustment. `camera`: the one
  /// that sees it.
  void observe(const CameraModel& camera, const PointSights& seen);

  /// Takes the sights of the pairs of one keyframe.
  void observe(const std::vector<std::vector<LightSight>>& pairs);

  /// Whether the lamps move along. Any thread may ask.
  bool found() const;

 private:
  using Pairs = std::vector<std::vector<LightSight>>;
  void judge(const Pairs& pairs);
  void learn(const Pairs& pairs);
  /// Fills left_ with what `light` leaves of the logarithms of the pairs that have enough.
  void find_left(const Vec6& light, const Pairs& pairs);
  double scatter();  ///< Standard deviation of what is left, robustly.

  MovingLightConfig config_;
  // Least squares in the terms c of the light: H c = g.
  Mat6 H_ = Mat6::Zero();
  Vec6 g_ = Vec6::Zero();
  Vec6 light_ = Vec6::Zero();
  int learned_ = 0;           ///< Keyframes.
  double judged_ = 0.0;       ///< Keyframes, older ones less.
  double log_left_ = 0.0;     ///< Sum over those: of the share of the scatter that is left.
  double log_scatter_ = 0.0;  ///< The same of the scatter.

  Pairs pairs_;
  std::vector<double> left_;  ///< Absolute, about the median of each pair.
  std::vector<double> of_pair_, scratch_;

  mutable std::mutex mutex_;
  bool found_ = false;
};

}  // namespace sovo
