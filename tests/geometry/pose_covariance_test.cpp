#include "sovo/geometry/pose_covariance.h"

#include <gtest/gtest.h>

namespace sovo {
namespace {

Mat6 some_covariance() {
  Mat6 root;
  for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = std::sin(1.7 * i + 0.3);
  return root * root.transpose();
}

/// A pose whose position and rotation about world axes err by `error`.
SE3 erring(const SE3& T, const Vec6& error) {
  return {SO3::exp(error.tail<3>()) * T.rotation(), T.translation() + error.head<3>()};
}

Vec6 error_of(const SE3& erring, const SE3& T) {
  Vec6 error;
  error << erring.translation() - T.translation(),
      (erring.rotation() * T.rotation().inverse()).log();
  return error;
}

TEST(PoseCovariance, IsCarriedAsErrorsAre) {
  const SE3 first(SO3::exp(Vec3(0.3, -0.2, 0.5)), Vec3(1, 2, 3));
  const SE3 step(SO3::exp(Vec3(-0.1, 0.4, 0.2)), Vec3(0.7, -0.3, 2.0));
  const SE3 second = first * step;
  constexpr double kSmall = 1e-6;
  Mat6 J;
  for (int i = 0; i < 6; ++i) {
    const Vec6 e = kSmall * Vec6::Unit(i);
    J.col(i) =
        (error_of(erring(first, e) * step, second) - error_of(erring(first, -e) * step, second)) /
        (2.0 * kSmall);
  }
  const Mat6 covariance = some_covariance();
  const Mat6 expected = J * covariance * J.transpose();
  EXPECT_TRUE(
      carried(covariance, second.translation() - first.translation()).isApprox(expected, 1e-6));
}

TEST(PoseCovariance, TurnsWithItsAxes) {
  const SO3 R = SO3::exp(Vec3(0.4, -1.0, 0.7));
  const Mat6 covariance = some_covariance();
  const Mat6 turned = rotated(R, covariance);
  const Vec6 v = (Vec6() << 1, -2, 3, 0.5, 0.1, -0.7).finished();
  Vec6 turned_v;
  turned_v << R * Vec3(v.head<3>()), R * Vec3(v.tail<3>());
  EXPECT_NEAR(turned_v.dot(turned * turned_v), v.dot(covariance * v), 1e-9 * covariance.norm());
  EXPECT_TRUE(rotated(R.inverse(), turned).isApprox(covariance, 1e-12));
}

}  // namespace
}  // namespace sovo
