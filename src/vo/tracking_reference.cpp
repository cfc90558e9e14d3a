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
#include "sovo/image/interpolation.h"
#include "sovo/vo/pattern.h"

namespace sovo {

namespace {

constexpr int kBorder = 2;

/// Inverse depths of one level, sparse: the cells from left to right, row after row.
class DepthMap {
 public:
  DepthMap(int width, int height) : width_(width), begins_(static_cast<std::size_t>(height) + 1) {}

  int width() const { return width_; }
  int height() const { return static_cast<int>(begins_.size()) - 1; }
  std::span<const SeenPoint> row(int y) const {
    const std::size_t begin = begins_[static_cast<std::size_t>(y)];
    return {cells_.data() + begin, begins_[static_cast<std::size_t>(y) + 1] - begin};
  }
  std::size_t size() const { return cells_.size(); }

  void reserve(std::size_t cells) { cells_.reserve(cells); }
  /// Appends to the row at hand. A cell beside the image is left out.
  void add(const SeenPoint& cell) {
    if (cell.x >= 0 && cell.x < width_) cells_.push_back(cell);
  }
  /// Closes row y, the one at hand: sorts it and adds up what fell into one pixel, in the order in
  /// which it did.
  void close_row(int y) {
    const auto begin = cells_.begin() + begins_[static_cast<std::size_t>(y)];
    // By insertion: rows are short, and this neither swaps equals nor allocates.
    for (auto next = begin; next != cells_.end(); ++next) {
      const auto place = std::upper_bound(begin, next, next->x,
                                          [](int x, const SeenPoint& cell) { return x < cell.x; });
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
  std::vector<SeenPoint> cells_;
  std::vector<std::uint32_t> begins_;  ///< Of the rows among the cells, and the end.
};

float splat_weight(double depth_information) {
  return static_cast<float>(std::sqrt(1e-3 * (depth_information + 1e-6)));
}

SeenPoint seen_point(float u, float v, float rho, float weight) {
  return {static_cast<int>(u + 0.5F), static_cast<int>(v + 0.5F), rho * weight, weight};
}

DepthMap splat(const Window& window, std::span<const SeenPoint> points) {
  const int height = window.newest().image().height();
  // Sorted by counting how many come before each row.
  std::vector<std::uint32_t> ends(static_cast<std::size_t>(height) + 1);
  const auto is_inside = [height](const SeenPoint& c) { return c.y >= 0 && c.y < height; };
  for (const SeenPoint& c : points) {
    if (is_inside(c)) ++ends[static_cast<std::size_t>(c.y) + 1];
  }
  std::partial_sum(ends.begin(), ends.end(), ends.begin());
  std::vector<SeenPoint> by_row(ends.back());
  for (const SeenPoint& c : points) {
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
      for (const SeenPoint& c : fine.row(fine_y)) coarse.add({c.x / 2, y, c.sum, c.weight});
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

  std::vector<SeenPoint>& dense(int y) { return dense_[static_cast<std::size_t>(y) % 3]; }
  std::span<const SeenPoint> sparse(int y) const { return map_.row(y); }
  void fill(int y) {
    for (const SeenPoint& cell : sparse(y)) dense(y)[static_cast<std::size_t>(cell.x)] = cell;
  }
  void clear(int y) {
    for (const SeenPoint& cell : sparse(y)) dense(y)[static_cast<std::size_t>(cell.x)] = {};
  }
  void want(int x) {
    if (x < 0 || x >= map_.width()) return;
    wanted_[static_cast<std::size_t>(x) / 64] |= std::uint64_t{1} << static_cast<unsigned>(x) % 64;
  }
  void mark(int row, bool middle) {
    for (const SeenPoint& cell : sparse(row)) {
      want(cell.x);
      if (middle) {
        want(cell.x - 1);
        want(cell.x + 1);
      }
    }
  }
  SeenPoint at(int x, int y) {
    const SeenPoint& own = dense(y)[static_cast<std::size_t>(x)];
    if (own.weight > 0.0F) return own;
    constexpr std::array<Offset, 4> kNeighbours = {{{0, -1}, {-1, 0}, {1, 0}, {0, 1}}};
    SeenPoint mean{.x = x, .y = y};
    int n = 0;
    for (const Offset& o : kNeighbours) {
      const SeenPoint& cell = dense(y + o[1])[static_cast<std::size_t>(x + o[0])];
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
  std::array<std::vector<SeenPoint>, 3> dense_;
  std::vector<std::uint64_t> wanted_;
};

/// A pixel and its neighbours, some of which are shared.
constexpr std::size_t kDenseGrowth = 4;

/// Levels that have points enough as they are: neighbours would cost more than they add.
constexpr int kSparseLevels = 2;

/// An edge that is off by a tenth of a pixel errs by more grey levels than a weak texture shows at
/// all, which then would say nothing beside it.
float gradient_weight(const ImageF& image, int x, int y, float gradient_constant) {
  const float gx = 0.5F * (image.at(x + 1, y) - image.at(x - 1, y));
  const float gy = 0.5F * (image.at(x, y + 1) - image.at(x, y - 1));
  const float squared = gradient_constant * gradient_constant;
  return squared / (squared + gx * gx + gy * gy);
}

/// One in the mean, so that residuals keep their unit.
void normalize(AlignedVector<float>* weights) {
  double sum = 0.0;
  for (const float w : *weights) sum += static_cast<double>(w);
  if (!(sum > 0.0)) return;
  const auto factor = static_cast<float>(static_cast<double>(weights->size()) / sum);
  for (float& w : *weights) w *= factor;
}

/// Appends a pixel, if it can be tracked.
void add_point(const ImageF& image, int y, const SeenPoint& cell, float gradient_constant,
               ReferenceLevel* level) {
  const bool inside = cell.x >= kBorder && cell.x < image.width() - kBorder;
  if (!inside || cell.weight <= 0.0F) return;
  const float rho = cell.sum / cell.weight;
  const float colour = image.at(cell.x, y);
  if (!(rho > 0.0F) || !std::isfinite(colour)) return;
  level->u.push_back(static_cast<float>(cell.x));
  level->v.push_back(static_cast<float>(y));
  level->rho.push_back(rho);
  level->colour.push_back(colour);
  level->weight.push_back(gradient_weight(image, cell.x, y, gradient_constant));
}

/// Points of a level: the pixels with a depth.
void extract_sparse(const DepthMap& map, const ImageF& image, float gradient_constant,
                    ReferenceLevel* level) {
  for (int y = kBorder; y < image.height() - kBorder; ++y) {
    for (const SeenPoint& cell : map.row(y)) add_point(image, y, cell, gradient_constant, level);
  }
}

/// And their empty neighbours.
void extract_dense(const DepthMap& map, const ImageF& image, float gradient_constant,
                   ReferenceLevel* level) {
  DenseRows rows(map);
  for (int y = 1; y < image.height() - kBorder; ++y) {
    rows.for_each(y, [&](SeenPoint cell) {
      if (y >= kBorder) add_point(image, y, cell, gradient_constant, level);
    });
  }
}

}  // namespace

std::vector<SeenPoint> active_points(const Window& window) {
  const auto slot = static_cast<std::size_t>(window.newest().slot);
  const double rho_unit = window.mean_inverse_depth();
  std::vector<SeenPoint> seen;
  seen.reserve(static_cast<std::size_t>(window.num_active_points()));
  for (int h = 0; h < window.size(); ++h) {
    for (const Point& p : window[h].points) {
      const float weight = splat_weight(depth_information(p, rho_unit) * rho_unit * rho_unit);
      if (h + 1 == window.size()) {
        seen.push_back(seen_point(p.u, p.v, static_cast<float>(p.rho), weight));
        continue;
      }
      const Residual& r = p.residuals[slot];
      if (r.state != ResidualState::kIn) continue;
      seen.push_back(seen_point(r.centre_u, r.centre_v, r.centre_rho, weight));
    }
  }
  return seen;
}

std::vector<SeenPoint> matched_points(const Window& window) {
  std::vector<SeenPoint> seen;
  for (const ImmaturePoint& p : window.newest().immature) {
    const float rho = 0.5F * (p.rho_min + p.rho_max);
    if (!knows_depth(static_cast<double>(p.static_information), static_cast<double>(rho))) continue;
    const float weight = splat_weight(static_cast<double>(p.static_information));
    seen.push_back(seen_point(p.u, p.v, rho, weight));
  }
  return seen;
}

TrackingReference build_tracking_reference(const Window& window, std::span<const SeenPoint> points,
                                           int num_levels, double gradient_constant) {
  const Keyframe& newest = window.newest();
  TrackingReference ref;
  ref.keyframe_id = newest.id;
  ref.stamp_ns = newest.stamp_ns;
  ref.exposure_s = newest.exposure_s;
  ref.affine = newest.affine;
  ref.shift = newest.shift;
  ref.pyramid = newest.pyramid;
  ref.T_world_camera = newest.T_world_camera();
  ref.levels.resize(static_cast<std::size_t>(num_levels));

  ref.num_window_points = points.size();
  DepthMap map = splat(window, points);
  for (int l = 0; l < num_levels; ++l) {
    if (l > 0) map = sum_down(map);
    ReferenceLevel& level = ref.levels[static_cast<std::size_t>(l)];
    level.camera = window.camera().at_level(l);
    const auto extract = l < kSparseLevels ? extract_sparse : extract_dense;
    for (auto* values : {&level.u, &level.v, &level.rho, &level.colour, &level.weight}) {
      values->reserve(l < kSparseLevels ? map.size() : kDenseGrowth * map.size());
    }
    extract(map, newest.pyramid->level(l), static_cast<float>(gradient_constant), &level);
    normalize(&level.weight);
  }
  double sum = 0.0;
  for (const float rho : ref.levels[0].rho) sum += rho;
  if (sum > 0.0) ref.mean_rho = sum / static_cast<double>(ref.levels[0].size());
  for (int i = 0; i < window.size(); ++i) {
    ref.keyframe_poses.push_back({window[i].id, window[i].stamp_ns, window[i].T_world_camera()});
  }
  return ref;
}

ReferenceLevel with_patterns(const ReferenceLevel& points, const ImageF& image) {
  ReferenceLevel out;
  out.camera = points.camera;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const PatternOffset& o : kPattern) {
      const float u = points.u[i] + o.x;
      const float v = points.v[i] + o.y;
      if (!in_image(image, u, v)) continue;
      out.u.push_back(u);
      out.v.push_back(v);
      out.rho.push_back(points.rho[i]);
      out.colour.push_back(image.at(static_cast<int>(u), static_cast<int>(v)));
      out.weight.push_back(points.weight[i]);
    }
  }
  return out;
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

TrackingReference moved_by_shift(const TrackingReference& reference, const ViewShift& rows,
                                 const SE3& T_current_reference) {
  TrackingReference out = reference;
  const PairViewShift shift(T_current_reference, reference.shift, rows);
  const Eigen::Matrix3f R = T_current_reference.rotation_matrix().cast<float>();
  const Eigen::Vector3f t = T_current_reference.translation().cast<float>();
  const int whole_width = reference.levels[0].camera.width;
  const int whole_height = reference.levels[0].camera.height;
  for (std::size_t l = 0; l < out.levels.size(); ++l) {
    ReferenceLevel& level = out.levels[l];
    const auto fx = static_cast<float>(level.camera.fx), fy = static_cast<float>(level.camera.fy);
    const auto cx = static_cast<float>(level.camera.cx), cy = static_cast<float>(level.camera.cy);
    const int halvings = static_cast<int>(l);
    for (std::size_t i = 0; i < level.size(); ++i) {
      const Eigen::Vector2f pixel(level.u[i], level.v[i]);
      Eigen::Vector3f p((pixel.x() - cx) / fx, (pixel.y() - cy) / fy, 1.0F);
      const Eigen::Vector3f seen = R * p + level.rho[i] * t;
      const auto whole = [halvings](float at) { return from_halved(at, halvings); };
      const Eigen::Vector3f seen_at(whole(fx * seen.x() / seen.z() + cx),
                                    whole(fy * seen.y() / seen.z() + cy),
                                    seen.z() > 0.0F ? 1.0F : -1.0F);
      const auto moved =
          shift.at({whole(pixel.x()), whole(pixel.y())}, seen_at, whole_width, whole_height);
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
  out.shift.per_row *= scale;
  rescale(scale, &out);
  for (ReferenceLevel& level : out.levels) {
    for (float& rho : level.rho) rho /= static_cast<float>(scale);
  }
  return out;
}

}  // namespace sovo
