#include "sovo/geometry/se3.h"

namespace sovo {

namespace {

/// Barfoot eq. 7.86b: the coupling block Q of the left Jacobian.
Mat3 coupling(const Vec3& rho, const Vec3& phi) {
  const Mat3 p = hat(phi);
  const Mat3 r = hat(rho);
  const double t2 = phi.squaredNorm();
  double c1 = 1.0 / 6.0;
  double c2 = 1.0 / 24.0;
  double c3 = 1.0 / 120.0;
  if (t2 > 1e-4) {
    const double t = std::sqrt(t2);
    c1 = (t - std::sin(t)) / (t2 * t);
    c2 = (t2 + 2.0 * std::cos(t) - 2.0) / (2.0 * t2 * t2);
    c3 = (2.0 * t - 3.0 * std::sin(t) + t * std::cos(t)) / (2.0 * t2 * t2 * t);
  } else {
    c1 -= t2 / 120.0;
    c2 -= t2 / 720.0;
    c3 -= t2 / 2520.0;
  }
  return 0.5 * r + c1 * (p * r + r * p + p * r * p) +
         c2 * (p * p * r + r * p * p - 3.0 * p * r * p) + c3 * (p * r * p * p + p * p * r * p);
}

}  // namespace

Mat6 SE3::left_jacobian(const Vec6& x) {
  Mat6 m = Mat6::Zero();
  const Mat3 j = SO3::left_jacobian(x.tail<3>());
  m.topLeftCorner<3, 3>() = j;
  m.bottomRightCorner<3, 3>() = j;
  m.topRightCorner<3, 3>() = coupling(x.head<3>(), x.tail<3>());
  return m;
}

}  // namespace sovo
