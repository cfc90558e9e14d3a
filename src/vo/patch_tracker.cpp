#include "sovo/vo/patch_tracker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "sovo/geometry/linear_solvers.h"
#include "sovo/image/interpolation.h"

namespace sovo {
namespace {

constexpr float kMinNorm = 7.0F * 2.0F;  // contrast below which a patch is noise [grey levels]

float at_level(float x, int level) { return (x + 0.5F) / static_cast<float>(1 << level) - 0.5F; }

/// d pixel' / d pixel of the mapping that a rotation causes, and the mapped pixel.
bool rotate_pixel(const CameraModel& camera, const SO3& R, float u, float v, float* u1, float* v1,
                  float A[4]) {
  const Vec3 ray((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
  const Mat3 r = R.matrix();
  const Vec3 p = r * ray;
  if (p.z() < 0.1) return false;
  const double x = p.x() / p.z();
  const double y = p.y() / p.z();
  *u1 = static_cast<float>(camera.fx * x + camera.cx);
  *v1 = static_cast<float>(camera.fy * y + camera.cy);
  if (A == nullptr) return true;
  const double aspect = camera.fx / camera.fy;
  A[0] = static_cast<float>((r(0, 0) - x * r(2, 0)) / p.z());
  A[1] = static_cast<float>((r(0, 1) - x * r(2, 1)) / p.z() * aspect);
  A[2] = static_cast<float>((r(1, 0) - y * r(2, 0)) / p.z() / aspect);
  A[3] = static_cast<float>((r(1, 1) - y * r(2, 1)) / p.z());
  return true;
}

/// Samples the turned patch less its mean; false where it leaves the image.
bool sample_patch(const ImageF& image, float x, float y, const float A[4], float* values) {
  constexpr float r = PatchTracker::kRadius;
  const float reach_x = r * (std::abs(A[0]) + std::abs(A[1]));
  const float reach_y = r * (std::abs(A[2]) + std::abs(A[3]));
  if (!(x - reach_x >= 0.0F && y - reach_y >= 0.0F &&
        x + reach_x < static_cast<float>(image.width() - 1) &&
        y + reach_y < static_cast<float>(image.height() - 1))) {
    return false;
  }
  float sum = 0.0F;
  float* out = values;
  for (int j = -PatchTracker::kRadius; j <= PatchTracker::kRadius; ++j) {
    for (int i = -PatchTracker::kRadius; i <= PatchTracker::kRadius; ++i, ++out) {
      const float fi = static_cast<float>(i);
      const float fj = static_cast<float>(j);
      *out = sample(image, std::max(0.0F, x + A[0] * fi + A[1] * fj),
                    std::max(0.0F, y + A[2] * fi + A[3] * fj));
      sum += *out;
    }
  }
  const float mean = sum / PatchTracker::kSize;
  for (int k = 0; k < PatchTracker::kSize; ++k) values[k] -= mean;
  return true;
}

float norm(const float* values) {
  float sum = 0.0F;
  for (int k = 0; k < PatchTracker::kSize; ++k) sum += values[k] * values[k];
  return std::sqrt(sum);
}

}  // namespace

bool PatchTracker::make_patch(const ImageF& image, float x, float y, Patch* patch,
                              float* min_eigenvalue) const {
  patch->usable = false;
  if (!in_image(image, x - kRadius, y - kRadius) || !in_image(image, x + kRadius, y + kRadius)) {
    return false;
  }
  float mean[3] = {};
  for (int k = 0; k < kSize; ++k) {
    const Sample s = sample_with_gradient(image, x + static_cast<float>(k % kSide - kRadius),
                                          y + static_cast<float>(k / kSide - kRadius));
    patch->value[k] = s.value;
    patch->gx[k] = s.gx;
    patch->gy[k] = s.gy;
    mean[0] += s.value / kSize;
    mean[1] += s.gx / kSize;
    mean[2] += s.gy / kSize;
  }
  float h[3] = {};
  for (int k = 0; k < kSize; ++k) {
    patch->value[k] -= mean[0];
    patch->gx[k] -= mean[1];
    patch->gy[k] -= mean[2];
    h[0] += patch->gx[k] * patch->gx[k];
    h[1] += patch->gx[k] * patch->gy[k];
    h[2] += patch->gy[k] * patch->gy[k];
  }
  const float half_trace = 0.5F * (h[0] + h[2]);
  const float det = h[0] * h[2] - h[1] * h[1];
  const float smaller = half_trace - std::sqrt(std::max(0.0F, half_trace * half_trace - det));
  *min_eigenvalue = smaller / kSize;
  patch->norm = norm(patch->value);
  if (smaller < 1e-3F * half_trace || det <= 0.0F || patch->norm < kMinNorm) return false;
  patch->inverse_hessian[0] = h[2] / det;
  patch->inverse_hessian[1] = -h[1] / det;
  patch->inverse_hessian[2] = h[0] / det;
  patch->usable = true;
  return true;
}

void PatchTracker::set_first(const ImagePyramid& pyramid, const CameraModel& pinhole,
                             const std::vector<Position>& candidates) {
  camera_ = pinhole;
  gain_ = 1.0F;
  levels_ = std::min(config_.coarsest_level + 1, pyramid.num_levels());
  struct Ranked {
    float eigenvalue;
    std::size_t index;
  };
  std::vector<Ranked> ranked;
  Patch patch;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    float eigenvalue = 0.0F;
    if (!make_patch(pyramid[0], candidates[i].u, candidates[i].v, &patch, &eigenvalue)) continue;
    if (eigenvalue >= static_cast<float>(config_.min_eigenvalue)) ranked.push_back({eigenvalue, i});
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const Ranked& a, const Ranked& b) { return a.eigenvalue > b.eigenvalue; });
  if (ranked.size() > static_cast<std::size_t>(config_.max_tracks)) {
    ranked.resize(static_cast<std::size_t>(config_.max_tracks));
  }
  tracks_.clear();
  patches_.resize(ranked.size() * levels_);
  for (const Ranked& r : ranked) {
    const Position& p = candidates[r.index];
    const std::size_t first = tracks_.size() * levels_;
    for (int l = 0; l < levels_; ++l) {
      float eigenvalue = 0.0F;
      make_patch(pyramid[l], at_level(p.u, l), at_level(p.v, l), &patches_[first + l], &eigenvalue);
    }
    tracks_.push_back({p.u, p.v, p.u, p.v, true, 1.0F});
  }
}

int PatchTracker::num_followed() const {
  return static_cast<int>(std::count_if(tracks_.begin(), tracks_.end(),
                                        [](const PatchTrack& t) { return t.followed; }));
}

void PatchTracker::track(const ImagePyramid& pyramid, const SO3& R_new_last,
                         const SO3& R_new_first) {
  contrasts_.clear();
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    PatchTrack& t = tracks_[i];
    t.followed = false;
    float u = 0.0F, v = 0.0F;
    float A[4];
    if (!rotate_pixel(camera_, R_new_first, t.u0, t.v0, &u, &v, A)) continue;
    if (!rotate_pixel(camera_, R_new_last, t.u, t.v, &t.u, &t.v, nullptr)) continue;
    float contrast = 0.0F;
    follow(pyramid, A, i, &contrast);
    if (t.followed) contrasts_.push_back(contrast);
  }
  if (contrasts_.size() < 10) return;
  const auto middle = contrasts_.begin() + static_cast<std::ptrdiff_t>(contrasts_.size() / 2);
  std::nth_element(contrasts_.begin(), middle, contrasts_.end());
  gain_ = std::clamp(*middle, 0.2F, 5.0F);
}

/// Coarse to fine; at each level Gauss-Newton with the gradients of the first view (turned by A).
void PatchTracker::follow(const ImagePyramid& pyramid, const float A[4], std::size_t index,
                          float* contrast) {
  PatchTrack& t = tracks_[index];
  float u = t.u, v = t.v;
  float values[kSize];
  for (int l = levels_ - 1; l >= 0; --l) {
    const Patch& patch = patches_[index * levels_ + l];
    if (!patch.usable) {
      if (l == 0) return;
      continue;
    }
    float x = at_level(u, l), y = at_level(v, l);
    bool ok = true;
    for (int iteration = 0; iteration < config_.max_iterations; ++iteration) {
      ok = sample_patch(pyramid[l], x, y, A, values);
      if (!ok) break;
      // Contrast of this patch: a wrong one would pull the patch along its gradient.
      const float gain = std::clamp(norm(values) / patch.norm, 0.2F, 5.0F);
      float bx = 0.0F, by = 0.0F;
      for (int k = 0; k < kSize; ++k) {
        const float r = values[k] - gain * patch.value[k];
        bx += patch.gx[k] * r;
        by += patch.gy[k] * r;
      }
      const float* h = patch.inverse_hessian;
      const float sx = -(h[0] * bx + h[1] * by) / gain;
      const float sy = -(h[1] * bx + h[2] * by) / gain;
      float dx = A[0] * sx + A[1] * sy;
      float dy = A[2] * sx + A[3] * sy;
      const float length = std::sqrt(dx * dx + dy * dy);
      if (length > 2.0F) {
        dx *= 2.0F / length;
        dy *= 2.0F / length;
      }
      x += dx;
      y += dy;
      if (length < (l == 0 ? 0.01F : 0.05F)) break;
    }
    if (!ok && l == 0) return;
    if (!ok) continue;
    const float scale = static_cast<float>(1 << l);
    u = (x + 0.5F) * scale - 0.5F;
    v = (y + 0.5F) * scale - 0.5F;
  }
  if (!sample_patch(pyramid[0], u, v, A, values)) return;
  const Patch& patch = patches_[index * levels_];
  const float n = norm(values);
  float product = 0.0F;
  for (int k = 0; k < kSize; ++k) product += values[k] * patch.value[k];
  t.zncc = n > 0.0F ? product / (n * patch.norm) : 0.0F;
  if (t.zncc < static_cast<float>(config_.min_zncc)) return;
  t.u = u;
  t.v = v;
  t.followed = true;
  *contrast = n / patch.norm;
}

double align_rotation(const ImageF& from, const ImageF& to, const CameraModel& camera,
                      const SO3& start, SO3* R_to_from) {
  using Vec5 = Eigen::Matrix<double, 5, 1>;
  using Mat5 = Eigen::Matrix<double, 5, 5>;
  constexpr int kIterations = 12;
  constexpr double kHuber = 15.0;
  SO3 R = start;
  double a = 1.0, b = 0.0, rms = std::numeric_limits<double>::infinity();
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const Mat3 r = R.matrix();
    Mat5 H = Mat5::Zero();
    Vec5 g = Vec5::Zero();
    double energy = 0.0, weight_sum = 0.0;
    int count = 0;
    for (int y = 0; y < from.height(); ++y) {
      for (int x = 0; x < from.width(); ++x) {
        const Vec3 p = r * Vec3((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1.0);
        if (p.z() < 0.1) continue;
        const double px = p.x() / p.z(), py = p.y() / p.z();
        const float u = static_cast<float>(camera.fx * px + camera.cx);
        const float v = static_cast<float>(camera.fy * py + camera.cy);
        if (!in_image(to, u, v)) continue;
        const Sample s = sample_with_gradient(to, u, v);
        const double residual = s.value - a * from.at(x, y) - b;
        const double w = std::min(1.0, kHuber / std::max(std::abs(residual), 1e-9));
        const double gx = s.gx * camera.fx, gy = s.gy * camera.fy;
        Vec5 J;
        J << -gx * px * py - gy * (1.0 + py * py), gx * (1.0 + px * px) + gy * px * py,
            -gx * py + gy * px, -from.at(x, y), -1.0;
        H.selfadjointView<Eigen::Lower>().rankUpdate(J, w);
        g += w * residual * J;
        energy += w * residual * residual;
        weight_sum += w;
        ++count;
      }
    }
    if (2 * count < from.width() * from.height()) return std::numeric_limits<double>::infinity();
    rms = std::sqrt(energy / weight_sum);
    *R_to_from = R;
    H.diagonal() += Vec5::Constant(1e-6);
    const Vec5 step = -solve_small(H, g);
    R = SO3::exp(step.head<3>()) * R;
    a += step[3];
    b += step[4];
    if (step.head<3>().norm() < 0.02 / camera.fx) break;
  }
  return rms;
}

}  // namespace sovo
