#include "sovo/image/stereo_rectification.h"

#include <algorithm>
#include <cmath>

namespace sovo {
namespace {

constexpr double kWidestTangent = 1.19;  // of half of 100 degrees

/// Axes (rows) of the rectified frame in left camera coordinates.
Mat3 rectified_axes(const StereoRig& rig, bool* vertical) {
  const SE3 T_left_right = rig.T_right_left.inverse();
  const Vec3 baseline = T_left_right.translation().normalized();
  // Between the two viewing directions, so that both images turn by as little as can be.
  const Vec3 forward =
      (Vec3::UnitZ() + T_left_right.rotation_matrix() * Vec3::UnitZ()).normalized();
  *vertical = std::abs(baseline.y()) > std::abs(baseline.x());
  Mat3 axes;
  if (*vertical) {
    axes.row(1) = (baseline.y() < 0.0 ? Vec3(-baseline) : baseline).transpose();
    axes.row(0) = axes.row(1).cross(forward.transpose()).normalized();
  } else {
    axes.row(0) = (baseline.x() < 0.0 ? Vec3(-baseline) : baseline).transpose();
    axes.row(1) = forward.transpose().cross(axes.row(0)).normalized();
  }
  axes.row(2) = axes.row(0).cross(axes.row(1));
  return axes;
}

/// Interval of tangents.
struct Extent {
  double low = -kWidestTangent;
  double high = kWidestTangent;

  void limit_low(double v) { low = std::clamp(v, low, -1e-2); }
  void limit_high(double v) { high = std::clamp(v, 1e-2, high); }
  double size() const { return high - low; }
  double middle() const { return 0.5 * (low + high); }
};

struct View {
  Extent x;
  Extent y;
};

/// Tangents at the middles of the four edges of a raw image, in the rectified frame.
View inner_view(const CameraModel& raw, const Mat3& R_rectified_raw) {
  View view;
  const double right = raw.width - 1;
  const double bottom = raw.height - 1;
  const auto tangent = [&](double u, double v) -> std::optional<Vec2> {
    const auto ray = raw.unproject({u, v});
    if (!ray) return std::nullopt;
    const Vec3 r = R_rectified_raw * *ray;
    if (r.z() <= 0.0) return std::nullopt;
    return Vec2(r.x() / r.z(), r.y() / r.z());
  };
  for (const double s : {0.25, 0.5, 0.75}) {
    if (const auto t = tangent(0.0, s * bottom)) view.x.limit_low(t->x());
    if (const auto t = tangent(right, s * bottom)) view.x.limit_high(t->x());
    if (const auto t = tangent(s * right, 0.0)) view.y.limit_low(t->y());
    if (const auto t = tangent(s * right, bottom)) view.y.limit_high(t->y());
  }
  return view;
}

CameraModel pinhole_of(const CameraModel& raw, double focal, double middle_x, double middle_y) {
  CameraModel pinhole;
  pinhole.width = raw.width;
  pinhole.height = raw.height;
  pinhole.fx = pinhole.fy = focal;
  pinhole.cx = 0.5 * (raw.width - 1) - focal * middle_x;
  pinhole.cy = 0.5 * (raw.height - 1) - focal * middle_y;
  return pinhole;
}

}  // namespace

StereoRectification rectify(const StereoRig& rig) {
  StereoRectification result;
  result.R_left = rectified_axes(rig, &result.vertical);
  result.R_right = result.R_left * rig.T_right_left.rotation_matrix().transpose();
  result.t_right_left = result.R_right * rig.T_right_left.translation();
  const View left = inner_view(rig.left, result.R_left);
  const View right = inner_view(rig.right, result.R_right);
  const double focal =
      std::max({(rig.left.width - 1) / left.x.size(), (rig.left.height - 1) / left.y.size(),
                (rig.right.width - 1) / right.x.size(), (rig.right.height - 1) / right.y.size()});
  result.left = pinhole_of(rig.left, focal, left.x.middle(), left.y.middle());
  result.right = pinhole_of(rig.right, focal, right.x.middle(), right.y.middle());
  // One row, or one column, for both images of a point.
  double CameraModel::*const shared = result.vertical ? &CameraModel::cx : &CameraModel::cy;
  const double mean = 0.5 * (result.left.*shared + result.right.*shared);
  result.left.*shared = result.right.*shared = mean;
  return result;
}

RotatedUndistorter::RotatedUndistorter(const CameraModel& raw, const CameraModel& rectified,
                                       const Mat3& R_rectified_raw) {
  const Mat3 R_raw_rectified = R_rectified_raw.transpose();
  taps_.resize(static_cast<std::size_t>(rectified.width) * rectified.height);
  for (int y = 0; y < rectified.height; ++y) {
    for (int x = 0; x < rectified.width; ++x) {
      const Vec3 ray((x - rectified.cx) / rectified.fx, (y - rectified.cy) / rectified.fy, 1.0);
      const auto source = raw.project(R_raw_rectified * ray);
      if (!source || !raw.contains(*source)) continue;
      const int ix = std::min(static_cast<int>(source->x()), raw.width - 2);
      const int iy = std::min(static_cast<int>(source->y()), raw.height - 2);
      Tap& tap = taps_[static_cast<std::size_t>(y) * rectified.width + x];
      tap.x = static_cast<std::int16_t>(ix);
      tap.y = static_cast<std::int16_t>(iy);
      tap.fx = static_cast<std::uint8_t>(std::lround(128.0 * (source->x() - ix)));
      tap.fy = static_cast<std::uint8_t>(std::lround(128.0 * (source->y() - iy)));
    }
  }
}

void RotatedUndistorter::apply(std::span<const std::uint8_t> raw, int step,
                               std::vector<std::uint8_t>* out) const {
  out->resize(taps_.size());
  for (std::size_t i = 0; i < taps_.size(); ++i) {
    const Tap& tap = taps_[i];
    if (tap.x < 0) {
      (*out)[i] = 0;
      continue;
    }
    const std::uint8_t* above = raw.data() + static_cast<std::ptrdiff_t>(tap.y) * step + tap.x;
    const std::uint8_t* below = above + step;
    const int top = above[0] * (128 - tap.fx) + above[1] * tap.fx;
    const int bottom = below[0] * (128 - tap.fx) + below[1] * tap.fx;
    (*out)[i] =
        static_cast<std::uint8_t>((top * (128 - tap.fy) + bottom * tap.fy + (1 << 13)) >> 14);
  }
}

}  // namespace sovo
