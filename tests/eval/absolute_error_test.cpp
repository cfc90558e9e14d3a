#include "sovo/eval/absolute_error.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sovo {
namespace {

std::vector<SE3> helix(int count) {
  std::vector<SE3> poses;
  for (int i = 0; i < count; ++i) {
    const double a = 0.05 * i;
    poses.push_back({SO3::exp(Vec3(0.1 * a, a, -0.2)), Vec3(3 * std::cos(a), 2 * std::sin(a), a)});
  }
  return poses;
}

std::vector<SE3> moved(const std::vector<SE3>& poses, const Sim3& s) {
  std::vector<SE3> out;
  for (const SE3& p : poses) out.push_back({s.rotation() * p.rotation(), s * p.translation()});
  return out;
}

TEST(AbsoluteError, RigidAlignmentFindsTheMotion) {
  const std::vector<SE3> truth = helix(80);
  const Sim3 S(1.0, SO3::exp(Vec3(0.5, -1.0, 2.0)), Vec3(10.0, -4.0, 2.0));
  const AbsoluteError e = absolute_error(truth, moved(truth, S.inverse()), AlignmentKind::kRigid);
  EXPECT_NEAR(e.translation.rmse, 0.0, 1e-12);
  EXPECT_NEAR((e.S_truth_estimate * S.inverse()).log().norm(), 0.0, 1e-12);
}

TEST(AbsoluteError, SimilarityAlignmentFindsTheScaleAndRigidDoesNot) {
  const std::vector<SE3> truth = helix(80);
  const Sim3 S(1.25, SO3::exp(Vec3(0.5, -1.0, 2.0)), Vec3(10.0, -4.0, 2.0));
  const std::vector<SE3> estimate = moved(truth, S.inverse());
  const AbsoluteError similar = absolute_error(truth, estimate, AlignmentKind::kSimilarity);
  EXPECT_NEAR(similar.S_truth_estimate.scale(), 1.25, 1e-12);
  EXPECT_NEAR(similar.translation.max, 0.0, 1e-12);
  const AbsoluteError rigid = absolute_error(truth, estimate, AlignmentKind::kRigid);
  EXPECT_EQ(rigid.S_truth_estimate.scale(), 1.0);
  EXPECT_GT(rigid.translation.rmse, 0.1);
}

TEST(AbsoluteError, YawAlignmentLeavesATiltVisible) {
  const std::vector<SE3> truth = helix(80);
  const Sim3 turned(1.0, SO3::exp(Vec3(0.0, 0.0, 2.5)), Vec3(1.0, 2.0, 3.0));
  const Sim3 tilted(1.0, SO3::exp(Vec3(0.1, 0.0, 0.0)), Vec3::Zero());
  EXPECT_NEAR(absolute_error(truth, moved(truth, turned), AlignmentKind::kYaw).translation.rmse,
              0.0, 1e-12);
  EXPECT_GT(absolute_error(truth, moved(truth, tilted), AlignmentKind::kYaw).translation.rmse,
            0.01);
  EXPECT_NEAR(absolute_error(truth, moved(truth, tilted), AlignmentKind::kRigid).translation.rmse,
              0.0, 1e-12);
}

TEST(AbsoluteError, MirroredPointsGetARotationNotAReflection) {
  std::vector<Vec3> from;
  std::vector<Vec3> to;
  for (const SE3& p : helix(80)) {
    from.push_back(p.translation());
    to.push_back(p.translation().cwiseProduct(Vec3(-1.0, 1.0, 1.0)));
  }
  const Sim3 S = align(from, to, AlignmentKind::kRigid);
  EXPECT_NEAR(S.rotation().matrix().determinant(), 1.0, 1e-12);
}

TEST(AbsoluteError, NoisePerAxisIsTheRmse) {
  // Alternating offsets of 0.1 m that no rigid motion can explain.
  std::vector<SE3> truth;
  std::vector<SE3> estimate;
  for (int i = 0; i < 400; ++i) {
    const Vec3 p(std::cos(0.1 * i) * 50.0, std::sin(0.1 * i) * 50.0, 0.0);
    truth.push_back({SO3(), p});
    estimate.push_back({SO3(), p + Vec3(0.0, 0.0, i % 2 == 0 ? 0.1 : -0.1)});
  }
  const AbsoluteError e = absolute_error(truth, estimate, AlignmentKind::kRigid);
  EXPECT_NEAR(e.translation.rmse, 0.1, 1e-4);
  EXPECT_NEAR(e.translation.median, 0.1, 1e-3);
}

TEST(AbsoluteError, StandingStillIsNotAnError) {
  const std::vector<SE3> truth(10, SE3(SO3(), Vec3(1.0, 2.0, 3.0)));
  const std::vector<SE3> estimate(10, SE3());
  for (const auto kind : {AlignmentKind::kRigid, AlignmentKind::kSimilarity, AlignmentKind::kYaw}) {
    const AbsoluteError e = absolute_error(truth, estimate, kind);
    EXPECT_NEAR(e.translation.rmse, 0.0, 1e-12);
    EXPECT_EQ(e.S_truth_estimate.scale(), 1.0);
  }
}

TEST(RotationErrors, IgnoreTheWorldAndSeeTheRest) {
  std::vector<SE3> truth;
  std::vector<SE3> estimate;
  const SO3 world = SO3::exp(Vec3(1.0, 2.0, -0.5));
  for (int i = 0; i < 100; ++i) {
    // A straight line: positions alone would leave the roll about it open.
    truth.push_back({SO3::exp(Vec3(0.0, 0.01 * i, 0.0)), Vec3(0.0, 0.0, i)});
    const SO3 wobble = SO3::exp(Vec3(i % 2 == 0 ? 0.02 : -0.02, 0.0, 0.0));
    estimate.push_back({world * wobble * truth.back().rotation(), Vec3(0.0, 0.0, i)});
  }
  for (const double e : rotation_errors(truth, estimate)) EXPECT_NEAR(e, 0.02, 1e-9);
}

}  // namespace
}  // namespace sovo
