#include "sovo/vo/linearization.h"

#include <algorithm>
#include <cmath>

#include "sovo/vo/motion_blur.h"
#include "sovo/vo/pattern_kernels.h"
#include "sovo/vo/plain_product.h"

namespace sovo {

namespace {

/// Index of (i, j), i <= j, in the upper triangle of a 4x4 matrix stored by rows.
constexpr int tri(int i, int j) { return i * 4 - i * (i - 1) / 2 + (j - i); }

/// A row of the Gram matrix times a vector.
template <class T>
T gram_row(const std::array<float, 10>& gram, std::size_t row, const std::array<T, 4>& d) {
  T sum = 0;
  for (std::size_t j = 0; j < 4; ++j) {
    const int i = static_cast<int>(row);
    const int k = static_cast<int>(j);
    sum +=
        static_cast<T>(gram[static_cast<std::size_t>(tri(std::min(i, k), std::max(i, k)))]) * d[j];
  }
  return sum;
}

/// Sum of squared gradients below which a pattern says nothing.
constexpr float kMinGradientEnergy = 2.0F;

constexpr float kMinDepth = 1e-6F;  ///< Least z_target / z_host of a point in front.

/// Geometric Jacobian at the centre pixel, poses frozen (DSO eq. 13 ff.).
void geometric_jacobian(const CameraModel& camera, const PairGeometry& g,
                        const PatternProjection& at, LinearizedResidual* r) {
  const auto fx = static_cast<float>(camera.fx);
  const auto fy = static_cast<float>(camera.fy);
  const float x = at.x;
  const float y = at.y;
  const float rho_target = at.rho * at.iz;
  const Eigen::Vector3f t = g.shift.none() ? g.frozen_t : at.shift.applied(g.frozen_t);
  r->du_rho = at.iz * (t.x() - t.z() * x) * fx;
  r->dv_rho = at.iz * (t.y() - t.z() * y) * fy;
  r->du = {rho_target * fx, 0.0F, -rho_target * x * fx, -x * y * fx, (1.0F + x * x) * fx, -y * fx};
  r->dv = {0.0F, rho_target * fy, -rho_target * y * fy, -(1.0F + y * y) * fy, x * y * fy, x * fy};
  if (g.shift.none()) return;
  for (auto* d : {&r->du, &r->dv}) {
    const Eigen::Vector3f chained = at.shift.chain({(*d)[0], (*d)[1], (*d)[2]});
    std::copy_n(chained.data(), 3, d->begin());
  }
}

/// cross = J_state^T J_rho from the Gram matrix and the geometric Jacobian.
void fill_cross(LinearizedResidual* r) {
  const float gu = r->gram[tri(0, 0)] * r->du_rho + r->gram[tri(0, 1)] * r->dv_rho;
  const float gv = r->gram[tri(0, 1)] * r->du_rho + r->gram[tri(1, 1)] * r->dv_rho;
  for (std::size_t k = 0; k < 8; k += kLanes) {
    store_lane(Lane(gu * load_lane(&r->du[k]) + gv * load_lane(&r->dv[k])), &r->cross[k]);
  }
  r->cross[6] = r->gram[tri(0, 2)] * r->du_rho + r->gram[tri(1, 2)] * r->dv_rho;
  r->cross[7] = r->gram[tri(0, 3)] * r->du_rho + r->gram[tri(1, 3)] * r->dv_rho;
}

/// By the pixel in which the point is seen; that it is seen in another one for this is less than a
/// thousandth of it.
PairViewShift::Displacement view_shift(const PairGeometry& g, const Point& point,
                                       const Eigen::Vector3f& seen, const ImageF& image) {
  return g.shift.at({point.u, point.v}, seen, image.width(), image.height());
}

/// How far a pattern's pixels move in the target, not yet divided by z, for inverse depth.
Eigen::Vector3f depth_motion(const CameraModel& camera, const PairGeometry& g,
                             const PairViewShift::Displacement& rows) {
  if (g.shift.none()) return g.Kt;
  const Eigen::Matrix3f K = camera.matrix().cast<float>();
  return plain_product(K, rows.applied(g.t));
}

/// The homography of the plane that the point lies on: to that of an upright one its slope adds
/// K t (d rho / d pixel)^T.
PatternWarp pattern_warp(const PairGeometry& g, const ImageF& image, const Point& point,
                         const Eigen::Vector3f& Kt, const Eigen::Vector3f& centre) {
  const auto rho = static_cast<float>(point.rho);
  const Eigen::Vector3f along_x = g.KRKi.col(0) + Kt * (rho * point.slope.u);
  const Eigen::Vector3f along_y = g.KRKi.col(1) + Kt * (rho * point.slope.v);
  return {{centre.x(), centre.y(), centre.z()},
          {along_x.x(), along_x.y(), along_x.z()},
          {along_y.x(), along_y.y(), along_y.z()},
          image.width(),
          image.height()};
}

/// Of what the target shows smaller or larger than the host.
PatternSpread pattern_spread(const PatternWarp& warp) {
  const Eigen::Matrix2f to_target = pixel_warp(warp);
  const float det = to_target(0, 0) * to_target(1, 1) - to_target(0, 1) * to_target(1, 0);
  const float share = 1.0F / (det * det);
  return {share * to_target(1, 1) * to_target(1, 1), share * to_target(0, 1) * to_target(0, 1),
          share * to_target(1, 0) * to_target(1, 0), share * to_target(0, 0) * to_target(0, 0)};
}

/// What the kernels of a pattern's sums are given.
PatternInput pattern_input(const PatternBrightness& brightness, const Point& point,
                           const WindowConfig& config, double huber_share, const ImageF& image,
                           const PatternProjection& at) {
  return {.image = &image,
          .offset = at.offset.data(),
          .fx = at.fx.data(),
          .fy = at.fy.data(),
          .colour = point.colour.data(),
          .weight = point.weight.data(),
          .narrow_u = point.blur.narrow_u.data(),
          .narrow_v = point.blur.narrow_v.data(),
          .wide_u = point.blur.wide_u.data(),
          .wide_v = point.blur.wide_v.data(),
          .gain = brightness.gain,
          .bias = brightness.bias,
          .frozen_gain = brightness.frozen_gain,
          .frozen_host_b = brightness.frozen_host_b,
          .huber = static_cast<float>(config.huber * huber_share),
          .squared_gradient_constant =
              static_cast<float>(config.gradient_constant * config.gradient_constant),
          .spread = at.spread,
          .point_spread = static_cast<float>(config.point_spread_px * config.point_spread_px),
          .most_spread = config.equal_blur ? kWideBlur : 0.0F};
}

void store_totals(const std::array<float, 16>& totals, LinearizedResidual* out) {
  std::copy_n(totals.begin(), 10, out->gram.begin());
  std::copy_n(totals.begin() + 10, 4, out->gram_r.begin());
  out->rr = totals[14];
  out->raw_energy = totals[15];
}

/// How a pattern is to be smeared in both images. Where that would take a look beside the host's
/// image, not at all.
PatternBlur pattern_blur(const Window& window, int host, int target, const Point& point,
                         const PatternProjection& at, const PatternWarp& warp) {
  const CameraModel& camera = window.camera();
  const auto x = (point.u - static_cast<float>(camera.cx)) / static_cast<float>(camera.fx);
  const auto y = (point.v - static_cast<float>(camera.cy)) / static_cast<float>(camera.fy);
  const BlurDifference difference =
      blur_difference(streak(camera, window[host].exposed, x, y, at.rho), pixel_warp(warp),
                      streak(camera, window[target].exposed, at.x, at.y, at.centre_rho));
  PatternBlur out;
  out.known = true;
  const Smear in_host = smear_along(difference.host);
  out.in_host = in_host.places > 1;
  if (out.in_host && !run_kernel<SmearColours>(window[host].image(), point.u, point.v, in_host,
                                               out.colours.data())) {
    out.in_host = false;
    return out;
  }
  out.in_target = smear_along(difference.target);
  return out;
}

/// As `sum_pattern`, where motion blurred both images differently: each is blurred further as the
/// other one was. False where there is nothing to do, or one would have to look beside its image.
bool sum_blurred_pattern(const Window& window, int host, int target,
                         const PatternBrightness& brightness, const Point& point,
                         const WindowConfig& config, const PatternProjection& at, PatternBlur* blur,
                         LinearizedResidual* out) {
  const ImageF& image = window[target].image();
  const float z = at.rho / at.centre_rho;
  const PairGeometry& g = window.pair(host, target);
  const PatternWarp warp = pattern_warp(g, image, point, depth_motion(window.camera(), g, at.shift),
                                        {at.centre_u * z, at.centre_v * z, z});
  if (!blur->known) *blur = pattern_blur(window, host, target, point, at, warp);
  if (!blur->in_host && blur->in_target.places == 1) return false;

  PatternInput in = pattern_input(brightness, point, config, window[host].huber_share, image, at);
  if (blur->in_host) {
    in.colour = blur->colours.data();
    in.most_spread = 0.0F;
  }
  alignas(32) std::array<float, 16> totals;
  if (blur->in_target.places > 1) {
    SmearedPattern smeared;
    if (!run_kernel<SmearPattern>(image, warp, blur->in_target, &smeared)) return false;
    run_kernel<SumSmearedPattern>(in, smeared, totals.data());
  } else {
    run_kernel<SumPattern>(in, totals.data());
  }
  store_totals(totals, out);
  return true;
}

}  // namespace

void project_pattern(const Window& window, int host, int target, const Point& point,
                     PatternProjection* projection) {
  const PairGeometry& g = window.pair(host, target);
  const ImageF& image = window[target].image();
  PatternProjection& out = *projection;
  out.rho = static_cast<float>(point.rho);
  const Eigen::Vector3f ray(point.u, point.v, 1.0F);
  const Eigen::Vector3f turned = plain_product(g.KRKi, ray);
  Eigen::Vector3f frozen_t = g.frozen_t;
  if (!g.shift.none()) {
    out.shift = view_shift(g, point, turned + g.Kt * out.rho, image);
    frozen_t = out.shift.applied(g.frozen_t);
  }
  const Eigen::Vector3f Kt = depth_motion(window.camera(), g, out.shift);
  const Eigen::Vector3f centre = turned + Kt * out.rho;
  const Eigen::Vector3f frozen = plain_product(g.frozen_RKi, ray) + frozen_t * out.rho;
  out.iz = 1.0F / frozen.z();
  out.x = frozen.x() * out.iz;
  out.y = frozen.y() * out.iz;

  const PatternWarp warp = pattern_warp(g, image, point, Kt, centre);
  out.spread = pattern_spread(warp);
  const bool inside =
      run_kernel<PlacePattern>(warp, out.fx.data(), out.fy.data(), out.offset.data());
  const float iz = 1.0F / centre.z();
  out.centre_u = centre.x() * iz;
  out.centre_v = centre.y() * iz;
  out.centre_rho = out.rho * iz;
  out.in_view = frozen.z() > kMinDepth && inside;
}

void prefetch_pattern(const Window& window, int target, const PatternProjection& projection) {
  if (!projection.in_view) return;
  const ImageF& image = window[target].image();
  const std::ptrdiff_t w = image.width();
  // Rows -2 to 2 of the pattern, and those around them for gradients.
  const float* left = image.data() + projection.offset[kPatternLeft];
  for (std::ptrdiff_t row = -3; row <= 4; ++row) {
    __builtin_prefetch(left + row * w - 1);
    __builtin_prefetch(left + row * w + 6);
  }
}

void sum_pattern(const ImageF& image, const PatternBrightness& brightness, const Point& point,
                 const WindowConfig& config, double huber_share, const PatternProjection& at,
                 LinearizedResidual* out) {
  const PatternInput in = pattern_input(brightness, point, config, huber_share, image, at);
  alignas(32) std::array<float, 16> totals;
  run_kernel<SumPattern>(in, totals.data());
  store_totals(totals, out);
}

float linearize_projected(const Window& window, const WindowConfig& config, int host, int target,
                          const Point& point, const Residual& residual,
                          const PatternProjection& projection, PatternBlur* blur,
                          LinearizedResidual* out) {
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
  const PatternBrightness brightness = {g.gain, g.bias, g.frozen_gain, g.frozen_host_b};
  if (!g.blurred || !sum_blurred_pattern(window, host, target, brightness, point, config,
                                         projection, blur, out)) {
    sum_pattern(target_frame.image(), brightness, point, config, window[host].huber_share,
                projection, out);
  }
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
  PatternBlur blur;
  return linearize_projected(window, config, host, target, point, residual, projection, &blur, out);
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

BrightnessPart brightness_part(const LinearizedResidual& r) {
  return {r.gram[tri(2, 2)], r.gram[tri(2, 3)], r.gram[tri(3, 3)], r.gram_r[2], r.gram_r[3]};
}

ShiftPart shift_part(const LinearizedResidual& r) {
  return {r.gram_r[0] * r.gram_r[0] + r.gram_r[1] * r.gram_r[1],
          r.gram[tri(0, 0)] + r.gram[tri(1, 1)]};
}

DepthPart depth_part(const LinearizedResidual& r) {
  const auto& m = r.gram;
  return {r.du_rho * (m[tri(0, 0)] * r.du_rho + 2.0F * m[tri(0, 1)] * r.dv_rho) +
              m[tri(1, 1)] * r.dv_rho * r.dv_rho,
          r.du_rho * r.gram_r[0] + r.dv_rho * r.gram_r[1]};
}

PatternShift pattern_shift(const LinearizedResidual& sampled, const std::array<float, 8>& moved,
                           float rho_change) {
  const auto sum = [&](const std::array<float, 8>& d) {
    return sum_lane(load_lane(&d[0]) * load_lane(&moved[0]) +
                    load_lane(&d[4]) * load_lane(&moved[4]));
  };
  return {sum(sampled.du) + sampled.du_rho * rho_change,
          sum(sampled.dv) + sampled.dv_rho * rho_change, moved[6], moved[7]};
}

void move_residual(const PatternShift& shift, LinearizedResidual* residual) {
  LinearizedResidual& r = *residual;
  const std::array<float, 4> d = {shift.u, shift.v, shift.a, shift.b};
  float change = 0.0F;  // of the energy, whose slope is 2 J^T r also where Huber's norm is linear
  for (std::size_t i = 0; i < 4; ++i) {
    const float moved = gram_row(r.gram, i, d);
    change += d[i] * (2.0F * r.gram_r[i] + moved);
    r.gram_r[i] += moved;
  }
  r.rr = std::max(0.0F, r.rr + change);
  r.raw_energy = std::max(0.0F, r.raw_energy + change);
  r.centre_u += shift.u;
  r.centre_v += shift.v;
}

void shift_residual(const Vec8& x, LinearizedResidual* residual) {
  LinearizedResidual& r = *residual;
  double u = 0.0;
  double v = 0.0;
  for (std::size_t k = 0; k < 6; ++k) {
    u += r.du[k] * x[static_cast<Eigen::Index>(k)];
    v += r.dv[k] * x[static_cast<Eigen::Index>(k)];
  }
  const std::array<double, 4> d = {u, v, x[6], x[7]};
  for (std::size_t i = 0; i < 4; ++i) {
    r.gram_r[i] -= static_cast<float>(gram_row(r.gram, i, d));
  }
}

}  // namespace sovo
