#pragma once

#include <array>

#include "sovo/geometry/camera_model.h"
#include "sovo/image/lanes.h"
#include "sovo/vo/direct_config.h"
#include "sovo/vo/immature_point.h"
#include "sovo/vo/pattern.h"
#include "sovo/vo/window.h"

namespace sovo {

/// A host keyframe seen from an image: where its points' rays project.
struct HostGeometry {
  Eigen::Matrix3f KRKi;
  Eigen::Vector3f Kt;
  float gain = 1.0F, bias = 0.0F;
  PairViewShift shift;
  Eigen::Matrix3f K = Eigen::Matrix3f::Identity();
  Eigen::Vector3f t = Eigen::Vector3f::Zero();  ///< Kt is K times it.
};

HostGeometry host_geometry(const CameraModel& camera, const SE3& T_target_host,
                           const BrightnessTransfer& transfer);

/// What a search compares the image with, four of the pattern's pixels a lane.
struct SearchPattern {
  /// Offsets from the pattern's centre in the searched image: the pattern as the upper 2x2 of
  /// K R K^-1 turns and stretches it [px].
  std::array<Lane, 2> x, y;
  std::array<Lane, 2> colour;          ///< Grey levels that it should find: gain * colour + bias.
  std::array<Lane, 2> squared_weight;  ///< Of the pixels [1].
};

SearchPattern search_pattern(const HostGeometry& geometry, const ImmaturePoint& point);

/// Photometric residuals of a pattern and their derivatives along a line.
struct LineResiduals {
  std::array<Lane, 2> r;      ///< [grey levels]
  std::array<Lane, 2> slope;  ///< d r / d t [grey levels / px].
};

/// What Gauss-Newton along the epipolar line needs at (u, v), with the line's unit direction
/// (dx, dy) and the pattern's warped offsets o_i:
///   r_i(t) = I((u, v) + t (dx, dy) + o_i) - (gain * colour_i + bias),
///   dr_i/dt = grad I . (dx, dy), both at t = 0.
/// The pattern must lie in the image, a pixel from its border.
LineResiduals line_residuals(const ImageF& image, const SearchPattern& pattern, float u, float v,
                             float dx, float dy);

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
