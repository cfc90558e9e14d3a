#include "sovo/vo/linearization.h"

#include <algorithm>
#include <cmath>

#include "sovo/image/lanes.h"
#include "sovo/vo/plain_product.h"

namespace sovo {

namespace {

/// Index of (i, j), i <= j, in the upper triangle of a 4x4 matrix stored by rows.
constexpr int tri(int i, int j) { return i * 4 - i * (i - 1) / 2 + (j - i); }

/// Sum of squared gradients below which a pattern says nothing.
constexpr float kMinGradientEnergy = 2.0F;

constexpr float kMinDepth = 1e-6F;  ///< Least z_target / z_host of a point in front.

/// The pattern's offsets, as lanes.
constexpr std::array<Lane, 2> kOffsetX = {
    Lane{kPattern[0].x, kPattern[1].x, kPattern[2].x, kPattern[3].x},
    Lane{kPattern[4].x, kPattern[5].x, kPattern[6].x, kPattern[7].x}};
constexpr std::array<Lane, 2> kOffsetY = {
    Lane{kPattern[0].y, kPattern[1].y, kPattern[2].y, kPattern[3].y},
    Lane{kPattern[4].y, kPattern[5].y, kPattern[6].y, kPattern[7].y}};

/// Geometric Jacobian at the centre pixel, poses frozen (DSO eq. 13 ff.).
void geometric_jacobian(const CameraModel& camera, const PairGeometry& g,
                        const PatternProjection& at, LinearizedResidual* r) {
  const auto fx = static_cast<float>(camera.fx);
  const auto fy = static_cast<float>(camera.fy);
  const float x = at.x;
  const float y = at.y;
  const float rho_target = at.rho * at.iz;
  r->du_rho = at.iz * (g.frozen_t.x() - g.frozen_t.z() * x) * fx;
  r->dv_rho = at.iz * (g.frozen_t.y() - g.frozen_t.z() * y) * fy;
  r->du = {rho_target * fx, 0.0F, -rho_target * x * fx, -x * y * fx, (1.0F + x * x) * fx, -y * fx};
  r->dv = {0.0F, rho_target * fy, -rho_target * y * fy, -(1.0F + y * y) * fy, x * y * fy, x * fy};
}

/// Weighted residuals and Gram matrix of (gx, gy, ja, jb), four pixels at a time.
void sum_pattern(const ImageF& image, const PairGeometry& g, const Point& point,
                 const WindowConfig& config, const PatternProjection& at, LinearizedResidual* out) {
  const Lane huber = lane_of(static_cast<float>(config.huber));
  const Lane c2 = lane_of(static_cast<float>(config.gradient_constant * config.gradient_constant));
  const Lane one = lane_of(1.0F);
  std::array<Lane, 16> sums{};
  for (std::size_t k = 0; k < kPatternSize; k += kLanes) {
    const LaneSample s = sample_lanes_with_gradient(image, &at.offset[k], load_lane(&at.fx[k]),
                                                    load_lane(&at.fy[k]));
    const Lane colour = load_lane(&point.colour[k]);
    const Lane residual = s.value - (g.gain * colour + g.bias);
    const Lane gradient_squared = s.gx * s.gx + s.gy * s.gy;
    const Lane w = 0.5F * (sqrt_lane(c2 / (c2 + gradient_squared)) + load_lane(&point.weight[k]));
    const Lane hw = min_lane(one, huber / abs_lane(residual));
    const Lane weight = sqrt_lane(hw) * w;
    const Lane wr = weight * residual;
    // d r / d (log-gain), d r / d bias of the target; the gain is the frozen one.
    const Lane gx = weight * s.gx;
    const Lane gy = weight * s.gy;
    const Lane ja = -weight * g.frozen_gain * (colour - g.frozen_host_b);
    const Lane jb = -weight;
    const std::array<Lane, 16> terms = {
        gx * gx, gx * gy, gx * ja, gx * jb, gy * gy, gy * ja, gy * jb, ja * ja,
        ja * jb, jb * jb, gx * wr, gy * wr, ja * wr, jb * wr, wr * wr, wr * wr * (2.0F - hw)};
    for (std::size_t i = 0; i < terms.size(); ++i) sums[i] += terms[i];
  }
  alignas(16) std::array<float, 16> totals;
  for (std::size_t i = 0; i < 16; i += kLanes) {
    store_lane(sum_lanes(sums[i], sums[i + 1], sums[i + 2], sums[i + 3]), &totals[i]);
  }
  std::copy_n(totals.begin(), 10, out->gram.begin());
  std::copy_n(totals.begin() + 10, 4, out->gram_r.begin());
  out->rr = totals[14];
  out->raw_energy = totals[15];
}

/// cross = J_state^T J_rho from the Gram matrix and the geometric Jacobian.
void fill_cross(LinearizedResidual* r) {
  const float gu = r->gram[tri(0, 0)] * r->du_rho + r->gram[tri(0, 1)] * r->dv_rho;
  const float gv = r->gram[tri(0, 1)] * r->du_rho + r->gram[tri(1, 1)] * r->dv_rho;
  for (std::size_t k = 0; k < 6; ++k) r->cross[k] = r->du[k] * gu + r->dv[k] * gv;
  r->cross[6] = r->gram[tri(0, 2)] * r->du_rho + r->gram[tri(1, 2)] * r->dv_rho;
  r->cross[7] = r->gram[tri(0, 3)] * r->du_rho + r->gram[tri(1, 3)] * r->dv_rho;
}

}  // namespace

void project_pattern(const Window& window, int host, int target, const Point& point,
                     PatternProjection* projection) {
  const PairGeometry& g = window.pair(host, target);
  const ImageF& image = window[target].image();
  PatternProjection& out = *projection;
  out.rho = static_cast<float>(point.rho);
  const Eigen::Vector3f ray(point.u, point.v, 1.0F);
  const Eigen::Vector3f frozen = plain_product(g.frozen_RKi, ray) + g.frozen_t * out.rho;
  out.iz = 1.0F / frozen.z();
  out.x = frozen.x() * out.iz;
  out.y = frozen.y() * out.iz;

  const Eigen::Vector3f centre = plain_product(g.KRKi, ray) + g.Kt * out.rho;
  LaneMask inside = {-1, -1, -1, -1};
  for (std::size_t k = 0; k < 2; ++k) {
    const Lane pz = centre.z() + g.KRKi(2, 0) * kOffsetX[k] + g.KRKi(2, 1) * kOffsetY[k];
    const Lane px = centre.x() + g.KRKi(0, 0) * kOffsetX[k] + g.KRKi(0, 1) * kOffsetY[k];
    const Lane py = centre.y() + g.KRKi(1, 0) * kOffsetX[k] + g.KRKi(1, 1) * kOffsetY[k];
    const Lane iz = 1.0F / pz;
    const Lane u = px * iz;
    const Lane v = py * iz;
    // Written so that NaN counts as outside.
    inside &= (pz > 0.0F) & (u > 1.1F) & (v > 1.1F) & (u < static_cast<float>(image.width() - 3)) &
              (v < static_cast<float>(image.height() - 3));
    const LaneMask iu = __builtin_convertvector(u, LaneMask);
    const LaneMask iv = __builtin_convertvector(v, LaneMask);
    store_lane(u - __builtin_convertvector(iu, Lane), &out.fx[4 * k]);
    store_lane(v - __builtin_convertvector(iv, Lane), &out.fy[4 * k]);
    for (std::size_t i = 0; i < kLanes; ++i) out.offset[4 * k + i] = iv[i] * image.width() + iu[i];
  }
  const float iz = 1.0F / centre.z();
  out.centre_u = centre.x() * iz;
  out.centre_v = centre.y() * iz;
  out.centre_rho = out.rho * iz;
  out.in_view = frozen.z() > kMinDepth && all_of(inside);
}

void prefetch_pattern(const Window& window, int target, const PatternProjection& projection) {
  if (!projection.in_view) return;
  const ImageF& image = window[target].image();
  const std::ptrdiff_t w = image.width();
  // Rows -2 to 2 of the pattern, and those around them for gradients.
  const float* centre = image.data() + projection.offset[kPatternCentre];
  for (std::ptrdiff_t row = -3; row <= 4; ++row) {
    __builtin_prefetch(centre + row * w - 3);
    __builtin_prefetch(centre + row * w + 4);
  }
}

float linearize_projected(const Window& window, const WindowConfig& config, int host, int target,
                          const Point& point, const Residual& residual,
                          const PatternProjection& projection, LinearizedResidual* out) {
  const PairGeometry& g = window.pair(host, target);
  const Keyframe& target_frame = window[target];
  out->centre_u = projection.centre_u;
  out->centre_v = projection.centre_v;
  out->centre_rho = projection.centre_rho;
  if (residual.state == ResidualState::kOutOfView || !projection.in_view) {
    out->state = ResidualState::kOutOfView;
    out->energy = residual.energy;
    return out->energy;
  }
  geometric_jacobian(window.camera(), g, projection, out);
  sum_pattern(target_frame.image(), g, point, config, projection, out);
  fill_cross(out);
  const Verdict verdict = judge(window[host], target_frame, out->raw_energy, is_textured(*out));
  out->state = verdict.state;
  out->energy = verdict.energy;
  return out->energy;
}

float linearize(const Window& window, const WindowConfig& config, int host, int target,
                const Point& point, const Residual& residual, LinearizedResidual* out) {
  PatternProjection projection;
  project_pattern(window, host, target, point, &projection);
  return linearize_projected(window, config, host, target, point, residual, projection, out);
}

Verdict judge(const Keyframe& host, const Keyframe& target, float raw_energy, bool textured) {
  const auto threshold =
      static_cast<float>(std::max(host.outlier_threshold, target.outlier_threshold));
  if (raw_energy <= threshold && textured) return {ResidualState::kIn, raw_energy};
  return {ResidualState::kOutlier, threshold};
}

bool is_textured(const LinearizedResidual& residual) {
  return residual.gram[tri(0, 0)] + residual.gram[tri(1, 1)] >= kMinGradientEnergy;
}

DepthPart depth_part(const LinearizedResidual& r) {
  const auto& m = r.gram;
  return {r.du_rho * (m[tri(0, 0)] * r.du_rho + 2.0F * m[tri(0, 1)] * r.dv_rho) +
              m[tri(1, 1)] * r.dv_rho * r.dv_rho,
          r.du_rho * r.gram_r[0] + r.dv_rho * r.gram_r[1]};
}

void shift_residual(const Vec8& x, LinearizedResidual* residual) {
  LinearizedResidual& r = *residual;
  double u = 0.0;
  double v = 0.0;
  for (std::size_t k = 0; k < 6; ++k) {
    u += r.du[k] * x[static_cast<Eigen::Index>(k)];
    v += r.dv[k] * x[static_cast<Eigen::Index>(k)];
  }
  const double d[4] = {u, v, x[6], x[7]};
  for (int i = 0; i < 4; ++i) {
    double sum = 0.0;
    for (int j = 0; j < 4; ++j) {
      sum += static_cast<double>(
                 r.gram[static_cast<std::size_t>(tri(std::min(i, j), std::max(i, j)))]) *
             d[j];
    }
    r.gram_r[static_cast<std::size_t>(i)] -= static_cast<float>(sum);
  }
}

}  // namespace sovo
