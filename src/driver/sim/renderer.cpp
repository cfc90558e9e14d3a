#include "sovo/driver/sim/renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sovo/driver/sim/random.h"

namespace sovo::sim {
namespace {

constexpr int kNothing = TileSamples::kNothing;

/// Eight places in a pixel, no two in one row or column.
constexpr std::array<std::array<float, 2>, 8> kPlaces = {{{-0.4375F, -0.0625F},
                                                          {-0.3125F, 0.3125F},
                                                          {-0.1875F, -0.3125F},
                                                          {-0.0625F, 0.0625F},
                                                          {0.0625F, 0.4375F},
                                                          {0.1875F, -0.1875F},
                                                          {0.3125F, 0.1875F},
                                                          {0.4375F, -0.4375F}}};

/// Surface that each of a pixel's eight rays meets, and those rays.
struct EdgeRays {
  static constexpr std::size_t kCount = kPlaces.size();
  alignas(32) std::array<float, kCount> dx, dy, dz;
  alignas(32) std::array<float, kCount> range;
  alignas(32) std::array<int, kCount> surface;
};

/// Surfaces of a pixel and the eight around it, each once; returns their number.
std::size_t distinct(const int* around, int step, std::array<int, 9>* surfaces) {
  std::size_t count = 0;
  for (int j = -1; j <= 1; ++j) {
    for (int i = -1; i <= 1; ++i) {
      const int s = around[j * step + i];
      const auto end = surfaces->begin() + static_cast<std::ptrdiff_t>(count);
      if (s != kNothing && std::find(surfaces->begin(), end, s) == end) (*surfaces)[count++] = s;
    }
  }
  return count;
}

}  // namespace

Renderer::Renderer(const Scene& scene, const CameraModel& camera, const Lamps& lamps,
                   const OwnShadow& shadow)
    : scene_(&scene), lamps_(lamps), rays_(camera), view_(scene), shader_(scene, lamps, shadow) {
  const auto tiles = static_cast<std::size_t>(rays_.num_tiles());
  range_.resize(tiles * RayTable::kTilePixels);
  surface_.resize(range_.size());
  tile_solid_.resize(tiles);
  tile_pierced_.resize(tiles);
}

void Renderer::set_daylight(float share) {
  daylight_ = share;
  shader_.set_daylight(share);
}

void Renderer::render(const SE3& T_world_camera, double t, RenderedImage* image) {
  const CameraModel& camera = rays_.camera();
  image->light.resize(camera.width, camera.height);
  image->range.resize(camera.width, camera.height);
  render_band({T_world_camera, t}, {0, camera.height}, image);
}

void Renderer::render_rolling(const std::function<View(double row)>& view_of,
                              RenderedImage* image) {
  // In a row's time little moves: 0.02 px a row by two radians a second of a common camera.
  constexpr int kRows = 4;
  const CameraModel& camera = rays_.camera();
  image->light.resize(camera.width, camera.height);
  image->range.resize(camera.width, camera.height);
  for (int y = 0; y < camera.height; y += kRows) {
    const Band band{y, std::min(camera.height, y + kRows)};
    render_band(view_of(0.5 * (band.begin + band.end - 1)), band, image);
  }
}

void Renderer::render_band(const View& view, const Band& band, RenderedImage* image) {
  view_.update(view.T_world_camera, view.t);
  shader_.update(view.T_world_camera, view.t);
  find_surfaces(band);
  const int first = band.begin / RayTable::kTile * rays_.tiles_x();
  const int last = ((band.end - 1) / RayTable::kTile + 1) * rays_.tiles_x();
  for (int tile = first; tile < last; ++tile) shade_tile(tile, band, image);
  draw_particles(view, band, image);
}

/// Of the band's pixels and those beside it.
void Renderer::find_surfaces(const Band& band) {
  const int first = std::max(0, band.begin - 1) / RayTable::kTile;
  const int last = std::min(rays_.camera().height - 1, band.end) / RayTable::kTile;
  for (int row = first; rays_.bends() && row <= last; ++row) rays_.bend(row, nullptr);
  find_in_tile_rows(first, last);
  if (!rays_.bends()) return;
  // How far away things are tells how rays run, which changes hardly how far away they are.
  for (int row = first; row <= last; ++row) rays_.bend(row, range_.data());
  find_in_tile_rows(first, last);
}

void Renderer::find_in_tile_rows(int first, int last) {
  const auto begin = first * rays_.tiles_x() * RayTable::kTilePixels;
  const auto end = (last + 1) * rays_.tiles_x() * RayTable::kTilePixels;
  std::fill(range_.begin() + begin, range_.begin() + end, kInfinity);
  std::fill(surface_.begin() + begin, surface_.begin() + end, kNothing);
  for (int by = first / RayTable::kBlock; by <= last / RayTable::kBlock; ++by) {
    find_in_block_row(by, first, last);
  }
}

void Renderer::find_in_block_row(int by, int first_tile_row, int last_tile_row) {
  const int first = std::max(first_tile_row, by * RayTable::kBlock);
  const int last = std::min(last_tile_row, (by + 1) * RayTable::kBlock - 1);
  for (int bx = 0; bx < rays_.blocks_x(); ++bx) {
    view_.select(rays_.block_cone(bx, by), view_.solid(), &block_solid_);
    view_.select(rays_.block_cone(bx, by), view_.pierced(), &block_pierced_);
    const int right = std::min(rays_.tiles_x(), (bx + 1) * RayTable::kBlock);
    for (int y = first; y <= last; ++y) {
      for (int x = bx * RayTable::kBlock; x < right; ++x) {
        const int tile = y * rays_.tiles_x() + x;
        const auto at = static_cast<std::size_t>(tile);
        view_.select(rays_.cone(tile), block_solid_, &tile_solid_[at]);
        view_.select(rays_.cone(tile), block_pierced_, &tile_pierced_[at]);
        find_in_tile(tile);
      }
    }
  }
}

void Renderer::find_in_tile(int tile) {
  const auto at = static_cast<std::size_t>(tile);
  const Rays rays{rays_.dx(tile), rays_.dy(tile), rays_.dz(tile), RayTable::kTilePixels};
  float* range = range_.data() + at * RayTable::kTilePixels;
  float farthest = kInfinity;
  for (const int i : tile_solid_[at]) {
    const SurfaceView& view = view_.views()[static_cast<std::size_t>(i)];
    if (view.nearest > farthest) break;
    cover_rays(view, i, rays, range, surface_.data() + at * RayTable::kTilePixels);
    farthest = *std::max_element(range, range + RayTable::kTilePixels);
  }
}

/// Surfaces of a tile's pixels and of those around it; the image's edge repeats its pixels.
void Renderer::look_around(int x0, int y0, Neighbourhood* around) const {
  const CameraModel& camera = rays_.camera();
  for (int j = 0; j < kSide; ++j) {
    const int y = std::clamp(y0 + j - 1, 0, camera.height - 1);
    int* row = around->data() + j * kSide;
    const auto at = [&](int x) { return surface_[rays_.index(std::min(x, camera.width - 1), y)]; };
    row[0] = at(std::max(0, x0 - 1));
    const int* own = surface_.data() + rays_.index(x0, y);
    std::copy(own, own + RayTable::kTile, row + 1);
    for (int x = camera.width; x < x0 + RayTable::kTile; ++x) row[x - x0 + 1] = at(x);
    row[kSide - 1] = at(x0 + RayTable::kTile);
  }
}

void Renderer::shade_tile(int tile, const Band& band, RenderedImage* image) {
  const CameraModel& camera = rays_.camera();
  const int x0 = tile % rays_.tiles_x() * RayTable::kTile;
  const int y0 = tile / rays_.tiles_x() * RayTable::kTile;
  const std::vector<int>& pierced = tile_pierced_[static_cast<std::size_t>(tile)];
  Neighbourhood around;
  look_around(x0, y0, &around);
  samples_.clear();
  for (int y = std::max(y0, band.begin); y < std::min(band.end, y0 + RayTable::kTile); ++y) {
    for (int x = x0; x < std::min(camera.width, x0 + RayTable::kTile); ++x) {
      const std::size_t i = rays_.index(x, y);
      image->light.at(x, y) = 0.0F;
      image->range.at(x, y) = range_[i];
      const Eigen::Vector3f ray = rays_.ray(x, y);
      if (ray.isZero()) continue;
      const int* own = around.data() + (y - y0 + 1) * kSide + x - x0 + 1;
      const bool edge =
          own[-1] != *own || own[1] != *own || own[-kSide] != *own || own[kSide] != *own;
      if (edge) add_edge(x, y, own);
      if (edge && pierced.empty()) continue;
      samples_.add(y * camera.width + x, {ray, range_[i], *own}, rays_.pixel_angle(0)[i],
                   edge ? 0.0F : 1.0F);
    }
  }
  samples_.shade(*scene_, view_, shader_, pierced);
  for (int i = 0; i < samples_.count(); ++i) {
    const auto pixel = static_cast<std::size_t>(samples_.pixel(i));
    image->light.data()[pixel] += samples_.share(i) * samples_.light(i);
  }
  if (pierced.empty()) return;
  // A pixel's own ray is the last of its rays.
  for (int i = 0; i < samples_.count(); ++i) {
    image->range.data()[static_cast<std::size_t>(samples_.pixel(i))] = samples_.range(i);
  }
}

/// A sample for each surface that eight rays through a pixel meet: their mean ray.
void Renderer::add_edge(int x, int y, const int* around) {
  std::array<int, 9> near{};
  const std::size_t num_near = distinct(around, kSide, &near);
  const Eigen::Vector3f centre = rays_.ray(x, y);
  const Eigen::Vector3f step_x = rays_.ray_step_x(x, y);
  const Eigen::Vector3f step_y = rays_.ray_step_y(x, y);
  EdgeRays rays;
  for (std::size_t k = 0; k < EdgeRays::kCount; ++k) {
    const Eigen::Vector3f ray = centre + kPlaces[k][0] * step_x + kPlaces[k][1] * step_y;
    rays.dx[k] = ray.x();
    rays.dy[k] = ray.y();
    rays.dz[k] = ray.z();
  }
  rays.range.fill(kInfinity);
  rays.surface.fill(kNothing);
  for (std::size_t k = 0; k < num_near; ++k) {
    cover_rays(view_.views()[static_cast<std::size_t>(near[k])], near[k],
               {rays.dx.data(), rays.dy.data(), rays.dz.data(), static_cast<int>(EdgeRays::kCount)},
               rays.range.data(), rays.surface.data());
  }
  std::array<bool, EdgeRays::kCount> done{};
  for (std::size_t k = 0; k < EdgeRays::kCount; ++k) {
    if (done[k]) continue;
    int count = 0;
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (std::size_t i = k; i < EdgeRays::kCount; ++i) {
      if (rays.surface[i] != rays.surface[k]) continue;
      sum += Eigen::Vector3f(rays.dx[i], rays.dy[i], rays.dz[i]);
      done[i] = true;
      ++count;
    }
    TileSamples::Hit hit{sum.normalized(), kInfinity, rays.surface[k]};
    if (hit.surface != kNothing) {
      hit.range = range_along(view_.views()[static_cast<std::size_t>(hit.surface)], hit.ray);
      if (hit.range == kInfinity) hit.surface = kNothing;
    }
    samples_.add(y * rays_.camera().width + x, hit, rays_.pixel_angle(0)[rays_.index(x, y)],
                 static_cast<float>(count) / static_cast<float>(EdgeRays::kCount));
  }
}

void Renderer::draw_particles(const View& view, const Band& band, RenderedImage* image) const {
  const Particles& p = scene_->particles;
  const CameraModel& camera = rays_.camera();
  const SE3 T_camera_world = view.T_world_camera.inverse();
  Random random(p.seed);
  for (int i = 0; i < p.count; ++i) {
    // Each has its place in a lattice of equal boxes; the one nearest to the camera is drawn.
    Vec3 offset;
    for (int k = 0; k < 3; ++k) {
      const double home = random.uniform() * p.box;
      const double sway = 0.05 * std::sin(0.7 * view.t + 6.3 * random.uniform());
      const double place = home + p.drift[k] * view.t + sway - view.T_world_camera.translation()[k];
      offset[k] = place - p.box * std::round(place / p.box);
    }
    const double size = random.uniform(0.4, 1.0);
    const double distance = offset.norm();
    const Vec3 in_camera = T_camera_world.rotation() * offset;
    const auto pixel = camera.project(camera.direction_of(in_camera));
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
    float brightness = daylight_ * p.brightness;
    if (lamps_.lit()) brightness += p.brightness * lamps_.at(in_camera.cast<float>());
    const int reach = std::min(24, static_cast<int>(std::ceil(2.5 * wide)));
    for (int y = std::max(band.begin, cy - reach); y < std::min(band.end, cy + reach + 1); ++y) {
      for (int x = std::max(0, cx - reach); x <= std::min(camera.width - 1, cx + reach); ++x) {
        if (double{image->range.at(x, y)} < distance) continue;
        const double r2 = (Vec2(x, y) - *pixel).squaredNorm() / (wide * wide);
        float& light = image->light.at(x, y);
        light += static_cast<float>(peak * std::exp(-r2)) * (brightness - light);
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
