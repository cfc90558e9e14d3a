#include "sovo/vo/sparse_regions.h"

#include <algorithm>
#include <vector>

#include "sovo/vo/image_cells.h"

namespace sovo {

namespace {

constexpr int kRegionSide = 32;         ///< [px]
constexpr double kSparseDensity = 0.5;  ///< Of that of pixels that are spread evenly.

std::size_t region_of(const ImageCells& regions, int x, int y) {
  return regions.at(static_cast<float>(x), static_cast<float>(y));
}

}  // namespace

SparseRegions sparse_regions(std::span<const SelectedPixel> pixels, const ImageU8& allowed,
                             int width, int height) {
  const ImageCells regions(kRegionSide, width, height);
  const auto is_allowed = [&](int x, int y) { return allowed.empty() || allowed.at(x, y) != 0; };
  std::vector<double> areas(regions.size(), 0.0);  // [px]
  double area = 0.0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (!is_allowed(x, y)) continue;
      areas[region_of(regions, x, y)] += 1.0;
      area += 1.0;
    }
  }
  std::vector<double> found(regions.size(), 0.0);
  for (const SelectedPixel& p : pixels) found[region_of(regions, p.x, p.y)] += 1.0;

  const double least =
      kSparseDensity * static_cast<double>(pixels.size()) / std::max(1.0, area);  // [1/px]
  SparseRegions out{ImageU8(width, height), 0.0};
  double sparse = 0.0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t region = region_of(regions, x, y);
      if (!is_allowed(x, y) || found[region] >= least * areas[region]) continue;
      out.mask.at(x, y) = 255;
      sparse += 1.0;
    }
  }
  out.share = sparse / std::max(1.0, area);
  for (const SelectedPixel& p : pixels) out.mask.at(p.x, p.y) = 0;
  return out;
}

}  // namespace sovo
