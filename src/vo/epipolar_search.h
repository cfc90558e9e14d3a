#pragma once

#include "sovo/geometry/camera_model.h"
#include "sovo/vo/direct_config.h"
#include "sovo/vo/immature_point.h"
#include "sovo/vo/window.h"

namespace sovo {

/// A host keyframe seen from an image: where its points' rays project.
struct HostGeometry {
  Eigen::Matrix3f KRKi;
  Eigen::Vector3f Kt;
  float gain = 1.0F, bias = 0.0F;
};

HostGeometry host_geometry(const CameraModel& camera, const SE3& T_target_host,
                           const BrightnessTransfer& transfer);

/// Pattern colours, weights and gradients of a new immature point at pixel (u, v) of `image`.
/// False when the pattern does not fit into the image or has no finite value.
bool make_immature_point(const ImageF& image, float u, float v, std::uint8_t type,
                         const PointConfig& config, double gradient_constant, ImmaturePoint* out);

/// Searches the point along its epipolar segment in `image`: whole-pixel steps, then Gauss-Newton
/// along the line; narrows its interval to the best position plus and minus the pixel error that
/// the pattern's gradients allow. Sets the point's state (DSO, Sec. 3.2, "point tracing").
TraceState trace(const ImageF& image, const HostGeometry& geometry, const PointConfig& config,
                 ImmaturePoint* point);

}  // namespace sovo
