#include "sovo/vo/tracking_reference.h"

#include <array>
#include <cmath>

namespace sovo {

namespace {

constexpr int kBorder = 2;

/// Weighted inverse depths at one level: sums of rho * w and of w.
struct DepthMap {
  ImageF sum, weight;
  void reset(int w, int h) {
    sum.resize(w, h);
    weight.resize(w, h);
    sum.fill(0.0F);
    weight.fill(0.0F);
  }
  void add(float u, float v, float rho, float w) {
    const int x = static_cast<int>(u + 0.5F);
    const int y = static_cast<int>(v + 0.5F);
    if (x < 0 || y < 0 || x >= sum.width() || y >= sum.height()) return;
    sum.at(x, y) += rho * w;
    weight.at(x, y) += w;
  }
};

std::size_t splat(const Window& window, DepthMap* map) {
  const Keyframe& newest = window.newest();
  const auto slot = static_cast<std::size_t>(newest.slot);
  const double rho_unit = window.mean_inverse_depth();
  std::size_t count = 0;
  for (int h = 0; h < window.size(); ++h) {
    for (const Point& p : window[h].points) {
      const double information = p.hessian * rho_unit * rho_unit;
      const auto weight = static_cast<float>(std::sqrt(1e-3 * (information + 1e-6)));
      if (h + 1 == window.size()) {
        map->add(p.u, p.v, static_cast<float>(p.rho), weight);
        ++count;
        continue;
      }
      const Residual& r = p.residuals[slot];
      if (r.state != ResidualState::kIn) continue;
      map->add(r.centre_u, r.centre_v, r.centre_rho, weight);
      ++count;
    }
  }
  return count;
}

void sum_down(const DepthMap& fine, DepthMap* coarse) {
  coarse->reset(fine.sum.width() / 2, fine.sum.height() / 2);
  for (int y = 0; y < coarse->sum.height(); ++y) {
    for (int x = 0; x < coarse->sum.width(); ++x) {
      coarse->sum.at(x, y) = fine.sum.at(2 * x, 2 * y) + fine.sum.at(2 * x + 1, 2 * y) +
                             fine.sum.at(2 * x, 2 * y + 1) + fine.sum.at(2 * x + 1, 2 * y + 1);
      coarse->weight.at(x, y) = fine.weight.at(2 * x, 2 * y) + fine.weight.at(2 * x + 1, 2 * y) +
                                fine.weight.at(2 * x, 2 * y + 1) +
                                fine.weight.at(2 * x + 1, 2 * y + 1);
    }
  }
}

/// Fills empty cells with the mean of their filled diagonal (fine levels) or axis neighbours.
void dilate(bool diagonal, DepthMap* map) {
  using Offset = std::array<int, 2>;
  constexpr std::array<Offset, 4> kDiagonal = {{{-1, -1}, {1, -1}, {-1, 1}, {1, 1}}};
  constexpr std::array<Offset, 4> kAxis = {{{0, -1}, {-1, 0}, {1, 0}, {0, 1}}};
  const auto& offsets = diagonal ? kDiagonal : kAxis;
  const ImageF before = map->weight;
  for (int y = 1; y + 1 < before.height(); ++y) {
    for (int x = 1; x + 1 < before.width(); ++x) {
      if (before.at(x, y) > 0.0F) continue;
      float sum = 0.0F;
      float weight = 0.0F;
      int n = 0;
      for (const Offset& o : offsets) {
        if (before.at(x + o[0], y + o[1]) <= 0.0F) continue;
        sum += map->sum.at(x + o[0], y + o[1]);
        weight += before.at(x + o[0], y + o[1]);
        ++n;
      }
      if (n == 0) continue;
      map->sum.at(x, y) = sum / static_cast<float>(n);
      map->weight.at(x, y) = weight / static_cast<float>(n);
    }
  }
}

void extract(const DepthMap& map, const ImageF& image, ReferenceLevel* level) {
  for (int y = kBorder; y < image.height() - kBorder; ++y) {
    for (int x = kBorder; x < image.width() - kBorder; ++x) {
      const float w = map.weight.at(x, y);
      if (w <= 0.0F) continue;
      const float rho = map.sum.at(x, y) / w;
      const float colour = image.at(x, y);
      if (!(rho > 0.0F) || !std::isfinite(colour)) continue;
      level->u.push_back(static_cast<float>(x));
      level->v.push_back(static_cast<float>(y));
      level->rho.push_back(rho);
      level->colour.push_back(colour);
    }
  }
}

}  // namespace

TrackingReference build_tracking_reference(const Window& window, int num_levels) {
  const Keyframe& newest = window.newest();
  TrackingReference ref;
  ref.keyframe_id = newest.id;
  ref.stamp_ns = newest.stamp_ns;
  ref.exposure_s = newest.exposure_s;
  ref.affine = newest.affine;
  ref.T_world_camera = newest.T_world_camera();
  ref.levels.resize(static_cast<std::size_t>(num_levels));

  DepthMap map;
  map.reset(newest.image().width(), newest.image().height());
  ref.num_window_points = splat(window, &map);
  for (int l = 0; l < num_levels; ++l) {
    if (l > 0) {
      DepthMap coarse;
      sum_down(map, &coarse);
      map = std::move(coarse);
    }
    DepthMap filled = map;
    dilate(l < 2, &filled);
    ReferenceLevel& level = ref.levels[static_cast<std::size_t>(l)];
    level.camera = window.camera().at_level(l);
    extract(filled, newest.pyramid->level(l), &level);
  }
  double sum = 0.0;
  for (const float rho : ref.levels[0].rho) sum += rho;
  if (sum > 0.0) ref.mean_rho = sum / static_cast<double>(ref.levels[0].size());
  for (int i = 0; i < window.size(); ++i) {
    ref.keyframe_poses.emplace_back(window[i].id, window[i].T_world_camera());
  }
  return ref;
}

TrackingReference rescaled(const TrackingReference& reference, double scale) {
  TrackingReference out = reference;
  const Vec3 centre = reference.T_world_camera.translation();
  for (ReferenceLevel& level : out.levels) {
    for (float& rho : level.rho) rho /= static_cast<float>(scale);
  }
  for (auto& [id, T] : out.keyframe_poses) {
    T.translation() = centre + scale * (T.translation() - centre);
  }
  out.mean_rho /= scale;
  out.log_scale += std::log(scale);
  return out;
}

}  // namespace sovo
