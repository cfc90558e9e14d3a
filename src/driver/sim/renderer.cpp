#include "sovo/driver/sim/renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sovo/driver/sim/random.h"

namespace sovo::sim {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kNothing = -1;

/// Eight places in a pixel, no two in one row or column.
constexpr std::array<std::array<float, 2>, 8> kPlaces = {{{-0.4375F, -0.0625F},
                                                          {-0.3125F, 0.3125F},
                                                          {-0.1875F, -0.3125F},
                                                          {-0.0625F, 0.0625F},
                                                          {0.0625F, 0.4375F},
                                                          {0.1875F, -0.1875F},
                                                          {0.3125F, 0.1875F},
                                                          {0.4375F, -0.4375F}}};

}  // namespace

Renderer::Renderer(const Scene& scene, const CameraModel& camera)
    : scene_(&scene), rays_(camera), view_(scene), shader_(scene) {
  const auto tiles = static_cast<std::size_t>(rays_.num_tiles());
  range_.resize(tiles * RayTable::kTilePixels);
  surface_.resize(range_.size());
  tile_solid_.resize(tiles);
  tile_pierced_.resize(tiles);
}

void Renderer::render(const SE3& T_world_camera, double t, RenderedImage* image) {
  const CameraModel& camera = rays_.camera();
  image->light.resize(camera.width, camera.height);
  image->range.resize(camera.width, camera.height);
  view_.update(T_world_camera);
  shader_.update(T_world_camera, t);
  find_surfaces();
  for (int tile = 0; tile < rays_.num_tiles(); ++tile) shade_tile(tile, image);
  draw_particles(T_world_camera, t, image);
}

void Renderer::find_surfaces() {
  std::fill(range_.begin(), range_.end(), kInfinity);
  std::fill(surface_.begin(), surface_.end(), kNothing);
  std::vector<int> block_solid;
  std::vector<int> block_pierced;
  for (int block = 0; block < rays_.blocks_x() * rays_.blocks_y(); ++block) {
    const int bx = block % rays_.blocks_x();
    const int by = block / rays_.blocks_x();
    view_.select(rays_.block_cone(bx, by), view_.solid(), &block_solid);
    view_.select(rays_.block_cone(bx, by), view_.pierced(), &block_pierced);
    for (int y = by * RayTable::kBlock; y < std::min(rays_.tiles_y(), (by + 1) * RayTable::kBlock);
         ++y) {
      for (int x = bx * RayTable::kBlock;
           x < std::min(rays_.tiles_x(), (bx + 1) * RayTable::kBlock); ++x) {
        const int tile = y * rays_.tiles_x() + x;
        const auto at = static_cast<std::size_t>(tile);
        view_.select(rays_.cone(tile), block_solid, &tile_solid_[at]);
        view_.select(rays_.cone(tile), block_pierced, &tile_pierced_[at]);
        float* range = range_.data() + at * RayTable::kTilePixels;
        float farthest = kInfinity;
        for (const int i : tile_solid_[at]) {
          const SurfaceView& view = view_.views()[static_cast<std::size_t>(i)];
          if (view.nearest > farthest) break;
          cover_tile(view, i, rays_, tile, range, surface_.data() + at * RayTable::kTilePixels);
          farthest = *std::max_element(range, range + RayTable::kTilePixels);
        }
      }
    }
  }
}

Renderer::Composite Renderer::composite(const Eigen::Vector3f& ray, int tile, int surface,
                                        float range, float angle) const {
  struct Cut {
    float range;
    int view;
  };
  constexpr std::size_t kMost = 32;
  std::array<Cut, kMost> cuts;
  std::size_t count = 0;
  for (const int i : tile_pierced_[static_cast<std::size_t>(tile)]) {
    const SurfaceView& view = view_.views()[static_cast<std::size_t>(i)];
    if (view.nearest >= range || count == kMost) continue;
    const float t = range_along(view, ray);
    if (t >= range) continue;
    std::size_t k = count++;
    for (; k > 0 && cuts[k - 1].range > t; --k) cuts[k] = cuts[k - 1];
    cuts[k] = {t, i};
  }
  Composite result;
  result.range = kInfinity;
  float left = 1.0F;
  for (std::size_t k = 0; k < count && left > 0.02F; ++k) {
    const SurfaceView& view = view_.views()[static_cast<std::size_t>(cuts[k].view)];
    const auto sample = shader_.surface(view, ray, cuts[k].range, angle);
    result.value += left * sample.opacity * sample.value;
    left *= 1.0F - sample.opacity;
    const bool decal = scene_->surfaces[static_cast<std::size_t>(view.surface)].decal;
    if (left < 0.5F && !decal) result.range = std::min(result.range, cuts[k].range);
  }
  result.range = std::min(result.range, range);
  if (left <= 0.02F) return result;
  const float behind =
      surface == kNothing
          ? shader_.sky(ray, angle)
          : shader_.surface(view_.views()[static_cast<std::size_t>(surface)], ray, range, angle)
                .value;
  result.value += left * behind;
  return result;
}

bool Renderer::on_edge(int x, int y) const {
  const CameraModel& camera = rays_.camera();
  const int own = surface_at(x, y);
  return (x > 0 && surface_at(x - 1, y) != own) ||
         (x + 1 < camera.width && surface_at(x + 1, y) != own) ||
         (y > 0 && surface_at(x, y - 1) != own) ||
         (y + 1 < camera.height && surface_at(x, y + 1) != own);
}

void Renderer::shade_tile(int tile, RenderedImage* image) {
  const CameraModel& camera = rays_.camera();
  const int x0 = tile % rays_.tiles_x() * RayTable::kTile;
  const int y0 = tile / rays_.tiles_x() * RayTable::kTile;
  for (int y = y0; y < std::min(camera.height, y0 + RayTable::kTile); ++y) {
    for (int x = x0; x < std::min(camera.width, x0 + RayTable::kTile); ++x) {
      const std::size_t i = rays_.index(x, y);
      const Eigen::Vector3f ray = rays_.ray(x, y);
      if (ray.isZero()) {
        image->light.at(x, y) = 0.0F;
        image->range.at(x, y) = kInfinity;
        continue;
      }
      const float angle = rays_.pixel_angle(0)[i];
      const Composite seen = composite(ray, tile, surface_[i], range_[i], angle);
      image->range.at(x, y) = seen.range;
      image->light.at(x, y) = on_edge(x, y) ? shade_edge(x, y, tile, angle) : seen.value;
    }
  }
}

float Renderer::shade_edge(int x, int y, int tile, float angle) const {
  const CameraModel& camera = rays_.camera();
  std::array<int, 9> near{};
  std::size_t num_near = 0;
  for (int j = std::max(0, y - 1); j <= std::min(camera.height - 1, y + 1); ++j) {
    for (int i = std::max(0, x - 1); i <= std::min(camera.width - 1, x + 1); ++i) {
      const int s = surface_at(i, j);
      const auto end = near.begin() + static_cast<std::ptrdiff_t>(num_near);
      if (s != kNothing && std::find(near.begin(), end, s) == end) near[num_near++] = s;
    }
  }
  std::array<Part, kPlaces.size()> parts;
  std::size_t num_parts = 0;
  const Eigen::Vector3f step_x = rays_.ray_step_x(x, y);
  const Eigen::Vector3f step_y = rays_.ray_step_y(x, y);
  for (const auto& place : kPlaces) {
    const Eigen::Vector3f ray = rays_.ray(x, y) + place[0] * step_x + place[1] * step_y;
    int nearest = kNothing;
    float range = kInfinity;
    for (std::size_t k = 0; k < num_near; ++k) {
      const float t = range_along(view_.views()[static_cast<std::size_t>(near[k])], ray);
      if (t < range) {
        range = t;
        nearest = near[k];
      }
    }
    std::size_t k = 0;
    while (k < num_parts && parts[k].surface != nearest) ++k;
    if (k == num_parts) parts[num_parts++].surface = nearest;
    ++parts[k].count;
    parts[k].ray += ray;
  }
  float value = 0.0F;
  for (std::size_t k = 0; k < num_parts; ++k) {
    const Eigen::Vector3f ray = parts[k].ray.normalized();
    float range = kInfinity;
    int surface = parts[k].surface;
    if (surface != kNothing) {
      range = range_along(view_.views()[static_cast<std::size_t>(surface)], ray);
      if (range == kInfinity) surface = kNothing;
    }
    const float share = static_cast<float>(parts[k].count) / static_cast<float>(kPlaces.size());
    value += share * composite(ray, tile, surface, range, angle).value;
  }
  return value;
}

void Renderer::draw_particles(const SE3& T_world_camera, double t, RenderedImage* image) const {
  const Particles& p = scene_->particles;
  const CameraModel& camera = rays_.camera();
  const SE3 T_camera_world = T_world_camera.inverse();
  Random random(p.seed);
  for (int i = 0; i < p.count; ++i) {
    // Each has its place in a lattice of equal boxes; the one nearest to the camera is drawn.
    Vec3 offset;
    for (int k = 0; k < 3; ++k) {
      const double home = random.uniform() * p.box;
      const double sway = 0.05 * std::sin(0.7 * t + 6.3 * random.uniform());
      const double place = home + p.drift[k] * t + sway - T_world_camera.translation()[k];
      offset[k] = place - p.box * std::round(place / p.box);
    }
    const double size = random.uniform(0.4, 1.0);
    const double distance = offset.norm();
    const auto pixel = camera.project(T_camera_world.rotation() * offset);
    if (!pixel || !camera.contains(*pixel) || distance < 0.15) continue;
    const int cx = static_cast<int>(std::lround(pixel->x()));
    const int cy = static_cast<int>(std::lround(pixel->y()));
    const float angle = rays_.pixel_angle(0)[rays_.index(cx, cy)];
    // A Gaussian spot, widened by the pixel, its light kept.
    const double own = p.radius * size / distance / double{angle};
    const double wide = std::sqrt(own * own + 0.35);
    const double edge = std::clamp((0.5 * p.box - distance) / (0.15 * p.box), 0.0, 1.0);
    const double peak = 0.75 * own * own / (wide * wide) * edge;
    if (peak < 0.004) continue;
    const int reach = std::min(24, static_cast<int>(std::ceil(2.5 * wide)));
    for (int y = std::max(0, cy - reach); y <= std::min(camera.height - 1, cy + reach); ++y) {
      for (int x = std::max(0, cx - reach); x <= std::min(camera.width - 1, cx + reach); ++x) {
        if (double{image->range.at(x, y)} < distance) continue;
        const double r2 = (Vec2(x, y) - *pixel).squaredNorm() / (wide * wide);
        float& light = image->light.at(x, y);
        light += static_cast<float>(peak * std::exp(-r2)) * (p.brightness - light);
      }
    }
  }
}

float Renderer::range_at(const Vec2& pixel) const {
  const auto ray = rays_.camera().unproject(pixel);
  if (!ray) return kInfinity;
  float range = kInfinity;
  for (const int i : view_.solid()) {
    const SurfaceView& view = view_.views()[static_cast<std::size_t>(i)];
    range = std::min(range, range_along(view, ray->cast<float>()));
  }
  return range;
}

}  // namespace sovo::sim
