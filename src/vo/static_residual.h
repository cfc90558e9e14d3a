#pragma once

#include "sovo/geometry/stereo_rig.h"
#include "sovo/vo/direct_config.h"
#include "sovo/vo/linearization.h"
#include "sovo/vo/window.h"

namespace sovo {

/// Weight of the window's static residuals: they share the errors of fewer images than others, but
/// one that leaves the scale free counts as any other.
inline double static_weight(const WindowConfig& config, const Window& window) {
  return window.static_scale_free() ? config.free_static_weight : config.static_weight;
}

/// Photometric residual of a point's pattern in the right image that was taken with its host
/// keyframe ([S] II, E_ps of Stereo DSO). The cameras stand still to each other, so of all states
/// the point's inverse depth alone moves it: `du`, `dv` and `cross` are zero. The right image is
/// raw; the pattern is warped by the first derivatives of the lens at its centre.
///
/// The pattern is where the point is at inverse depth `rho` [1/m], by which `out` is derived.
///
/// Precondition: `host` has a right image. What is out of view gets that state, and no sums.
void linearize_static(const StereoRig& rig, const WindowConfig& config, const Keyframe& host,
                      const Point& point, double rho, LinearizedResidual* out);

/// Refines the brightness of a keyframe's right image by a Gauss-Newton step over its static
/// residuals that are inliers, the depths held. `scale`: `Window::static_scale`.
void refine_right_brightness(const StereoRig& rig, const WindowConfig& config, double scale,
                             Keyframe* keyframe);

/// Brightness from a keyframe to its right image, from places that are known to correspond, by
/// equal first and second moments, twice: of all, and of the half that fits best. `before` when
/// there are fewer than thirty.
BrightnessTransfer fit_right_brightness(const StereoRig& rig, const Keyframe& keyframe,
                                        const BrightnessTransfer& before);

}  // namespace sovo
