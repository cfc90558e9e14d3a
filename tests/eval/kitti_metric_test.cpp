#include "sovo/eval/kitti_metric.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sovo {
namespace {

std::vector<SE3> straight_line(int count, double step) {
  std::vector<SE3> poses;
  for (int i = 0; i < count; ++i) poses.push_back({SO3(), Vec3(0.0, 0.0, step * i)});
  return poses;
}

TEST(KittiMetric, PerfectEstimateHasNoErrorInAnyWorld) {
  const std::vector<SE3> truth = straight_line(300, 1.0);
  const SE3 world(SO3::exp(Vec3(0.3, -0.2, 0.9)), Vec3(5.0, 6.0, 7.0));
  std::vector<SE3> estimate;
  for (const SE3& pose : truth) estimate.push_back(world * pose);
  const auto segments = kitti_segments(truth, estimate, kitti_lengths(), 10);
  ASSERT_FALSE(segments.empty());
  const SegmentSummary sum = summarize(segments);
  EXPECT_NEAR(sum.translation_mean, 0.0, 1e-12);
  EXPECT_NEAR(sum.rotation_mean, 0.0, 1e-12);
}

TEST(KittiMetric, PieceEndsAtTheFirstFrameBeyondTheLength) {
  const std::vector<SE3> truth = straight_line(150, 1.0);
  const std::vector<double> lengths{100.0};
  const auto segments = kitti_segments(truth, truth, lengths, 10);
  // Frame 100 is exactly 100 m away, which is not beyond; starts 0, 10, 20, 30, 40 have an end.
  ASSERT_EQ(segments.size(), 5U);
  EXPECT_EQ(segments[0].first_frame, 0);
  EXPECT_EQ(segments[0].last_frame, 101);
  EXPECT_EQ(segments[4].first_frame, 40);
}

TEST(KittiMetric, StepOfOneUsesEveryStart) {
  const std::vector<SE3> truth = straight_line(150, 1.0);
  const std::vector<double> lengths{100.0};
  EXPECT_EQ(kitti_segments(truth, truth, lengths, 1).size(), 49U);
}

TEST(KittiMetric, ScaleErrorShowsAsItselfAndVanishesAtTheBestScale) {
  const std::vector<SE3> truth = straight_line(300, 1.0);
  const std::vector<SE3> estimate = straight_line(300, 0.98);
  const std::vector<double> lengths{100.0, 200.0};
  const auto segments = kitti_segments(truth, estimate, lengths, 10);
  ASSERT_FALSE(segments.empty());
  for (const SegmentError& s : segments) {
    EXPECT_NEAR(s.translation, 0.02 * (s.length + 1.0) / s.length, 1e-12);
    EXPECT_NEAR(s.rotation, 0.0, 1e-12);
    EXPECT_NEAR(s.best_scale, 1.0 / 0.98, 1e-12);
    EXPECT_NEAR(s.translation_best, 0.0, 1e-12);
  }
}

TEST(KittiMetric, ConstantYawRateShowsAsRotationPerMetre) {
  const std::vector<SE3> truth = straight_line(300, 1.0);
  std::vector<SE3> estimate;
  for (int i = 0; i < 300; ++i) {
    estimate.push_back({SO3::exp(Vec3(0.0, 1e-4 * i, 0.0)), truth[i].translation()});
  }
  const std::vector<double> lengths{100.0};
  const SegmentSummary sum = summarize(kitti_segments(truth, estimate, lengths, 10));
  EXPECT_NEAR(sum.rotation_mean, 1e-4 * 101 / 100.0, 1e-12);
  EXPECT_NEAR(sum.rotation_rms, sum.rotation_mean, 1e-12);
}

TEST(KittiMetric, SummaryByLengthLeavesOutLengthsWithoutPieces) {
  const std::vector<SE3> truth = straight_line(250, 1.0);
  const auto lengths = kitti_lengths();
  const auto rows = summarize_by_length(kitti_segments(truth, truth, lengths, 10), lengths);
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].length, 100.0);
  EXPECT_EQ(rows[1].length, 200.0);
}

TEST(KittiMetric, MeanAndRmsDiffer) {
  std::vector<SegmentError> segments(2);
  segments[0].translation = 0.01;
  segments[1].translation = 0.03;
  const SegmentSummary sum = summarize(segments);
  EXPECT_NEAR(sum.translation_mean, 0.02, 1e-15);
  EXPECT_NEAR(sum.translation_rms, std::sqrt(0.0005), 1e-15);
}

TEST(KittiMetric, NothingComesOfNothing) {
  const auto segments = kitti_segments({}, {}, kitti_lengths(), 10);
  EXPECT_TRUE(segments.empty());
  EXPECT_EQ(summarize(segments).count, 0);
}

}  // namespace
}  // namespace sovo
