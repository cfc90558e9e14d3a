#include "sovo/vo/row_turn.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "sovo/image/halving.h"
#include "sovo/image/interpolation.h"

namespace sovo {

namespace {

/// Pose, brightness, turn.
constexpr int kStates = 11;
using TurnStates = Eigen::Matrix<double, kStates, 1>;
using TurnHessian = Eigen::Matrix<double, kStates, kStates>;

/// d r / d (pose, log-gain, bias, turn a second) of what is seen at `p`, with the image gradient
/// times the focal length, `time` after the image's instant [s].
TurnStates jacobian(const Vec3& p, double rho, const Vec2& gradient, double gained_colour,
                    double time) {
  const double iz = 1.0 / p.z();
  const double x = p.x() * iz;
  const double y = p.y() * iz;
  const double along = x * gradient.x() + y * gradient.y();
  TurnStates J;
  J.head<3>() = rho * iz * Vec3(gradient.x(), gradient.y(), -along);
  J.segment<3>(3) = Vec3(-gradient.y() - y * along, gradient.x() + x * along,
                         x * gradient.y() - y * gradient.x());
  J[6] = -gained_colour;
  J[7] = -1.0;
  J.tail<3>() = time * J.segment<3>(3);
  return J;
}

}  // namespace

std::optional<ReadoutTurn> measure_row_turn(const ReferenceLevel& level, const ImageF& image,
                                            const SE3& T_current_reference,
                                            const BrightnessTransfer& transfer, double huber,
                                            const RowShift& rows, int halvings) {
  const CameraModel& camera = level.camera;
  const Mat3 R = T_current_reference.rotation_matrix();
  const Vec3& t = T_current_reference.translation();
  TurnHessian H = TurnHessian::Zero();
  TurnStates b = TurnStates::Zero();
  for (std::size_t i = 0; i < level.size(); ++i) {
    const double rho = level.rho[i];
    const Vec3 ray((level.u[i] - camera.cx) / camera.fx, (level.v[i] - camera.cy) / camera.fy, 1.0);
    const Vec3 p = R * ray + rho * t;
    if (!(p.z() > 0.0)) continue;
    const auto u = static_cast<float>(camera.fx * p.x() / p.z() + camera.cx);
    const auto v = static_cast<float>(camera.fy * p.y() / p.z() + camera.cy);
    if (!in_image(image, u, v)) continue;
    const Sample s = sample_with_gradient(image, u, v);
    const double gained = transfer.gain * level.colour[i];
    const double r = s.value - gained - transfer.bias;
    const double weight = std::abs(r) <= huber ? 1.0 : huber / std::abs(r);
    const double time = (from_halved(v, halvings) - rows.middle) * rows.seconds;
    const TurnStates J = jacobian(p, rho, {s.gx * camera.fx, s.gy * camera.fy}, gained, time);
    H.noalias() += weight * J * J.transpose();
    b.noalias() += weight * r * J;
  }
  // What is left of the turn once everything else has its best value.
  const Eigen::LDLT<Mat8> rest(H.topLeftCorner<8, 8>());
  if (rest.info() != Eigen::Success || !rest.isPositive()) return std::nullopt;
  const Eigen::Matrix<double, 8, 3> cross = H.topRightCorner<8, 3>();
  ReadoutTurn out;
  out.information = H.bottomRightCorner<3, 3>() - cross.transpose() * rest.solve(cross);
  const Vec3 gradient = b.tail<3>() - cross.transpose() * rest.solve(Vec8(b.head<8>()));
  const Eigen::LDLT<Mat3> turn(out.information);
  if (turn.info() != Eigen::Success || !(turn.vectorD().minCoeff() > 0.0)) return std::nullopt;
  out.rate = -turn.solve(gradient);
  return out;
}

}  // namespace sovo
