#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/types.h"
#include "sovo/vo/tracking_reference.h"

namespace sovo {

/// Where a motion moves the points of a level, in homogeneous pixels.
struct PointTransfer {
  PointTransfer(const CameraModel& camera, const SE3& T) {
    const Mat3 K = camera.matrix();
    KRKi = (K * T.rotation_matrix() * K.inverse()).cast<float>();
    Kt = (K * T.translation()).cast<float>();
  }
  Eigen::Vector3f operator()(const ReferenceLevel& level, std::size_t i) const {
    return KRKi * Eigen::Vector3f(level.u[i], level.v[i], 1.0F) + level.rho[i] * Kt;
  }
  Eigen::Matrix3f KRKi;
  Eigen::Vector3f Kt;
};

}  // namespace sovo
