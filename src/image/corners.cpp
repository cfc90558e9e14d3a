#include "sovo/image/corners.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

namespace sovo {
namespace {

constexpr int kTensorRadius = 2;  ///< Of the square whose gradients make a corner.
constexpr int kTensorSide = 2 * kTensorRadius + 1;
constexpr int kPerCell = 2;  ///< Corners in a cell of the grid that spreads them.

/// Products of an image's gradients, one image each.
struct GradientProducts {
  ImageF xx, xy, yy;
};

GradientProducts gradient_products(const ImageF& image) {
  const int w = image.width();
  const int h = image.height();
  GradientProducts out{ImageF(w, h), ImageF(w, h), ImageF(w, h)};
  for (int y = 1; y + 1 < h; ++y) {
    const float* above = image.row(y - 1);
    const float* row = image.row(y);
    const float* below = image.row(y + 1);
    for (int x = 1; x + 1 < w; ++x) {
      const float gx = 0.5F * (row[x + 1] - row[x - 1]);
      const float gy = 0.5F * (below[x] - above[x]);
      out.xx.at(x, y) = gx * gx;
      out.xy.at(x, y) = gx * gy;
      out.yy.at(x, y) = gy * gy;
    }
  }
  return out;
}

/// Sums over columns of kTensorSide pixels around row `y`.
void sum_columns(const ImageF& image, int y, std::vector<float>* sums) {
  sums->assign(static_cast<std::size_t>(image.width()), 0.0F);
  for (int k = -kTensorRadius; k <= kTensorRadius; ++k) {
    const float* row = image.row(y + k);
    for (std::size_t x = 0; x < sums->size(); ++x) (*sums)[x] += row[x];
  }
}

float sum_around(const std::vector<float>& columns, int x) {
  float sum = 0.0F;
  for (int k = -kTensorRadius; k <= kTensorRadius; ++k) {
    sum += columns[static_cast<std::size_t>(x + k)];
  }
  return sum;
}

bool is_maximum(const ImageF& response, int x, int y) {
  const float r = response.at(x, y);
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      // Of equal neighbours the first one is taken.
      const bool before = dy < 0 || (dy == 0 && dx < 0);
      const float other = response.at(x + dx, y + dy);
      if (other > r || (before && other == r)) return false;
    }
  }
  return true;
}

bool is_masked(const CornerRequest& request, int x, int y) {
  const ImageU8& mask = request.mask;
  return !mask.empty() && mask.at(std::min(x << request.level, mask.width() - 1),
                                  std::min(y << request.level, mask.height() - 1)) == 0;
}

}  // namespace

ImageF corner_response(const ImageF& image) {
  const int w = image.width();
  const int h = image.height();
  constexpr int kReach = kTensorRadius + 1;
  const GradientProducts products = gradient_products(image);
  ImageF response(w, h);
  std::vector<float> xx;
  std::vector<float> xy;
  std::vector<float> yy;
  for (int y = kReach; y + kReach < h; ++y) {
    sum_columns(products.xx, y, &xx);
    sum_columns(products.xy, y, &xy);
    sum_columns(products.yy, y, &yy);
    for (int x = kReach; x + kReach < w; ++x) {
      const float a = sum_around(xx, x);
      const float b = sum_around(xy, x);
      const float c = sum_around(yy, x);
      const float half = 0.5F * (a - c);
      response.at(x, y) =
          (0.5F * (a + c) - std::sqrt(half * half + b * b)) / (kTensorSide * kTensorSide);
    }
  }
  return response;
}

std::vector<Corner> spread_corners(const ImageF& response, const CornerRequest& request) {
  const int w = response.width();
  const int h = response.height();
  const int border = std::max(request.border, 1);
  const int wanted = request.wanted;
  if (w <= 2 * border || h <= 2 * border || wanted <= 0) return {};
  const double area = static_cast<double>(w) * h;
  const int side = std::max(8, static_cast<int>(std::sqrt(area * kPerCell / wanted)));
  const int columns = (w + side - 1) / side;
  const int rows = (h + side - 1) / side;
  std::vector<std::array<Corner, kPerCell>> cells(static_cast<std::size_t>(columns) * rows);
  for (int y = border; y < h - border; ++y) {
    for (int x = border; x < w - border; ++x) {
      const float r = response.at(x, y);
      if (r < request.least || !is_maximum(response, x, y)) continue;
      if (is_masked(request, x, y)) {
        continue;
      }
      auto& cell = cells[static_cast<std::size_t>(y / side) * columns + x / side];
      Corner corner{r, x, y};
      for (Corner& kept : cell) {
        if (corner.response > kept.response) std::swap(corner, kept);
      }
    }
  }
  std::vector<Corner> corners;
  for (const auto& cell : cells) {
    std::copy_if(cell.begin(), cell.end(), std::back_inserter(corners),
                 [](const Corner& c) { return c.response > 0.0F; });
  }
  std::stable_sort(corners.begin(), corners.end(),
                   [](const Corner& a, const Corner& b) { return a.response > b.response; });
  if (corners.size() > static_cast<std::size_t>(wanted)) {
    corners.resize(static_cast<std::size_t>(wanted));
  }
  return corners;
}

}  // namespace sovo
