#pragma once

#include "sovo/vo/direct_config.h"
#include "sovo/vo/window.h"

namespace sovo {

/// Linearizes the residual of `point` (host keyframe index `host`) into keyframe index `target`:
/// fills everything of `residual` but `state`; its `new_state` and `new_energy` say what it would
/// become. The image gradient, weights and pixel positions come from the current estimate, the
/// geometric Jacobian once at the centre pixel from the frozen poses (first estimates).
/// Returns the new energy.
float linearize(const Window& window, const WindowConfig& config, int host, int target,
                const Point& point, Residual* residual);

/// Decides from a linearized residual's energy and the outlier thresholds of its keyframes whether
/// it is an inlier; out of view stays so. Returns the new energy.
float classify(const Keyframe& host, const Keyframe& target, Residual* residual);

/// The 8x8 normal matrix and the gradient of a residual in relative coordinates (pose, a, b of the
/// target while the host stays), added to H and b.
void accumulate_relative(const Residual& residual, Mat8* H, Vec8* b);

/// Adds the part of a residual to a point's own H_rho_rho and b_rho.
void accumulate_depth(const Residual& residual, double* hessian, double* gradient);

/// r - J x for the displacement `x` (8, relative) and `rho_delta`: changes `gram_r` so that later
/// accumulation sees the residual as it would be at the linearization point.
void shift_residual(const Vec8& x, double rho_delta, Residual* residual);

}  // namespace sovo
