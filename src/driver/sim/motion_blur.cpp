#include <algorithm>
#include <array>
#include <cmath>

#include "sovo/driver/sim/kernel.h"
#include "sovo/driver/sim/sensor.h"

namespace sovo::sim {
namespace {

using Eigen::Vector3f;

constexpr float kVisibleBlur = 0.5F;  // [px]; less takes a few hundredths of the finest detail
constexpr int kMostTaps = 33;

using TileFloats = std::array<float, RayTable::kTilePixels>;

/// Ways of what the pixels of a tile show over the image during the exposure [px], and at how many
/// places along them light is taken.
struct TileFlow {
  alignas(32) TileFloats range;
  alignas(32) TileFloats x, y;
  alignas(32) TileFloats share;  ///< Of one place.
  alignas(32) TileFloats light;
  alignas(32) std::array<int, RayTable::kTilePixels> taps;
  int most_taps = 1;
};

/// A point at rest: d ray = -(turn x ray) - (shift - ray (ray . shift)) / range.
SOVO_SIM_KERNEL void find_flow(const RayTable& rays, int tile, const Vector3f& shift,
                               const Vector3f& turn, TileFlow* __restrict flow) {
  const float* const __restrict dx = rays.dx(tile);
  const float* const __restrict dy = rays.dy(tile);
  const float* const __restrict dz = rays.dz(tile);
  const std::array<const float*, 6> step = {rays.pixel_step(tile, 0), rays.pixel_step(tile, 1),
                                            rays.pixel_step(tile, 2), rays.pixel_step(tile, 3),
                                            rays.pixel_step(tile, 4), rays.pixel_step(tile, 5)};
  const float s0 = shift.x(), s1 = shift.y(), s2 = shift.z();
  const float w0 = turn.x(), w1 = turn.y(), w2 = turn.z();
  int most = 1;
  for (std::size_t i = 0; i < RayTable::kTilePixels; ++i) {
    const float near = 1.0F / flow->range[i];  // 0 for the sky
    const float along = s0 * dx[i] + s1 * dy[i] + s2 * dz[i];
    const float cx = w2 * dy[i] - w1 * dz[i] - near * (s0 - along * dx[i]);
    const float cy = w0 * dz[i] - w2 * dx[i] - near * (s1 - along * dy[i]);
    const float cz = w1 * dx[i] - w0 * dy[i] - near * (s2 - along * dz[i]);
    const float x = step[0][i] * cx + step[1][i] * cy + step[2][i] * cz;
    const float y = step[3][i] * cx + step[4][i] * cy + step[5][i] * cz;
    const float length = std::min(static_cast<float>(kMostTaps - 1), std::sqrt(x * x + y * y));
    const int whole = static_cast<int>(length);
    const int wanted = 1 + whole + (static_cast<float>(whole) < length ? 1 : 0);
    const int taps = length > kVisibleBlur ? wanted : 1;
    flow->x[i] = x;
    flow->y[i] = y;
    flow->taps[i] = taps;
    flow->share[i] = 1.0F / static_cast<float>(taps);
    flow->light[i] = 0.0F;
    most = most > taps ? most : taps;
  }
  flow->most_taps = most;
}

/// Adds the light at one place of each pixel's way; the tile begins at (x0, y0).
SOVO_SIM_KERNEL void add_tap(const float* __restrict light, int width, int height, int tap, int x0,
                             int y0, TileFlow* __restrict flow) {
  const auto right = static_cast<float>(width - 1);
  const auto bottom = static_cast<float>(height - 1);
  for (int i = 0; i < RayTable::kTilePixels; ++i) {
    const float at = (static_cast<float>(tap) + 0.5F) * flow->share[i] - 0.5F;
    const float u = static_cast<float>(x0 + i % RayTable::kTile) + at * flow->x[i];
    const float v = static_cast<float>(y0 + i / RayTable::kTile) + at * flow->y[i];
    const float x = std::min(right, std::max(0.0F, u));
    const float y = std::min(bottom, std::max(0.0F, v));
    const int whole_x = static_cast<int>(x);
    const int whole_y = static_cast<int>(y);
    const int ix = whole_x < width - 2 ? whole_x : width - 2;
    const int iy = whole_y < height - 2 ? whole_y : height - 2;
    const float fx = x - static_cast<float>(ix);
    const float fy = y - static_cast<float>(iy);
    const int k = iy * width + ix;
    const float top = light[k] + fx * (light[k + 1] - light[k]);
    const float low = light[k + width] + fx * (light[k + width + 1] - light[k + width]);
    const float value = flow->share[i] * (top + fy * (low - top));
    flow->light[i] += tap < flow->taps[i] ? value : 0.0F;
  }
}

}  // namespace

void blur_by_motion(const RayTable& rays, const RenderedImage& image, const Vec6& velocity,
                    double exposure_s, ImageF* blurred) {
  const ImageF& light = image.light;
  blurred->resize(light.width(), light.height());
  const Vector3f shift = (exposure_s * velocity.head<3>()).cast<float>();
  const Vector3f turn = (exposure_s * velocity.tail<3>()).cast<float>();
  TileFlow flow;
  flow.range.fill(1.0F);
  for (int tile = 0; tile < rays.num_tiles(); ++tile) {
    const int x0 = tile % rays.tiles_x() * RayTable::kTile;
    const int y0 = tile / rays.tiles_x() * RayTable::kTile;
    const int columns = std::min(RayTable::kTile, light.width() - x0);
    const int rows = std::min(RayTable::kTile, light.height() - y0);
    for (int j = 0; j < rows; ++j) {
      std::copy_n(image.range.row(y0 + j) + x0, columns, flow.range.data() + j * RayTable::kTile);
    }
    find_flow(rays, tile, shift, turn, &flow);
    if (flow.most_taps > 1) {
      for (int tap = 0; tap < flow.most_taps; ++tap) {
        add_tap(light.data(), light.width(), light.height(), tap, x0, y0, &flow);
      }
    }
    for (int j = 0; j < rows; ++j) {
      const float* from =
          flow.most_taps > 1 ? flow.light.data() + j * RayTable::kTile : light.row(y0 + j) + x0;
      std::copy_n(from, columns, blurred->row(y0 + j) + x0);
    }
  }
}

}  // namespace sovo::sim
