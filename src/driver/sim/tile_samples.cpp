#include "sovo/driver/sim/tile_samples.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace sovo::sim {
namespace {

constexpr int kEnd = -1;                ///< Of a chain.
constexpr float kVisibleLight = 0.02F;  ///< Light that comes through less than this is left out.

}  // namespace

TileSamples::TileSamples() {
  constexpr std::size_t kMost = std::size_t{9} * RayTable::kTilePixels;
  for (auto* values :
       {&dx_, &dy_, &dz_, &range_, &angle_, &share_, &light_, &left_, &seen_range_, &cut_range_}) {
    values->resize(kMost);
  }
  for (auto* values : {&pixel_, &surface_, &first_cut_, &next_of_surface_}) values->resize(kMost);
  cut_by_.resize(kMost);
}

void TileSamples::add(int pixel, const Hit& hit, float angle, float share) {
  const std::size_t i = at(count_++);
  dx_[i] = hit.ray.x();
  dy_[i] = hit.ray.y();
  dz_[i] = hit.ray.z();
  range_[i] = hit.range;
  angle_[i] = angle;
  share_[i] = share;
  pixel_[i] = pixel;
  surface_[i] = hit.surface;
}

void TileSamples::take(int i, RayBatch* rays) {
  const std::size_t to = at(rays->count++);
  rays->dx[to] = dx_[at(i)];
  rays->dy[to] = dy_[at(i)];
  rays->dz[to] = dz_[at(i)];
  rays->range[to] = range_[at(i)];
  rays->angle[to] = angle_[at(i)];
  batch_[to] = i;
}

void TileSamples::shade(const Scene& scene, const SceneView& view, const Shader& shader,
                        const std::vector<int>& pierced) {
  const std::size_t n = at(count_);
  std::fill_n(light_.begin(), n, 0.0F);
  std::fill_n(left_.begin(), n, 1.0F);
  std::copy_n(range_.begin(), n, seen_range_.begin());
  if (!pierced.empty()) {
    cuts_.clear();
    std::fill_n(first_cut_.begin(), n, kEnd);
    for (const int i : pierced) {
      const SurfaceView& v = view.views()[at(i)];
      cut_by(v, scene.surfaces[at(v.surface)].decal, shader);
    }
    compose();
  }
  shade_solid(view, shader);
}

void TileSamples::cut_by(const SurfaceView& view, bool decal, const Shader& shader) {
  std::copy_n(range_.begin(), at(count_), cut_range_.begin());
  std::fill_n(cut_by_.begin(), at(count_), 0);
  cover_rays(view, 1, {dx_.data(), dy_.data(), dz_.data(), count_}, cut_range_.data(),
             cut_by_.data());
  RayBatch rays;
  for (int i = 0; i < count_; ++i) {
    if (cut_by_[at(i)] == 0) continue;
    take(i, &rays);
    rays.range[at(rays.count - 1)] = cut_range_[at(i)];
    if (rays.count == kBatch) add_cuts(view, decal, shader, &rays);
  }
  if (rays.count > 0) add_cuts(view, decal, shader, &rays);
}

void TileSamples::add_cuts(const SurfaceView& view, bool decal, const Shader& shader,
                           RayBatch* rays) {
  BatchFloats opacity;
  shader.cover(view, rays, &opacity);
  const int count = rays->count;
  rays->count = 0;
  for (std::size_t i = 0; i < at(count); ++i) {
    if (opacity[i] < 0.004F) continue;
    const std::size_t to = at(rays->count++);
    for (BatchFloats* v : {&rays->dx, &rays->dy, &rays->dz, &rays->range, &rays->angle, &opacity}) {
      (*v)[to] = (*v)[i];
    }
    batch_[to] = batch_[i];
  }
  if (rays->count == 0) return;
  BatchFloats light;
  shader.light(view, rays, &light);
  for (std::size_t i = 0; i < at(rays->count); ++i) {
    add_cut(batch_[i], {rays->range[i], opacity[i], light[i], decal, kEnd});
  }
  rays->count = 0;
}

void TileSamples::add_cut(int sample, const Cut& cut) {
  const int own = static_cast<int>(cuts_.size());
  cuts_.push_back(cut);
  // Nearest first; of equal ones the first to come.
  int* link = &first_cut_[at(sample)];
  while (*link != kEnd && cuts_[at(*link)].range <= cut.range) link = &cuts_[at(*link)].next;
  cuts_.back().next = *link;
  *link = own;
}

void TileSamples::compose() {
  for (std::size_t i = 0; i < at(count_); ++i) {
    float left = 1.0F;
    for (int k = first_cut_[i]; k != kEnd && left > kVisibleLight; k = cuts_[at(k)].next) {
      const Cut& cut = cuts_[at(k)];
      light_[i] += left * cut.opacity * cut.light;
      left *= 1.0F - cut.opacity;
      if (left < 0.5F && !cut.decal) seen_range_[i] = std::min(seen_range_[i], cut.range);
    }
    left_[i] = left;
  }
}

void TileSamples::shade_solid(const SceneView& view, const Shader& shader) {
  first_of_surface_.resize(view.views().size() + 1, kEnd);
  met_.clear();
  for (int i = count_ - 1; i >= 0; --i) {
    if (share_[at(i)] <= 0.0F || left_[at(i)] <= kVisibleLight) continue;
    int& first = first_of_surface_[at(surface_[at(i)] + 1)];
    if (first == kEnd) met_.push_back(surface_[at(i)]);
    next_of_surface_[at(i)] = first;
    first = i;
  }
  RayBatch rays;
  for (const int surface : met_) {
    int i = std::exchange(first_of_surface_[at(surface + 1)], kEnd);
    for (; i != kEnd; i = next_of_surface_[at(i)]) {
      take(i, &rays);
      if (rays.count == kBatch) shade_batch(view, shader, surface, &rays);
    }
    if (rays.count > 0) shade_batch(view, shader, surface, &rays);
  }
}

void TileSamples::shade_batch(const SceneView& view, const Shader& shader, int surface,
                              RayBatch* rays) {
  BatchFloats light;
  if (surface == kNothing) {
    shader.sky(rays, &light);
  } else {
    shader.light(view.views()[at(surface)], rays, &light);
  }
  for (std::size_t i = 0; i < at(rays->count); ++i) {
    const std::size_t sample = at(batch_[i]);
    light_[sample] += left_[sample] * light[i];
  }
  rays->count = 0;
}

}  // namespace sovo::sim
