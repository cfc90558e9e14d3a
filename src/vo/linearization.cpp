#include "sovo/vo/linearization.h"

#include <algorithm>
#include <cmath>

#include "sovo/image/lanes.h"

namespace sovo {

namespace {

/// Index of (i, j), i <= j, in the upper triangle of a 4x4 matrix stored by rows.
constexpr int tri(int i, int j) { return i * 4 - i * (i - 1) / 2 + (j - i); }

/// Geometric Jacobian at the centre pixel, poses frozen (DSO eq. 13 ff.). False when the point is
/// behind the target.
bool geometric_jacobian(const CameraModel& camera, const PairGeometry& g, const Point& point,
                        Residual* r) {
  const auto rho = static_cast<float>(point.rho);
  const Eigen::Vector3f ray(point.u, point.v, 1.0F);
  const Eigen::Vector3f p = g.frozen_RKi * ray + g.frozen_t * rho;
  if (p.z() <= 1e-6F) return false;
  const auto fx = static_cast<float>(camera.fx);
  const auto fy = static_cast<float>(camera.fy);
  const float iz = 1.0F / p.z();  // z_host / z_target
  const float x = p.x() * iz;
  const float y = p.y() * iz;
  const float rho_target = rho * iz;
  r->du_rho = iz * (g.frozen_t.x() - g.frozen_t.z() * x) * fx;
  r->dv_rho = iz * (g.frozen_t.y() - g.frozen_t.z() * y) * fy;
  r->du = {rho_target * fx, 0.0F, -rho_target * x * fx, -x * y * fx, (1.0F + x * x) * fx, -y * fx};
  r->dv = {0.0F, rho_target * fy, -rho_target * y * fy, -(1.0F + y * y) * fy, x * y * fy, x * fy};
  return true;
}

/// Sum of squared gradients below which a pattern says nothing.
constexpr float kMinGradientEnergy = 2.0F;

struct Positions {
  float u[kPatternSize], v[kPatternSize];
};

/// Pattern pixels in the target image, current poses. False when one leaves the image.
bool project_pattern(const PairGeometry& g, const Point& point, const ImageF& image, Positions* out,
                     Residual* r) {
  const auto rho = static_cast<float>(point.rho);
  const float w = static_cast<float>(image.width() - 3);
  const float h = static_cast<float>(image.height() - 3);
  bool inside = true;
  float z_centre = 1.0F;
  for (int i = 0; i < kPatternSize; ++i) {
    const auto& offset = kPattern[static_cast<std::size_t>(i)];
    const float pu = point.u + offset.x;
    const float pv = point.v + offset.y;
    const float px = g.KRKi(0, 0) * pu + g.KRKi(0, 1) * pv + g.KRKi(0, 2) + g.Kt.x() * rho;
    const float py = g.KRKi(1, 0) * pu + g.KRKi(1, 1) * pv + g.KRKi(1, 2) + g.Kt.y() * rho;
    const float pz = g.KRKi(2, 0) * pu + g.KRKi(2, 1) * pv + g.KRKi(2, 2) + g.Kt.z() * rho;
    const float iz = 1.0F / pz;
    out->u[i] = px * iz;
    out->v[i] = py * iz;
    // Written so that NaN counts as outside.
    inside = inside && pz > 0.0F && out->u[i] > 1.1F && out->v[i] > 1.1F && out->u[i] < w &&
             out->v[i] < h;
    if (i == kPatternCentre) z_centre = iz;
  }
  r->centre_u = out->u[kPatternCentre];
  r->centre_v = out->v[kPatternCentre];
  r->centre_rho = rho * z_centre;
  return inside;
}

/// Sums of one residual over its pattern.
struct PatternSums {
  float energy = 0.0F;
  float rr = 0.0F;
  std::array<float, 10> gram{};
  std::array<float, 4> gram_r{};
};

/// Weighted residuals and Gram matrix of (gx, gy, ja, jb), four pixels at a time.
PatternSums sum_pattern(const ImageF& image, const PairGeometry& g, const Point& point,
                        const WindowConfig& config, const Positions& at) {
  const auto huber = static_cast<float>(config.huber);
  const auto c2 = static_cast<float>(config.gradient_constant * config.gradient_constant);
  std::array<Lane, 16> sums{};
  for (std::size_t k = 0; k < kPatternSize; k += kLanes) {
    const LaneSample s = sample_lanes_with_gradient(image, &at.u[k], &at.v[k]);
    const Lane colour = load_lane(&point.colour[k]);
    const Lane residual = s.value - (g.gain * colour + g.bias);
    const Lane gradient_squared = s.gx * s.gx + s.gy * s.gy;
    Lane weight;
    Lane energy;
    for (std::size_t i = 0; i < kLanes; ++i) {
      const float w = 0.5F * (std::sqrt(c2 / (c2 + gradient_squared[i])) + point.weight[k + i]);
      const float magnitude = std::abs(residual[i]);
      const float hw = magnitude < huber ? 1.0F : huber / magnitude;
      weight[i] = std::sqrt(hw) * w;
      energy[i] = w * w * hw * residual[i] * residual[i] * (2.0F - hw);
    }
    // d r / d (log-gain), d r / d bias of the target; the gain is the frozen one.
    const Lane gx = weight * s.gx;
    const Lane gy = weight * s.gy;
    const Lane ja = -weight * g.frozen_gain * (colour - g.frozen_host_b);
    const Lane jb = -weight;
    const Lane wr = weight * residual;
    const std::array<Lane, 16> terms = {gx * gx, gx * gy, gx * ja, gx * jb, gy * gy, gy * ja,
                                        gy * jb, ja * ja, ja * jb, jb * jb, gx * wr, gy * wr,
                                        ja * wr, jb * wr, wr * wr, energy};
    for (std::size_t i = 0; i < terms.size(); ++i) sums[i] += terms[i];
  }
  PatternSums out;
  for (std::size_t i = 0; i < 10; ++i) out.gram[i] = sum_lane(sums[i]);
  for (std::size_t i = 0; i < 4; ++i) out.gram_r[i] = sum_lane(sums[10 + i]);
  out.rr = sum_lane(sums[14]);
  out.energy = sum_lane(sums[15]);
  return out;
}

/// cross = J_pose^T J_rho from the Gram matrix and the geometric Jacobian.
void fill_cross(Residual* r) {
  const float gu = r->gram[tri(0, 0)] * r->du_rho + r->gram[tri(0, 1)] * r->dv_rho;
  const float gv = r->gram[tri(0, 1)] * r->du_rho + r->gram[tri(1, 1)] * r->dv_rho;
  for (std::size_t k = 0; k < 6; ++k) r->cross[k] = r->du[k] * gu + r->dv[k] * gv;
  r->cross[6] = r->gram[tri(0, 2)] * r->du_rho + r->gram[tri(1, 2)] * r->dv_rho;
  r->cross[7] = r->gram[tri(0, 3)] * r->du_rho + r->gram[tri(1, 3)] * r->dv_rho;
}

float out_of_view(Residual* r) {
  r->new_state = ResidualState::kOutOfView;
  r->new_energy = r->energy;
  return r->energy;
}

}  // namespace

float linearize(const Window& window, const WindowConfig& config, int host, int target,
                const Point& point, Residual* residual) {
  Residual& r = *residual;
  const PairGeometry& g = window.pair(host, target);
  const Keyframe& target_frame = window[target];
  const ImageF& image = target_frame.image();
  if (r.state == ResidualState::kOutOfView) return out_of_view(&r);
  Positions at;
  if (!geometric_jacobian(window.camera(), g, point, &r) ||
      !project_pattern(g, point, image, &at, &r)) {
    return out_of_view(&r);
  }

  const PatternSums sums = sum_pattern(image, g, point, config, at);
  r.gram = sums.gram;
  r.gram_r = sums.gram_r;
  r.rr = sums.rr;
  fill_cross(&r);

  r.raw_energy = sums.energy;
  r.new_state = ResidualState::kIn;
  return classify(window[host], target_frame, &r);
}

float classify(const Keyframe& host, const Keyframe& target, Residual* residual) {
  Residual& r = *residual;
  if (r.new_state == ResidualState::kOutOfView) return r.new_energy;
  const auto threshold =
      static_cast<float>(std::max(host.outlier_threshold, target.outlier_threshold));
  const bool textured = r.gram[tri(0, 0)] + r.gram[tri(1, 1)] >= kMinGradientEnergy;
  const bool inlier = r.raw_energy <= threshold && textured;
  r.new_state = inlier ? ResidualState::kIn : ResidualState::kOutlier;
  r.new_energy = inlier ? r.raw_energy : threshold;
  return r.new_energy;
}

void accumulate_relative(const Residual& r, Mat8* H, Vec8* b) {
  const auto& m = r.gram;
  float gu[6], gv[6];
  for (std::size_t k = 0; k < 6; ++k) {
    gu[k] = m[tri(0, 0)] * r.du[k] + m[tri(0, 1)] * r.dv[k];
    gv[k] = m[tri(0, 1)] * r.du[k] + m[tri(1, 1)] * r.dv[k];
  }
  for (std::size_t i = 0; i < 6; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    for (std::size_t j = 0; j <= i; ++j) {
      (*H)(row, static_cast<Eigen::Index>(j)) += r.du[i] * gu[j] + r.dv[i] * gv[j];
    }
    (*H)(6, row) += m[tri(0, 2)] * r.du[i] + m[tri(1, 2)] * r.dv[i];
    (*H)(7, row) += m[tri(0, 3)] * r.du[i] + m[tri(1, 3)] * r.dv[i];
    (*b)[row] += r.du[i] * r.gram_r[0] + r.dv[i] * r.gram_r[1];
  }
  (*H)(6, 6) += m[tri(2, 2)];
  (*H)(7, 6) += m[tri(2, 3)];
  (*H)(7, 7) += m[tri(3, 3)];
  (*b)[6] += r.gram_r[2];
  (*b)[7] += r.gram_r[3];
}

void accumulate_depth(const Residual& r, double* hessian, double* gradient) {
  const auto& m = r.gram;
  *hessian += r.du_rho * (m[tri(0, 0)] * r.du_rho + 2.0F * m[tri(0, 1)] * r.dv_rho) +
              m[tri(1, 1)] * r.dv_rho * r.dv_rho;
  *gradient += r.du_rho * r.gram_r[0] + r.dv_rho * r.gram_r[1];
}

void shift_residual(const Vec8& x, double rho_delta, Residual* residual) {
  Residual& r = *residual;
  double u = r.du_rho * rho_delta;
  double v = r.dv_rho * rho_delta;
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
