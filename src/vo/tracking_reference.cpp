#include "sovo/vo/tracking_reference.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "sovo/image/halving.h"

namespace sovo {

namespace {

constexpr int kBorder = 2;

/// Weighted inverse depth of a pixel: sums of rho * w and of w.
struct Cell {
  int x = 0, y = 0;
  float sum = 0.0F, weight = 0.0F;
};

/// Inverse depths of one level, sparse: the cells from left to right, row after row.
class DepthMap {
 public:
  DepthMap(int width, int height) : width_(width), begins_(static_cast<std::size_t>(height) + 1) {}

  int width() const { return width_; }
  int height() const { return static_cast<int>(begins_.size()) - 1; }
  std::span<const Cell> row(int y) const {
    const std::size_t begin = begins_[static_cast<std::size_t>(y)];
    return {cells_.data() + begin, begins_[static_cast<std::size_t>(y) + 1] - begin};
  }
  std::size_t size() const { return cells_.size(); }

  void reserve(std::size_t cells) { cells_.reserve(cells); }
  /// Appends to the row at hand. A cell beside the image is left out.
  void add(const Cell& cell) {
    if (cell.x >= 0 && cell.x < width_) cells_.push_back(cell);
  }
  /// Closes row y, the one at hand: sorts it and adds up what fell into one pixel, in the order in
  /// which it did.
  void close_row(int y) {
    const auto begin = cells_.begin() + begins_[static_cast<std::size_t>(y)];
    // By insertion: rows are short, and this neither swaps equals nor allocates.
    for (auto next = begin; next != cells_.end(); ++next) {
      const auto place = std::upper_bound(begin, next, next->x,
                                          [](int x, const Cell& cell) { return x < cell.x; });
      std::rotate(place, next, next + 1);
    }
    auto kept = begin;
    for (auto cell = begin; cell != cells_.end(); ++cell) {
      if (kept != begin && (kept - 1)->x == cell->x) {
        (kept - 1)->sum += cell->sum;
        (kept - 1)->weight += cell->weight;
      } else {
        *kept++ = *cell;
      }
    }
    cells_.erase(kept, cells_.end());
    begins_[static_cast<std::size_t>(y) + 1] = static_cast<std::uint32_t>(cells_.size());
  }

 private:
  int width_;
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> begins_;  ///< Of the rows among the cells, and the end.
};

/// Window points in the newest keyframe, as they come; their number is `count`.
std::vector<Cell> project_points(const Window& window, std::size_t* count) {
  const Keyframe& newest = window.newest();
  const auto slot = static_cast<std::size_t>(newest.slot);
  const double rho_unit = window.mean_inverse_depth();
  std::vector<Cell> cells;
  cells.reserve(static_cast<std::size_t>(window.num_active_points()));
  *count = 0;
  const auto add = [&](float u, float v, float rho, float w) {
    cells.push_back({static_cast<int>(u + 0.5F), static_cast<int>(v + 0.5F), rho * w, w});
    ++*count;
  };
  for (int h = 0; h < window.size(); ++h) {
    for (const Point& p : window[h].points) {
      const double information = depth_information(p, rho_unit) * rho_unit * rho_unit;
      const auto weight = static_cast<float>(std::sqrt(1e-3 * (information + 1e-6)));
      if (h + 1 == window.size()) {
        add(p.u, p.v, static_cast<float>(p.rho), weight);
        continue;
      }
      const Residual& r = p.residuals[slot];
      if (r.state == ResidualState::kIn) add(r.centre_u, r.centre_v, r.centre_rho, weight);
    }
  }
  return cells;
}

DepthMap splat(const Window& window, std::size_t* count) {
  const std::vector<Cell> cells = project_points(window, count);
  const int height = window.newest().image().height();
  // Sorted by counting how many come before each row.
  std::vector<std::uint32_t> ends(static_cast<std::size_t>(height) + 1);
  const auto is_inside = [height](const Cell& c) { return c.y >= 0 && c.y < height; };
  for (const Cell& c : cells) {
    if (is_inside(c)) ++ends[static_cast<std::size_t>(c.y) + 1];
  }
  std::partial_sum(ends.begin(), ends.end(), ends.begin());
  std::vector<Cell> by_row(ends.back());
  for (const Cell& c : cells) {
    if (is_inside(c)) by_row[ends[static_cast<std::size_t>(c.y)]++] = c;
  }
  DepthMap map(window.newest().image().width(), height);
  map.reserve(by_row.size());
  auto next = by_row.begin();
  for (int y = 0; y < height; ++y) {
    for (; next != by_row.end() && next->y == y; ++next) map.add(*next);
    map.close_row(y);
  }
  return map;
}

DepthMap sum_down(const DepthMap& fine) {
  DepthMap coarse(fine.width() / 2, fine.height() / 2);
  coarse.reserve(fine.size());
  for (int y = 0; y < coarse.height(); ++y) {
    for (const int fine_y : {2 * y, 2 * y + 1}) {
      for (const Cell& c : fine.row(fine_y)) coarse.add({c.x / 2, y, c.sum, c.weight});
    }
    coarse.close_row(y);
  }
  return coarse;
}

/// Three rows of a depth map side by side as dense arrays, and which pixels of the middle one get
/// a depth.
class DenseRows {
 public:
  explicit DenseRows(const DepthMap& map)
      : map_(map), wanted_(static_cast<std::size_t>(map.width()) / 64 + 1) {
    for (auto& row : dense_) row.resize(static_cast<std::size_t>(map.width()));
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
        if (x >= 1 && x + 1 < map_.width()) visit(at(x, y));
      }
    }
    clear(y - 1);
  }

 private:
  using Offset = std::array<int, 2>;

  std::vector<Cell>& dense(int y) { return dense_[static_cast<std::size_t>(y) % 3]; }
  std::span<const Cell> sparse(int y) const { return map_.row(y); }
  void fill(int y) {
    for (const Cell& cell : sparse(y)) dense(y)[static_cast<std::size_t>(cell.x)] = cell;
  }
  void clear(int y) {
    for (const Cell& cell : sparse(y)) dense(y)[static_cast<std::size_t>(cell.x)] = {};
  }
  void want(int x) {
    if (x < 0 || x >= map_.width()) return;
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
    Cell mean{.x = x, .y = y};
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

/// A pixel and its neighbours, some of which are shared.
constexpr std::size_t kDenseGrowth = 4;

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
    for (const Cell& cell : map.row(y)) add_point(image, y, cell, level);
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
  ref.rows = newest.rows;
  ref.T_world_camera = newest.T_world_camera();
  ref.levels.resize(static_cast<std::size_t>(num_levels));

  DepthMap map = splat(window, &ref.num_window_points);
  for (int l = 0; l < num_levels; ++l) {
    if (l > 0) map = sum_down(map);
    ReferenceLevel& level = ref.levels[static_cast<std::size_t>(l)];
    level.camera = window.camera().at_level(l);
    const auto extract = l < kSparseLevels ? extract_sparse : extract_dense;
    for (auto* values : {&level.u, &level.v, &level.rho, &level.colour}) {
      values->reserve(l < kSparseLevels ? map.size() : kDenseGrowth * map.size());
    }
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

double lower_gradient(const ImageF& image, std::span<const float> u, std::span<const float> v) {
  std::vector<float> squared;
  squared.reserve(u.size());
  for (std::size_t i = 0; i < u.size(); ++i) {
    const int x = static_cast<int>(u[i]);
    const int y = static_cast<int>(v[i]);
    const float gx = image.at(x + 1, y) - image.at(x - 1, y);
    const float gy = image.at(x, y + 1) - image.at(x, y - 1);
    squared.push_back(gx * gx + gy * gy);
  }
  const auto quarter = squared.begin() + static_cast<std::ptrdiff_t>(squared.size() / 4);
  std::nth_element(squared.begin(), quarter, squared.end());
  return 0.5 * std::sqrt(static_cast<double>(*quarter));
}

double threshold_share(const WeakTextureConfig& config, double gradient, double cutoff,
                       double rmse) {
  const double texture = std::clamp(
      (gradient - config.to_gradient) / (config.from_gradient - config.to_gradient), 0.0, 1.0);
  const double weak = config.least_share + (1.0 - config.least_share) * texture;
  return std::clamp(config.least_rms * rmse / cutoff, weak, 1.0);
}

TrackingReference moved_by_rows(const TrackingReference& reference, const RowShift& rows,
                                const SE3& T_current_reference) {
  TrackingReference out = reference;
  const PairRowShift shift(T_current_reference, reference.rows, rows);
  const Eigen::Matrix3f R = T_current_reference.rotation_matrix().cast<float>();
  const Eigen::Vector3f t = T_current_reference.translation().cast<float>();
  for (std::size_t l = 0; l < out.levels.size(); ++l) {
    ReferenceLevel& level = out.levels[l];
    const auto fx = static_cast<float>(level.camera.fx), fy = static_cast<float>(level.camera.fy);
    const auto cx = static_cast<float>(level.camera.cx), cy = static_cast<float>(level.camera.cy);
    const auto height = static_cast<float>(level.camera.height);
    const int halvings = static_cast<int>(l);
    for (std::size_t i = 0; i < level.size(); ++i) {
      const float row = level.v[i];
      Eigen::Vector3f p((level.u[i] - cx) / fx, (row - cy) / fy, 1.0F);
      const Eigen::Vector3f seen = R * p + level.rho[i] * t;
      const float seen_row =
          seen.z() > 0.0F ? std::clamp(fy * seen.y() / seen.z() + cy, 0.0F, height) : row;
      const auto moved = shift.at(from_halved(row, halvings), from_halved(seen_row, halvings));
      p += level.rho[i] * (R.transpose() * (moved.applied(t) - t));
      if (!(p.z() > 0.0F)) continue;
      level.u[i] = fx * p.x() / p.z() + cx;
      level.v[i] = fy * p.y() / p.z() + cy;
      level.rho[i] /= p.z();
    }
  }
  return out;
}

TrackingReference rescaled(const TrackingReference& reference, double scale) {
  TrackingReference out = reference;
  out.rows.per_row *= scale;
  rescale(scale, &out);
  for (ReferenceLevel& level : out.levels) {
    for (float& rho : level.rho) rho /= static_cast<float>(scale);
  }
  return out;
}

}  // namespace sovo
