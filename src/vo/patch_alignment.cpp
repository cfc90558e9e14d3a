#include "sovo/vo/patch_alignment.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "sovo/image/halving.h"
#include "sovo/image/interpolation.h"

namespace sovo {
namespace {

constexpr int kSide = AlignmentPatch::kSide;
constexpr int kSize = AlignmentPatch::kSize;
constexpr int kWide = kSide + 2;      // with what its gradients need
constexpr float kMinNorm = 16.0F;     // contrast below which a patch is noise [grey levels]
constexpr float kLeastShare = 1e-3F;  // of the eigenvalues, the lesser of the mean

using PatchValues = std::array<float, kSize>;

void subtract_mean(PatchValues* values) {
  float sum = 0.0F;
  for (const float x : *values) sum += x;
  const float mean = sum / kSize;
  for (float& x : *values) x -= mean;
}

float dot(const PatchValues& a, const PatchValues& b) {
  // One sum a column: they do not wait for one another.
  std::array<float, kSide> sums{};
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) sums[x] += a[y * kSide + x] * b[y * kSide + x];
  }
  float sum = 0.0F;
  for (const float s : sums) sum += s;
  return sum;
}

/// The inverse of a warp; nothing when it folds the patch.
std::optional<PatchWarp> inverse_of(const PatchWarp& w) {
  const float det = w[0] * w[3] - w[1] * w[2];
  if (!(det > 1e-4F)) return std::nullopt;
  return PatchWarp{w[3] / det, -w[1] / det, -w[2] / det, w[0] / det};
}

/// Pixels of the first view under the patch, and one more to each side.
bool sample_wide(const ImageF& image, float x, float y, const PatchWarp& back,
                 std::array<float, kWide * kWide>* out) {
  constexpr float kReach = 0.5F * (kWide - 1);
  const float reach_x = kReach * (std::abs(back[0]) + std::abs(back[1]));
  const float reach_y = kReach * (std::abs(back[2]) + std::abs(back[3]));
  if (!(x - reach_x >= 0.0F && y - reach_y >= 0.0F &&
        x + reach_x < static_cast<float>(image.width() - 1) &&
        y + reach_y < static_cast<float>(image.height() - 1))) {
    return false;
  }
  for (int j = 0; j < kWide; ++j) {
    const float dy = static_cast<float>(j) - kReach;
    for (int i = 0; i < kWide; ++i) {
      const float dx = static_cast<float>(i) - kReach;
      // Rounding may lead out of the image by a last digit.
      (*out)[j * kWide + i] = sample(image, std::max(0.0F, x + back[0] * dx + back[1] * dy),
                                     std::max(0.0F, y + back[2] * dx + back[3] * dy));
    }
  }
  return true;
}

/// The patch of an image whose left upper value lies at (x, y), all values with one fraction of a
/// pixel; less its mean. False where it leaves the image.
bool sample_straight(const ImageF& image, float x, float y, PatchValues* values) {
  if (!(x >= 0.0F && y >= 0.0F && x < static_cast<float>(image.width() - kSide) &&
        y < static_cast<float>(image.height() - kSide))) {
    return false;
  }
  const int ix = static_cast<int>(x);
  const int iy = static_cast<int>(y);
  const float fx = x - static_cast<float>(ix);
  const float fy = y - static_cast<float>(iy);
  const float w00 = (1.0F - fx) * (1.0F - fy);
  const float w10 = fx * (1.0F - fy);
  const float w01 = (1.0F - fx) * fy;
  const float w11 = fx * fy;
  for (int j = 0; j < kSide; ++j) {
    const float* r0 = image.row(iy + j) + ix;
    const float* r1 = image.row(iy + j + 1) + ix;
    float* out = values->data() + j * kSide;
    for (int i = 0; i < kSide; ++i) {
      out[i] = w00 * r0[i] + w10 * r0[i + 1] + w01 * r1[i] + w11 * r1[i + 1];
    }
  }
  subtract_mean(values);
  return true;
}

/// Gauss-Newton on the patch's centre in an image. False where it leaves that.
bool align_at_level(const AlignmentPatch& patch, const ImageF& image, float stop,
                    int max_iterations, float* x, float* y) {
  PatchValues values;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    if (!sample_straight(image, *x - AlignmentPatch::kReach, *y - AlignmentPatch::kReach,
                         &values)) {
      return false;
    }
    // Contrast of this patch: a wrong one would pull the patch along its gradient.
    const float gain = std::clamp(std::sqrt(dot(values, values)) / patch.norm, 0.2F, 5.0F);
    for (int k = 0; k < kSize; ++k) values[k] -= gain * patch.value[k];
    const float bx = dot(patch.gx, values);
    const float by = dot(patch.gy, values);
    const auto& h = patch.inverse_hessian;
    float dx = -(h[0] * bx + h[1] * by) / gain;
    float dy = -(h[1] * bx + h[2] * by) / gain;
    const float length = std::sqrt(dx * dx + dy * dy);
    if (length > 2.0F) {
      dx *= 2.0F / length;
      dy *= 2.0F / length;
    }
    *x += dx;
    *y += dy;
    if (length < stop) break;
  }
  return true;
}

/// Levels by which this view has to be coarser for its pixels to be as large as the first's.
int level_shift(const PatchWarp& warp) {
  const float growth = std::abs(warp[0] * warp[3] - warp[1] * warp[2]);
  if (!(growth > 1e-4F)) return 0;
  return static_cast<int>(std::lround(0.5F * std::log2(growth)));
}

}  // namespace

bool make_patch(const ImageF& image, float x, float y, const PatchWarp& warp,
                AlignmentPatch* patch) {
  std::array<float, kWide * kWide> wide;
  patch->min_eigenvalue = 0.0F;
  const std::optional<PatchWarp> back = inverse_of(warp);
  if (!back || !sample_wide(image, x, y, *back, &wide)) return false;
  for (int j = 0; j < kSide; ++j) {
    const float* middle = wide.data() + (j + 1) * kWide + 1;
    for (int i = 0; i < kSide; ++i) {
      const int k = j * kSide + i;
      patch->value[k] = middle[i];
      patch->gx[k] = 0.5F * (middle[i + 1] - middle[i - 1]);
      patch->gy[k] = 0.5F * (middle[i + kWide] - middle[i - kWide]);
    }
  }
  subtract_mean(&patch->value);
  subtract_mean(&patch->gx);
  subtract_mean(&patch->gy);
  const float xx = dot(patch->gx, patch->gx);
  const float xy = dot(patch->gx, patch->gy);
  const float yy = dot(patch->gy, patch->gy);
  const float half_trace = 0.5F * (xx + yy);
  const float det = xx * yy - xy * xy;
  const float lesser = half_trace - std::sqrt(std::max(0.0F, half_trace * half_trace - det));
  patch->min_eigenvalue = lesser / kSize;
  patch->norm = std::sqrt(dot(patch->value, patch->value));
  if (lesser < kLeastShare * half_trace || det <= 0.0F || patch->norm < kMinNorm) return false;
  patch->inverse_hessian = {yy / det, -xy / det, xx / det};
  return true;
}

PatchMatch find_patch(const PatchOrigin& origin, const ImagePyramid& pyramid, const PatchWarp& warp,
                      float u, float v, const PatchAlignmentConfig& config) {
  PatchMatch match{.u = u, .v = v};
  const int shift = level_shift(warp);
  PatchWarp level_warp = warp;
  for (float& a : level_warp) a = std::ldexp(a, -shift);
  // Of this view; the first view's are `shift` below.
  const int finest = std::max(0, shift);
  const int coarsest = std::min({config.levels - 1 + finest, pyramid.num_levels() - 1,
                                 origin.pyramid->num_levels() - 1 + shift});
  match.finest_level = finest;
  AlignmentPatch patch;
  for (int l = coarsest; l >= finest; --l) {
    float x = to_halved(match.u, l);
    float y = to_halved(match.v, l);
    const int first = l - shift;
    const bool usable = make_patch((*origin.pyramid)[first], to_halved(origin.u, first),
                                   to_halved(origin.v, first), level_warp, &patch);
    const bool ok = usable && align_at_level(patch, pyramid[l], l == finest ? 0.01F : 0.05F,
                                             config.max_iterations, &x, &y);
    if (!ok && l == finest) return match;
    if (!ok) continue;
    match.u = from_halved(x, l);
    match.v = from_halved(y, l);
  }
  PatchValues values;
  if (coarsest < finest ||
      !sample_straight(pyramid[finest], to_halved(match.u, finest) - AlignmentPatch::kReach,
                       to_halved(match.v, finest) - AlignmentPatch::kReach, &values)) {
    return match;
  }
  const float norm = std::sqrt(dot(values, values));
  match.zncc = norm > 0.0F ? dot(values, patch.value) / (norm * patch.norm) : 0.0F;
  match.contrast = norm / patch.norm;
  match.found = match.zncc >= config.min_zncc;
  return match;
}

}  // namespace sovo
