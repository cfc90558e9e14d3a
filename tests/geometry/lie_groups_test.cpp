#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>
#include <vector>

#include "sovo/geometry/se3.h"
#include "sovo/geometry/sim3.h"
#include "sovo/geometry/so3.h"
#include "support/numeric.h"
#include "support/synthetic_scene.h"

namespace sovo {
namespace {

Vec3 random_vector(std::mt19937& random) {
  return {test::normal(random), test::normal(random), test::normal(random)};
}

/// Angles from nothing over the switches of the series to nearly pi.
const std::vector<double> kAngles = {0.0,    1e-12,  1e-9, 1e-6, 1e-5, 0.9e-4, 1.1e-4,     1e-3,
                                     0.9e-2, 1.1e-2, 0.1,  1.0,  2.0,  3.0,    M_PI - 1e-6};

std::vector<Vec3> rotation_vectors() {
  std::mt19937 random(7);
  std::vector<Vec3> out;
  for (const double angle : kAngles) out.push_back(angle * random_vector(random).normalized());
  return out;
}

/// exp(hat(w)) by squaring a Taylor series: independent of the closed forms.
template <class Matrix>
Matrix matrix_exp(const Matrix& a) {
  const Matrix small = a / 1024.0;
  Matrix term = Matrix::Identity();
  Matrix sum = term;
  for (int i = 1; i < 12; ++i) {
    term = term * small / i;
    sum += term;
  }
  for (int i = 0; i < 10; ++i) sum = sum * sum;
  return sum;
}

TEST(SO3, ExpIsTheMatrixExponential) {
  for (const Vec3& w : rotation_vectors()) {
    EXPECT_LT((SO3::exp(w).matrix() - matrix_exp<Mat3>(hat(w))).norm(), 1e-12) << w.norm();
  }
}

TEST(SO3, LogInvertsExp) {
  for (const Vec3& w : rotation_vectors()) {
    EXPECT_LT((SO3::exp(w).log() - w).norm(), 1e-9 * std::max(1.0, w.norm())) << w.norm();
  }
  // Past pi the short way round comes back.
  const Vec3 axis = Vec3(1.0, -2.0, 0.5).normalized();
  EXPECT_LT((SO3::exp(4.0 * axis).log() - (4.0 - 2.0 * M_PI) * axis).norm(), 1e-12);
}

TEST(SO3, GroupAndAdjoint) {
  std::mt19937 random(1);
  for (int i = 0; i < 20; ++i) {
    const SO3 a = SO3::exp(random_vector(random));
    const SO3 b = SO3::exp(random_vector(random));
    const Vec3 v = random_vector(random);
    EXPECT_LT(((a * b) * v - a * (b * v)).norm(), 1e-12);
    EXPECT_LT((a.inverse() * (a * v) - v).norm(), 1e-12);
    EXPECT_LT(
        ((a * SO3::exp(v) * a.inverse()).matrix() - SO3::exp(a.adjoint() * v).matrix()).norm(),
        1e-12);
  }
}

TEST(SO3, LeftJacobianIsTheDerivativeOfExp) {
  for (const Vec3& w : rotation_vectors()) {
    const SO3 inverse = SO3::exp(w).inverse();
    const Mat3 numeric = test::central_differences<3, 3>(
        [&](const Vec3& e) { return (SO3::exp(w + e) * inverse).log(); }, Vec3(Vec3::Zero()));
    EXPECT_LT(test::relative_difference(SO3::left_jacobian(w), numeric), 1e-8) << w.norm();
    const Mat3 product = SO3::left_jacobian_inverse(w) * SO3::left_jacobian(w);
    EXPECT_LT((product - Mat3::Identity()).norm(), 1e-9) << w.norm();
  }
}

TEST(SE3, ExpIsTheMatrixExponential) {
  std::mt19937 random(2);
  for (const Vec3& w : rotation_vectors()) {
    Vec6 x;
    x << random_vector(random), w;
    Mat4 generator = Mat4::Zero();
    generator.topLeftCorner<3, 3>() = hat(w);
    generator.topRightCorner<3, 1>() = x.head<3>();
    EXPECT_LT((SE3::exp(x).matrix() - matrix_exp<Mat4>(generator)).norm(), 1e-11) << w.norm();
    EXPECT_LT((SE3::exp(x).log() - x).norm(), 1e-8) << w.norm();
  }
}

TEST(SE3, GroupAndAdjoint) {
  std::mt19937 random(3);
  for (int i = 0; i < 20; ++i) {
    Vec6 x;
    Vec6 y;
    x << random_vector(random), random_vector(random);
    y << random_vector(random), 0.5 * random_vector(random);
    const SE3 a = SE3::exp(x);
    const SE3 b = SE3::exp(y);
    const Vec3 p = random_vector(random);
    EXPECT_LT(((a * b) * p - a * (b * p)).norm(), 1e-12);
    EXPECT_LT((a.inverse() * (a * p) - p).norm(), 1e-12);
    EXPECT_LT((a.matrix() * b.matrix() - (a * b).matrix()).norm(), 1e-12);
    EXPECT_LT(((a * b * a.inverse()).matrix() - SE3::exp(a.adjoint() * y).matrix()).norm(), 1e-11);
  }
}

TEST(SE3, LeftJacobianIsTheDerivativeOfExp) {
  std::mt19937 random(4);
  for (const Vec3& w : rotation_vectors()) {
    if (w.norm() > 3.1) continue;  // log jumps at pi
    Vec6 x;
    x << random_vector(random), w;
    const SE3 inverse = SE3::exp(x).inverse();
    const Mat6 numeric = test::central_differences<6, 6>(
        [&](const Vec6& e) { return (SE3::exp(x + e) * inverse).log(); }, Vec6(Vec6::Zero()));
    EXPECT_LT(test::relative_difference(SE3::left_jacobian(x), numeric), 1e-7) << w.norm();
  }
}

/// (angle, log-scale) around every switch between series and closed form.
std::vector<Vec7> similarities() {
  std::mt19937 random(5);
  std::vector<Vec7> out;
  for (const double angle : {0.0, 1e-9, 0.9e-5, 1.1e-5, 1e-3, 0.3, 2.5}) {
    for (const double sigma : {0.0, 1e-12, 0.9e-5, -1.1e-5, 1e-4, -1e-3, 0.1, -1.0, 4.6}) {
      Vec7 x;
      x << random_vector(random), angle * random_vector(random).normalized(), sigma;
      out.push_back(x);
    }
  }
  return out;
}

TEST(Sim3, ExpIsTheMatrixExponential) {
  for (const Vec7& x : similarities()) {
    Mat4 generator = Mat4::Zero();
    generator.topLeftCorner<3, 3>() = hat(x.segment<3>(3)) + x[6] * Mat3::Identity();
    generator.topRightCorner<3, 1>() = x.head<3>();
    const Mat4 expected = matrix_exp<Mat4>(generator);
    const Sim3 s = Sim3::exp(x);
    Mat4 m = Mat4::Identity();
    m.topLeftCorner<3, 3>() = s.scale() * s.rotation().matrix();
    m.topRightCorner<3, 1>() = s.translation();
    EXPECT_LT(test::relative_difference(m, expected), 1e-9)
        << "angle " << x.segment<3>(3).norm() << " log-scale " << x[6];
  }
}

TEST(Sim3, LogInvertsExp) {
  for (const Vec7& x : similarities()) {
    EXPECT_LT((Sim3::exp(x).log() - x).norm(), 1e-9 * std::max(1.0, x.norm()))
        << "angle " << x.segment<3>(3).norm() << " log-scale " << x[6];
  }
}

TEST(Sim3, GroupAndAdjoint) {
  std::mt19937 random(6);
  for (int i = 0; i < 20; ++i) {
    Vec7 x;
    Vec7 y;
    x << random_vector(random), random_vector(random), 0.3 * test::normal(random);
    y << random_vector(random), 0.5 * random_vector(random), 0.3 * test::normal(random);
    const Sim3 a = Sim3::exp(x);
    const Sim3 b = Sim3::exp(y);
    const Vec3 p = random_vector(random);
    EXPECT_LT(((a * b) * p - a * (b * p)).norm(), 1e-11);
    EXPECT_LT((a.inverse() * (a * p) - p).norm(), 1e-11);
    const Sim3 left = a * b * a.inverse();
    const Sim3 right = Sim3::exp(a.adjoint() * y);
    EXPECT_NEAR(left.scale(), right.scale(), 1e-12);
    EXPECT_LT((left * p - right * p).norm(), 1e-10);
  }
}

}  // namespace
}  // namespace sovo
