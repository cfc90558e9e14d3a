#include "sovo/vo/keyframe_slopes.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "sovo/vo/depth_sigma.h"
#include "sovo/vo/surface_slope.h"

namespace sovo {

namespace {

/// What the newest keyframe sees of the window's points.
std::vector<SurfaceSample> seen_depths(const Window& window) {
  const double rho_unit = window.mean_inverse_depth();
  const auto slot = static_cast<std::size_t>(window.newest().slot);
  std::vector<SurfaceSample> seen;
  seen.reserve(static_cast<std::size_t>(window.num_active_points()) +
               window.newest().immature.size());  // which are added
  for (int h = 0; h + 1 < window.size(); ++h) {
    for (const Point& p : window[h].points) {
      const Residual& r = p.residuals[slot];
      const double sigma = known_sigma(p, rho_unit) / p.rho;
      if (r.state != ResidualState::kIn || !(sigma > 0.0)) continue;
      seen.push_back({r.centre_u, r.centre_v, r.centre_rho, static_cast<float>(sigma * sigma)});
    }
  }
  return seen;
}

/// What stereo knows of a pixel.
SurfaceSample matched_depth(const ImmaturePoint& p) {
  constexpr auto kSquaredNoise = static_cast<float>(kPixelNoise * kPixelNoise);
  const float rho = 0.5F * (p.rho_min + p.rho_max);
  return {p.u, p.v, rho, kSquaredNoise / (p.static_information * rho * rho)};
}

}  // namespace

void find_slopes(Window* window) {
  Keyframe& keyframe = window->newest();
  if (std::none_of(keyframe.immature.begin(), keyframe.immature.end(),
                   [](const ImmaturePoint& p) { return p.from_static_match(); })) {
    return;
  }
  std::vector<SurfaceSample> known = seen_depths(*window);
  for (const ImmaturePoint& p : keyframe.immature) {
    if (p.from_static_match()) known.push_back(matched_depth(p));
  }
  SurfaceSlopes slopes(keyframe.image().width(), keyframe.image().height(), std::move(known));
  for (ImmaturePoint& p : keyframe.immature) {
    if (p.from_static_match()) p.slope = slopes.at(matched_depth(p));
  }
}

}  // namespace sovo
