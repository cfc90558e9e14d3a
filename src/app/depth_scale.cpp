#include "sovo/app/depth_scale.h"

#include <cmath>
#include <vector>

#include "sovo/eval/statistics.h"

namespace sovo::app {

std::optional<double> depth_log_scale(const KeyframeOutput& keyframe, const CameraModel& tracked,
                                      sim::SimSource* source) {
  constexpr std::size_t kFewest = 30;
  const CameraModel& raw = source->calibration().rig.left;
  std::vector<Vec2> places;
  std::vector<double> inverse_depths;
  for (std::size_t i = 0; i < keyframe.u.size(); ++i) {
    const auto ray = tracked.unproject(Vec2(keyframe.u[i], keyframe.v[i]));
    const auto place = ray ? raw.project(*ray) : std::nullopt;
    if (!place || !raw.contains(*place) || keyframe.inverse_depth[i] <= 0.0F) continue;
    places.push_back(*place);
    inverse_depths.push_back(keyframe.inverse_depth[i]);
  }
  const std::vector<float> depths = source->depth_at(keyframe.stamp_ns, places);
  std::vector<double> ratios;
  for (std::size_t i = 0; i < depths.size(); ++i) {
    if (depths[i] > 0.0F) ratios.push_back(std::log(depths[i] * inverse_depths[i]));
  }
  if (ratios.size() < kFewest) return std::nullopt;
  return quantile(ratios, 0.5);
}

}  // namespace sovo::app
