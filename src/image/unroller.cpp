#include "sovo/image/unroller.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>

#include "sovo/geometry/so3.h"
#include "sovo/image/lanes.h"

namespace sovo {

namespace {

/// A row of the result; `node_x` and `node_y` hold displacements every `Step` pixels.
template <int Step>
struct UnrollRow {
  template <class F>
  SOVO_LANE_FUNCTION static void run(const ImageF& raw, const float* x, const float* y,
                                     const float* node_x, const float* node_y, int width,
                                     float* out) {
    constexpr int n = static_cast<int>(lanes_of<F>);
    static_assert(Step % n == 0);
    const F right = lane_of<F>(static_cast<float>(raw.width()) - 1.001F);
    const F bottom = lane_of<F>(static_cast<float>(raw.height()) - 1.001F);
    const F zero{};
    F along{};
    for (int k = 0; k < n; ++k) along[k] = static_cast<float>(k) / Step;
    for (int i = 0; i < width; i += n) {
      const int node = i / Step;
      const F part = along + static_cast<float>(i % Step) / Step;
      const F dx = node_x[node] + part * (node_x[node + 1] - node_x[node]);
      const F dy = node_y[node] + part * (node_y[node + 1] - node_y[node]);
      const F u = load_lane<F>(x + i) + dx;
      const F v = load_lane<F>(y + i) + dy;
      store_lane(sample_lanes<F>(raw, min_lane(right, F(u > zero ? u : zero)),
                                 min_lane(bottom, F(v > zero ? v : zero))),
                 out + i);
    }
  }
};

}  // namespace

Unroller::Unroller(const CameraModel& raw, const CameraModel& result)
    : raw_(raw),
      result_(result),
      nodes_x_((static_cast<std::size_t>(result.width) + kStep - 1) / kStep + 1),
      nodes_y_((static_cast<std::size_t>(result.height) + kStep - 1) / kStep + 1) {
  const bool same = raw.distortion == result.distortion && raw.fx == result.fx &&
                    raw.fy == result.fy && raw.cx == result.cx && raw.cy == result.cy &&
                    raw.straightened == result.straightened;
  x_.assign(stride() * static_cast<std::size_t>(result.height), 0.0F);
  y_ = x_;
  for (int y = 0; y < result.height; ++y) {
    for (int x = 0; x < result.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * stride() + static_cast<std::size_t>(x);
      std::optional<Vec2> source(Vec2(x, y));
      if (!same) {
        const auto ray = result.unproject({x, y});
        source = ray ? raw.project(*ray) : std::nullopt;
      }
      if (!source) continue;
      x_[i] = static_cast<float>(source->x());
      y_[i] = static_cast<float>(source->y());
    }
  }
  fit_rows();
}

/// The best line raw row = a + b * row, over pixels that have a source.
void Unroller::fit_rows() {
  Mat2 H = Mat2::Zero();
  Vec2 b = Vec2::Zero();
  for (int y = 0; y < result_.height; y += 4) {
    for (int x = 0; x < result_.width; x += 4) {
      const std::size_t i = static_cast<std::size_t>(y) * stride() + static_cast<std::size_t>(x);
      if (!raw_.contains({static_cast<double>(x_[i]), static_cast<double>(y_[i])})) continue;
      const Vec2 row(1.0, y);
      H += row * row.transpose();
      b += static_cast<double>(y_[i]) * row;
    }
  }
  const Vec2 line = H.inverse() * b;
  raw_rows_ = line[1];
  middle_row_ = (0.5 * (raw_.height - 1) - line[0]) / line[1];
}

void Unroller::place_lattice(const Vec3& turn, Lattice* lattice) const {
  lattice->x.assign(nodes_x_ * nodes_y_, 0.0F);
  lattice->y.assign(nodes_x_ * nodes_y_, 0.0F);
  const double last = raw_.height - 1;
  for (std::size_t k = 0; k < lattice->x.size(); ++k) {
    const auto i = static_cast<int>(k % nodes_x_);
    const auto j = static_cast<int>(k / nodes_x_);
    const Vec2 pixel(std::min(i * kStep, result_.width - 1),
                     std::min(j * kStep, result_.height - 1));
    const auto ray = result_.unproject(pixel);
    const auto still = ray ? raw_.project(*ray) : std::nullopt;
    if (!still) continue;
    Vec2 moved = *still;
    // The row where it shows tells when, and that how far the ray has turned.
    for (int iteration = 0; iteration < 2; ++iteration) {
      const double share = std::clamp(moved.y() / last, 0.0, 1.0) - 0.5;
      const auto seen = raw_.project(SO3::exp(share * turn) * *ray);
      if (!seen) break;
      moved = *seen;
    }
    lattice->x[k] = static_cast<float>(moved.x() - still->x());
    lattice->y[k] = static_cast<float>(moved.y() - still->y());
  }
}

void Unroller::apply(const ImageF& raw, const Vec3& turn, Lattice* lattice, ImageF* out) const {
  assert(raw.width() == raw_.width && raw.height() == raw_.height && out != &raw);
  place_lattice(turn, lattice);
  out->resize(result_.width, result_.height);
  AlignedVector<float> node_x(nodes_x_), node_y(nodes_x_), row(stride());
  for (int y = 0; y < result_.height; ++y) {
    const float* x0 = lattice->x.data() + static_cast<std::size_t>(y / kStep) * nodes_x_;
    const float* y0 = lattice->y.data() + static_cast<std::size_t>(y / kStep) * nodes_x_;
    const float part = static_cast<float>(y % kStep) / kStep;
    for (std::size_t i = 0; i < nodes_x_; ++i) {
      node_x[i] = x0[i] + part * (x0[i + nodes_x_] - x0[i]);
      node_y[i] = y0[i] + part * (y0[i + nodes_x_] - y0[i]);
    }
    const std::size_t at = static_cast<std::size_t>(y) * stride();
    run_kernel<UnrollRow<kStep>>(raw, x_.data() + at, y_.data() + at, node_x.data(), node_y.data(),
                                 static_cast<int>(stride()), row.data());
    std::copy_n(row.data(), result_.width, out->row(y));
  }
}

double Unroller::reach(const Vec3& turn) const {
  const double right = 0.5 * result_.width / result_.fx;
  const double bottom = 0.5 * result_.height / result_.fy;
  double most = 0.0;
  for (const double x : {-right, 0.0, right}) {
    for (const double y : {-bottom, bottom}) {
      const Vec3 moved = 0.5 * turn.cross(Vec3(x, y, 1.0));
      most = std::max(most, (moved.head<2>() - moved.z() * Vec2(x, y)).norm());
    }
  }
  return result_.fx * most;
}

}  // namespace sovo
