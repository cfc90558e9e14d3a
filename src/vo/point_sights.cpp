#include "sovo/vo/point_sights.h"

#include <array>
#include <cstddef>

#include "sovo/vo/linearization.h"
#include "sovo/vo/pattern.h"

namespace sovo {

namespace {

double mean_of(const std::array<float, kPatternSize>& grey) {
  double sum = 0.0;
  for (const float g : grey) sum += static_cast<double>(g);
  return sum / kPatternSize;
}

/// Mean grey level of a pattern where an image shows it, as large as it is there.
double mean_seen(const ImageF& image, const PatternProjection& seen) {
  std::array<float, kPatternSize> grey{};
  for (std::size_t i = 0; i < kPatternSize; ++i) {
    const float* upper = image.data() + seen.offset[i];
    const float* lower = upper + image.width();
    const float above = upper[0] + seen.fx[i] * (upper[1] - upper[0]);
    const float below = lower[0] + seen.fx[i] * (lower[1] - lower[0]);
    grey[i] = above + seen.fy[i] * (below - above);
  }
  return mean_of(grey);
}

void find_sights(const Window& window, int host, std::vector<PointSight>* sights) {
  const int newest = window.size() - 1;
  const auto slot = static_cast<std::size_t>(window.newest().slot);
  const PairGeometry& pair = window.pair(host, newest);
  PatternProjection seen;
  sights->clear();
  sights->reserve(window[host].points.size());
  for (const Point& p : window[host].points) {
    if (p.residuals[slot].state != ResidualState::kIn) continue;
    project_pattern(window, host, newest, p, &seen);
    if (!seen.in_view) continue;
    PointSight s;
    s.u_host = static_cast<double>(p.u);
    s.v_host = static_cast<double>(p.v);
    s.grey_host = mean_of(p.colour);
    s.u = static_cast<double>(seen.centre_u);
    s.v = static_cast<double>(seen.centre_v);
    s.grey = mean_seen(window.newest().image(), seen);
    const Eigen::Vector3f at =
        pair.KRKi * Eigen::Vector3f(p.u, p.v, 1.0F) + static_cast<float>(p.rho) * pair.Kt;
    s.depth_ratio = static_cast<double>(at.z());
    sights->push_back(s);
  }
}

}  // namespace

void find_sights_in_newest(const Window& window, PointSights* sights) {
  sights->resize(static_cast<std::size_t>(window.size() - 1));
  for (int host = 0; host + 1 < window.size(); ++host) {
    find_sights(window, host, &(*sights)[static_cast<std::size_t>(host)]);
  }
}

}  // namespace sovo
