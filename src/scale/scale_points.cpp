#include "sovo/scale/scale_points.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sovo/image/interpolation.h"

namespace sovo {

namespace {

constexpr std::array kArrays = {&ScalePoints::u,         &ScalePoints::v,
                                &ScalePoints::mx,        &ScalePoints::my,
                                &ScalePoints::mz,        &ScalePoints::ray_offset,
                                &ScalePoints::reference, &ScalePoints::inverse_depth,
                                &ScalePoints::visible,   &ScalePoints::relative_variance};

bool usable(const KeyframePoints& points, std::size_t i) {
  return points.inverse_depth[i] > 0.0F && std::isfinite(points.inverse_depth[i]) &&
         points.sigma[i] >= 0.0F && std::isfinite(points.u[i]) && std::isfinite(points.v[i]);
}

int padded_size(std::size_t n) {
  const int lanes = ScalePoints::kLanes;
  return (static_cast<int>(n) + lanes - 1) / lanes * lanes;
}

}  // namespace

void ScalePoints::prepare(const KeyframeSnapshot& keyframe, const StereoRig& rig,
                          const SE3& T_later_left, double min_relative_sigma) {
  const KeyframePoints& points = keyframe.points;
  const auto n = static_cast<std::size_t>(padded_size(points.size()));
  for (const auto array : kArrays) (this->*array).assign(n, 1.0F);
  visible.assign(n, 0.0F);
  const Mat3 r = rig.T_right_left.rotation_matrix();
  const Vec3 translation = rig.T_right_left.translation();
  for (int i = 0; i < 3; ++i) t[i] = static_cast<float>(translation[i]);
  const Mat3 turn = T_later_left.rotation_matrix();
  const Vec3 shift = T_later_left.translation();
  const CameraModel& camera = keyframe.camera;
  const Vec3 pane = camera.port ? Vec3(r * (turn * camera.port->normal)) : Vec3(Vec3::Zero());
  for (int i = 0; i < 3; ++i) normal[i] = static_cast<float>(pane[i]);
  std::size_t k = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!usable(points, i)) continue;
    const double x = (static_cast<double>(points.u[i]) - camera.cx) / camera.fx;
    const double y = (static_cast<double>(points.v[i]) - camera.cy) / camera.fy;
    u[k] = points.u[i];
    v[k] = points.v[i];
    const Vec3 ray = turn * Vec3(x, y, 1.0) + static_cast<double>(points.inverse_depth[i]) * shift;
    const Vec3 m = r * ray;
    mx[k] = static_cast<float>(m.x());
    my[k] = static_cast<float>(m.y());
    mz[k] = static_cast<float>(m.z());
    ray_offset[k] = camera.port ? static_cast<float>(camera.port->offset(Vec3(x, y, 1.0))) : 0.0F;
    inverse_depth[k] = points.inverse_depth[i];
    const float relative =
        std::max(points.sigma[i] / points.inverse_depth[i], static_cast<float>(min_relative_sigma));
    relative_variance[k] = relative * relative;
    visible[k] = 1.0F;
    ++k;
  }
  size = static_cast<int>(k);
  padded = padded_size(k);
}

void ScalePoints::turn_right(const Vec3& turn) {
  const Eigen::Matrix3f r = SO3::exp(turn).matrix().cast<float>();
  const Eigen::Vector3f translation = r * Eigen::Vector3f(t[0], t[1], t[2]);
  std::copy_n(translation.data(), 3, t);
  const Eigen::Vector3f pane = r * Eigen::Vector3f(normal[0], normal[1], normal[2]);
  std::copy_n(pane.data(), 3, normal);
  for (std::size_t i = 0; i < static_cast<std::size_t>(padded); ++i) {
    const Eigen::Vector3f m = r * Eigen::Vector3f(mx[i], my[i], mz[i]);
    mx[i] = m.x();
    my[i] = m.y();
    mz[i] = m.z();
  }
}

void ScalePoints::take_every(int stride, const ScalePoints& all) {
  size = all.size / stride;
  padded = padded_size(static_cast<std::size_t>(size));
  std::copy(all.t, all.t + 3, t);
  std::copy(all.normal, all.normal + 3, normal);
  for (const auto array : kArrays) {
    const AlignedVector<float>& source = all.*array;
    AlignedVector<float>& target = this->*array;
    target.assign(static_cast<std::size_t>(padded), 1.0F);
    for (std::size_t i = 0; i < static_cast<std::size_t>(size); ++i) {
      target[i] = source[i * static_cast<std::size_t>(stride)];
    }
  }
  std::fill(visible.begin() + size, visible.end(), 0.0F);
}

void ScalePoints::sample_reference(const ImageF& left, int level) {
  const float factor = 1.0F / static_cast<float>(1 << level);
  const float offset = 0.5F * factor - 0.5F;
  const float max_x = static_cast<float>(left.width()) - 1.001F;
  const float max_y = static_cast<float>(left.height()) - 1.001F;
  for (std::size_t i = 0; i < static_cast<std::size_t>(size); ++i) {
    const float x = std::clamp(u[i] * factor + offset, 0.0F, max_x);
    const float y = std::clamp(v[i] * factor + offset, 0.0F, max_y);
    reference[i] = sample(left, x, y);
  }
}

}  // namespace sovo
