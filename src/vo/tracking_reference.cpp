#include "sovo/vo/tracking_reference.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace sovo {

namespace {

constexpr int kBorder = 2;

/// Weighted inverse depth of a pixel: sums of rho * w and of w.
struct Cell {
  int x = 0;
  float sum = 0.0F, weight = 0.0F;
};

/// Inverse depths of one level, sparse: the cells of each row from left to right.
struct DepthMap {
  int width = 0;
  std::vector<std::vector<Cell>> rows;

  DepthMap(int w, int h) : width(w), rows(static_cast<std::size_t>(h)) {}
  int height() const { return static_cast<int>(rows.size()); }

  void add(float u, float v, float rho, float w) {
    const int x = static_cast<int>(u + 0.5F);
    const int y = static_cast<int>(v + 0.5F);
    if (x < 0 || y < 0 || x >= width || y >= height()) return;
    rows[static_cast<std::size_t>(y)].push_back({x, rho * w, w});
  }
};

/// Sorts a row and adds up what fell into one pixel, in the order in which it did.
void merge(std::vector<Cell>* row) {
  std::stable_sort(row->begin(), row->end(),
                   [](const Cell& a, const Cell& b) { return a.x < b.x; });
  std::size_t kept = 0;
  for (const Cell& cell : *row) {
    if (kept > 0 && (*row)[kept - 1].x == cell.x) {
      (*row)[kept - 1].sum += cell.sum;
      (*row)[kept - 1].weight += cell.weight;
    } else {
      (*row)[kept++] = cell;
    }
  }
  row->resize(kept);
}

DepthMap splat(const Window& window, std::size_t* count) {
  const Keyframe& newest = window.newest();
  const auto slot = static_cast<std::size_t>(newest.slot);
  const double rho_unit = window.mean_inverse_depth();
  DepthMap map(newest.image().width(), newest.image().height());
  *count = 0;
  for (int h = 0; h < window.size(); ++h) {
    for (const Point& p : window[h].points) {
      const double information = depth_information(p, rho_unit) * rho_unit * rho_unit;
      const auto weight = static_cast<float>(std::sqrt(1e-3 * (information + 1e-6)));
      if (h + 1 == window.size()) {
        map.add(p.u, p.v, static_cast<float>(p.rho), weight);
        ++*count;
        continue;
      }
      const Residual& r = p.residuals[slot];
      if (r.state != ResidualState::kIn) continue;
      map.add(r.centre_u, r.centre_v, r.centre_rho, weight);
      ++*count;
    }
  }
  for (auto& row : map.rows) merge(&row);
  return map;
}

DepthMap sum_down(const DepthMap& fine) {
  DepthMap coarse(fine.width / 2, fine.height() / 2);
  for (std::size_t y = 0; y < coarse.rows.size(); ++y) {
    std::vector<Cell>& row = coarse.rows[y];
    for (const std::size_t fine_y : {2 * y, 2 * y + 1}) {
      for (const Cell& cell : fine.rows[fine_y]) {
        if (cell.x / 2 < coarse.width) row.push_back({cell.x / 2, cell.sum, cell.weight});
      }
    }
    merge(&row);
  }
  return coarse;
}

/// Three rows of a depth map side by side as dense arrays, and which pixels of the middle one get
/// a depth.
class DenseRows {
 public:
  explicit DenseRows(const DepthMap& map)
      : map_(map), wanted_(static_cast<std::size_t>(map.width) / 64 + 1) {
    for (auto& row : dense_) row.resize(static_cast<std::size_t>(map.width));
    fill(0);
  }

  /// Calls visit(cell) for every pixel of row y that has a depth or gets one: the mean of its
  /// filled neighbours in its row and column. Rows ascend from 1, x ascends.
  template <class Visit>
  void for_each(int y, const Visit& visit) {
    if (y == 1) fill(1);
    fill(y + 1);
    for (int row = y - 1; row <= y + 1; ++row) mark(row, row == y);
    for (std::size_t word = 0; word < wanted_.size(); ++word) {
      for (std::uint64_t bits = std::exchange(wanted_[word], 0); bits != 0; bits &= bits - 1) {
        const int x = static_cast<int>(word * 64) + std::countr_zero(bits);
        if (x >= 1 && x + 1 < map_.width) visit(at(x, y));
      }
    }
    clear(y - 1);
  }

 private:
  using Offset = std::array<int, 2>;

  std::vector<Cell>& dense(int y) { return dense_[static_cast<std::size_t>(y) % 3]; }
  const std::vector<Cell>& sparse(int y) const { return map_.rows[static_cast<std::size_t>(y)]; }
  void fill(int y) {
    for (const Cell& cell : sparse(y)) dense(y)[static_cast<std::size_t>(cell.x)] = cell;
  }
  void clear(int y) {
    for (const Cell& cell : sparse(y)) dense(y)[static_cast<std::size_t>(cell.x)] = {};
  }
  void want(int x) {
    if (x < 0 || x >= map_.width) return;
    wanted_[static_cast<std::size_t>(x) / 64] |= std::uint64_t{1} << static_cast<unsigned>(x) % 64;
  }
  void mark(int row, bool middle) {
    for (const Cell& cell : sparse(row)) {
      want(cell.x);
      if (middle) {
        want(cell.x - 1);
        want(cell.x + 1);
      }
    }
  }
  Cell at(int x, int y) {
    const Cell& own = dense(y)[static_cast<std::size_t>(x)];
    if (own.weight > 0.0F) return own;
    constexpr std::array<Offset, 4> kNeighbours = {{{0, -1}, {-1, 0}, {1, 0}, {0, 1}}};
    Cell mean{.x = x};
    int n = 0;
    for (const Offset& o : kNeighbours) {
      const Cell& cell = dense(y + o[1])[static_cast<std::size_t>(x + o[0])];
      if (cell.weight <= 0.0F) continue;
      mean.sum += cell.sum;
      mean.weight += cell.weight;
      ++n;
    }
    if (n == 0) return mean;
    mean.sum /= static_cast<float>(n);
    mean.weight /= static_cast<float>(n);
    return mean;
  }

  const DepthMap& map_;
  std::array<std::vector<Cell>, 3> dense_;
  std::vector<std::uint64_t> wanted_;
};

/// Levels that have points enough as they are: neighbours would cost more than they add.
constexpr int kSparseLevels = 2;

/// Appends a pixel, if it can be tracked.
void add_point(const ImageF& image, int y, const Cell& cell, ReferenceLevel* level) {
  const bool inside = cell.x >= kBorder && cell.x < image.width() - kBorder;
  if (!inside || cell.weight <= 0.0F) return;
  const float rho = cell.sum / cell.weight;
  const float colour = image.at(cell.x, y);
  if (!(rho > 0.0F) || !std::isfinite(colour)) return;
  level->u.push_back(static_cast<float>(cell.x));
  level->v.push_back(static_cast<float>(y));
  level->rho.push_back(rho);
  level->colour.push_back(colour);
}

/// Points of a level: the pixels with a depth.
void extract_sparse(const DepthMap& map, const ImageF& image, ReferenceLevel* level) {
  for (int y = kBorder; y < image.height() - kBorder; ++y) {
    for (const Cell& cell : map.rows[static_cast<std::size_t>(y)]) {
      add_point(image, y, cell, level);
    }
  }
}

/// And their empty neighbours.
void extract_dense(const DepthMap& map, const ImageF& image, ReferenceLevel* level) {
  DenseRows rows(map);
  for (int y = 1; y < image.height() - kBorder; ++y) {
    rows.for_each(y, [&](Cell cell) {
      if (y >= kBorder) add_point(image, y, cell, level);
    });
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

  DepthMap map = splat(window, &ref.num_window_points);
  for (int l = 0; l < num_levels; ++l) {
    if (l > 0) map = sum_down(map);
    ReferenceLevel& level = ref.levels[static_cast<std::size_t>(l)];
    level.camera = window.camera().at_level(l);
    const auto extract = l < kSparseLevels ? extract_sparse : extract_dense;
    extract(map, newest.pyramid->level(l), &level);
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
