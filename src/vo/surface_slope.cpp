#include "sovo/vo/surface_slope.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

namespace sovo {

namespace {

constexpr int kSlopeCell = 16;                   ///< [px]
constexpr float kReach = 24.0F;                  ///< Neighbours lie no further away [px].
constexpr std::size_t kFewestNeighbours = 6;     ///< For three numbers.
constexpr std::size_t kExpectedNeighbours = 64;  ///< Memory for so many is asked for at once.
constexpr double kLeastOnPlane = 0.6;            ///< Of their weights, that must lie on the plane.
constexpr double kSurface = 0.02;                ///< Of surfaces off their planes, over the depth.
constexpr double kLikelySlope = 0.05;            ///< Prior's standard deviation [1/px].
constexpr double kLargestSlope = 0.15;           ///< [1/px]
constexpr int kPlaneIterations = 5;
constexpr double kWidestDeviation = 8.0;     ///< Of deviations: where robust weights begin,
constexpr double kNarrowestDeviation = 2.0;  ///< and where they end.

int slope_cell(float x, int cells) {
  const auto last = static_cast<float>(cells - 1);
  return static_cast<int>(std::clamp(x / kSlopeCell, 0.0F, last));
}

/// Inverse depth over that of the middle: 1 + offset + slope^T (du, dv).
struct Plane {
  Vec3 value = Vec3::Zero();  ///< Offset and slope.
  double share = 0.0;         ///< Of what was known, that lies on it.
};

SlopeNeighbour neighbour(const SurfaceSample& known, const SurfaceSample& middle) {
  const double ratio = static_cast<double>(known.rho) / static_cast<double>(middle.rho);
  const double variance = ratio * ratio * static_cast<double>(known.variance) + kSurface * kSurface;
  const Vec3 place(1.0, static_cast<double>(known.u - middle.u),
                   static_cast<double>(known.v - middle.v));
  return {place, ratio - 1.0, 1.0 / variance};
}

/// Iteratively reweighted (Cauchy), the width coming down: what lies on another surface loses its
/// weight. `variance`: of the middle's own inverse depth, over that.
Plane fit_plane(const std::vector<SlopeNeighbour>& known, double variance) {
  Plane plane;
  Mat3 prior = Vec3(0.0, 1.0, 1.0).asDiagonal().toDenseMatrix() / (kLikelySlope * kLikelySlope);
  prior(0, 0) = 1.0 / (variance + kSurface * kSurface);
  double width = kWidestDeviation;
  for (int i = 0; i < kPlaneIterations; ++i) {
    Mat3 H = prior;
    Vec3 b = Vec3::Zero();
    double on = 0.0;
    double all = 0.0;
    for (const SlopeNeighbour& k : known) {
      const double residual = k.value - plane.value.dot(k.place);
      const double weight = k.weight / (1.0 + residual * residual * k.weight / (width * width));
      on += weight;
      all += k.weight;
      H += weight * k.place * k.place.transpose();
      b += weight * k.value * k.place;
    }
    plane.value = H.ldlt().solve(b);
    plane.share = on / all;
    width = std::max(kNarrowestDeviation, 0.5 * width);
  }
  return plane;
}

}  // namespace

SurfaceSlopes::SurfaceSlopes(int width, int height, std::vector<SurfaceSample> known)
    : columns_(width / kSlopeCell + 1), rows_(height / kSlopeCell + 1), known_(std::move(known)) {
  const auto cell = [&](const SurfaceSample& k) {
    return static_cast<std::size_t>(slope_cell(k.v, rows_) * columns_ + slope_cell(k.u, columns_));
  };
  std::stable_sort(
      known_.begin(), known_.end(),
      [&](const SurfaceSample& a, const SurfaceSample& b) { return cell(a) < cell(b); });
  first_.assign(static_cast<std::size_t>(columns_ * rows_) + 1, 0);
  for (const SurfaceSample& k : known_) ++first_[cell(k) + 1];
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
}

void SurfaceSlopes::look_around(const SurfaceSample& at) {
  near_.clear();
  near_.reserve(kExpectedNeighbours);
  for (int y = slope_cell(at.v - kReach, rows_); y <= slope_cell(at.v + kReach, rows_); ++y) {
    for (int x = slope_cell(at.u - kReach, columns_); x <= slope_cell(at.u + kReach, columns_);
         ++x) {
      const auto cell = static_cast<std::size_t>(y * columns_ + x);
      for (std::size_t i = first_[cell]; i < first_[cell + 1]; ++i) {
        const SurfaceSample& k = known_[i];
        const float du = k.u - at.u;
        const float dv = k.v - at.v;
        const float apart = du * du + dv * dv;
        if (apart <= kReach * kReach && apart > 1.0F) near_.push_back(neighbour(k, at));
      }
    }
  }
}

SurfaceSlope SurfaceSlopes::at(const SurfaceSample& at) {
  if (!(at.rho > 0.0F)) return {};
  look_around(at);
  if (near_.size() < kFewestNeighbours) return {};
  const Plane plane = fit_plane(near_, static_cast<double>(at.variance));
  const double largest = std::max(std::abs(plane.value[1]), std::abs(plane.value[2]));
  const double middle = 1.0 + plane.value[0];
  if (plane.share < kLeastOnPlane || !(middle > 0.5) || !(largest < kLargestSlope)) return {};
  return {static_cast<float>(plane.value[1] / middle), static_cast<float>(plane.value[2] / middle)};
}

}  // namespace sovo
