#pragma once

#include <array>
#include <cstdint>

#include "sovo/vo/direct_config.h"
#include "sovo/vo/pattern_kernels.h"
#include "sovo/vo/window.h"

namespace sovo {

/// Photometric residual of a point's pattern in one target keyframe, linearized, in compact form.
/// With the pattern's Jacobian rows J_i = [g_i^T D, ja_i, jb_i] (image gradient g_i, geometric
/// Jacobian D at the centre pixel, brightness), all that the normal equations need is the 4x4 Gram
/// matrix of (gx, gy, ja, jb), its product with r, and D.
struct LinearizedResidual {
  std::array<float, 10> gram{};        ///< Upper triangle of sum [gx gy ja jb]^T [gx gy ja jb].
  std::array<float, 4> gram_r{};       ///< sum [gx gy ja jb]^T r.
  float rr = 0.0F;                     ///< sum r^2 (weighted).
  float raw_energy = 0.0F;             ///< As measured, outlier or not.
  std::array<float, 8> du{}, dv{};     ///< d (u, v) / d (relative state) [px]; no part of a, b.
  std::array<float, 8> cross{};        ///< J_state^T J_rho of this residual, relative coordinates.
  float du_rho = 0.0F, dv_rho = 0.0F;  ///< d (u, v) / d (inverse depth) [px m].
  float energy = 0.0F;                 ///< As it counts: an outlier counts its threshold.
  float centre_u = 0.0F, centre_v = 0.0F;        ///< Projection of the centre pixel [px].
  float centre_rho = 0.0F;                       ///< Inverse depth in the target [1/m].
  ResidualState state = ResidualState::kAbsent;  ///< What the residual would become.
};

/// Where a point's pattern falls in a target image by the current poses, and the geometric
/// Jacobian of its centre at the frozen ones.
struct PatternProjection {
  alignas(32) std::array<float, kPatternSize> fx, fy;  ///< Position within its pixel.
  std::array<std::int32_t, kPatternSize> offset;       ///< Of that pixel in the image.
  float centre_u = 0.0F, centre_v = 0.0F, centre_rho = 0.0F;
  float x = 0.0F, y = 0.0F;           ///< Centre in the normalized target image, poses frozen.
  PairViewShift::Displacement shift;  ///< What is added to the translation.
  PatternSpread spread;
  float iz = 0.0F, rho = 0.0F;  ///< z_host / z_target; inverse depth in the host [1/m].
  bool in_view = false;
};

/// First half of a linearization. What `linearize_projected` will read can be fetched meanwhile.
void project_pattern(const Window& window, int host, int target, const Point& point,
                     PatternProjection* projection);

/// Asks for the image lines of a projection.
void prefetch_pattern(const Window& window, int target, const PatternProjection& projection);

/// Second half: everything of the linearized residual. The image gradient, weights and pixel
/// positions come from the current estimate, the geometric Jacobian once at the centre pixel from
/// the frozen poses (first estimates). `residual` is what is known so far: out of view it stays,
/// with the energy that it has. `blur` is found out where it is not known yet. Returns the new
/// energy.
float linearize_projected(const Window& window, const WindowConfig& config, int host, int target,
                          const Point& point, const Residual& residual,
                          const PatternProjection& projection, PatternBlur* blur,
                          LinearizedResidual* out);

/// Brightness from a host to a target image, now and at the linearization point.
struct PatternBrightness {
  float gain = 1.0F, bias = 0.0F;
  float frozen_gain = 1.0F, frozen_host_b = 0.0F;
};

/// Samples a projected pattern: `gram`, `gram_r`, `rr` and `raw_energy` of `out`. `huber_share`: of
/// its host.
void sum_pattern(const ImageF& image, const PatternBrightness& brightness, const Point& point,
                 const WindowConfig& config, double huber_share, const PatternProjection& at,
                 LinearizedResidual* out);

/// Both halves: linearizes the residual of `point` (host keyframe index `host`) into keyframe index
/// `target`.
float linearize(const Window& window, const WindowConfig& config, int host, int target,
                const Point& point, const Residual& residual, LinearizedResidual* out);

/// Whether a residual that is in view is an inlier: by its energy, the outlier thresholds of its
/// keyframes, and whether its pattern has texture.
struct Verdict {
  ResidualState state = ResidualState::kOutlier;
  float energy = 0.0F;  ///< As it counts.
};
Verdict judge(const Keyframe& host, const Keyframe& target, float raw_energy, bool textured);

/// Whether the image gradients of the pattern say anything.
bool is_textured(const LinearizedResidual& residual);

/// Part of a residual in its point's own H_rho_rho and b_rho.
struct DepthPart {
  float hessian = 0.0F, gradient = 0.0F;
};
DepthPart depth_part(const LinearizedResidual& residual);

/// Part of a residual in the relative log-gain a and bias b of its keyframes: upper triangle of H,
/// and gradient.
struct BrightnessPart {
  float aa = 0.0F, ab = 0.0F, bb = 0.0F;
  float gradient_a = 0.0F, gradient_b = 0.0F;
};
BrightnessPart brightness_part(const LinearizedResidual& residual);

/// Part of a residual in a shift of its pattern in the target image, whatever moves it: the squared
/// length of its gradient, sum w (gx, gy) r, and the trace of its Hessian, sum w (gx, gy)^T (gx,
/// gy).
struct ShiftPart {
  float squared_gradient = 0.0F, hessian = 0.0F;
};
ShiftPart shift_part(const LinearizedResidual& residual);

/// How a pattern has moved since it was sampled, to first order: its centre in the target image
/// [px], and the relative log-gain a and bias b [grey levels] of its keyframes.
struct PatternShift {
  float u = 0.0F, v = 0.0F, a = 0.0F, b = 0.0F;
};

/// By the relative displacement of its keyframes (8) and the change of its inverse depth.
PatternShift pattern_shift(const LinearizedResidual& sampled, const std::array<float, 8>& moved,
                           float rho_change);

/// The residual as it would be, to first order, if it were sampled where its pattern is now: J is
/// as it was, r is r + J x.
void move_residual(const PatternShift& shift, LinearizedResidual* residual);

/// r - J x for the displacement `x` (8, relative): changes `gram_r` so that later accumulation sees
/// the residual as it would be at the linearization point of the poses.
void shift_residual(const Vec8& x, LinearizedResidual* residual);

}  // namespace sovo
