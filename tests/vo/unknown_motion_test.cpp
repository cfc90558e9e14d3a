#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "sovo/vo/coarse_tracker.h"
#include "sovo/vo/motion_hypotheses.h"
#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

TEST(UnknownMotion, IsTriedAlongTheAxisAtEvenSteps) {
  const SE3 around(SO3::exp(Vec3(0.01, 0.02, -0.01)), Vec3::Zero());
  const std::array shares = {0.1, 0.25};
  const double mean_rho = 0.2;
  const std::vector<SE3> tried = unknown_translations(around, mean_rho, shares, 0.1);
  std::vector<double> ahead;
  int across = 0;
  for (const SE3& T : tried) {
    EXPECT_TRUE(T.rotation().matrix() == around.rotation().matrix());
    const Vec3 t = mean_rho * T.translation();
    across += std::abs(t.x()) + std::abs(t.y()) > 0.0 ? 1 : 0;
    if (t.head<2>().isZero(0.0)) ahead.push_back(t.z());
  }
  EXPECT_EQ(across, 8) << "to both sides, by both shares";
  std::ranges::sort(ahead);
  ASSERT_EQ(ahead.size(), 5U) << "none beyond the largest share";
  double expected = -0.2;
  for (const double way : ahead) {
    EXPECT_NEAR(way, expected, 1e-12);
    expected += 0.1;
  }
}

TEST(UnknownMotion, IsTriedOnAGridAroundAPose) {
  const SE3 around(SO3::exp(Vec3(0.01, 0.02, -0.01)), Vec3(0.3, 0.0, -0.1));
  const double mean_rho = 0.5;
  const std::vector<SE3> tried = translations_around(around, mean_rho, 0.1, 2);
  ASSERT_EQ(tried.size(), 125U);
  EXPECT_TRUE(tried[62].translation().isApprox(around.translation(), 1e-12)) << "in the middle";
  for (const SE3& T : tried) {
    EXPECT_TRUE(T.rotation().matrix() == around.rotation().matrix());
    const Vec3 steps = (T.translation() - around.translation()) * mean_rho / 0.1;
    for (Eigen::Index i = 0; i < 3; ++i) {
      EXPECT_NEAR(steps[i], std::round(steps[i]), 1e-9);
      EXPECT_LE(std::abs(steps[i]), 2.0 + 1e-9);
    }
  }
  EXPECT_TRUE((tried.back().translation() - tried.front().translation())
                  .isApprox(Vec3::Constant(4.0 * 0.1 / mean_rho), 1e-12));
}

TEST(UnknownMotion, PatternsAreThePixelsAroundPoints) {
  ImageF image(40, 30);
  for (std::size_t i = 0; i < image.size(); ++i) image.data()[i] = static_cast<float>(i % 251);
  ReferenceLevel points;
  points.camera = make_camera(40, 30, 30, 30, 20, 15);
  const auto add = [&](float u, float v, float rho) {
    points.u.push_back(u);
    points.v.push_back(v);
    points.rho.push_back(rho);
    points.colour.push_back(0.0F);
    points.weight.push_back(2.0F * rho);
  };
  add(20, 10, 0.5F);
  add(1, 10, 0.25F);  // one of its pixels lies beside the image, two at its edge
  const ReferenceLevel patterns = with_patterns(points, image);
  ASSERT_EQ(patterns.size(), 2 * kPatternSize - 3);
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    const std::size_t of = i < kPatternSize ? 0 : 1;
    EXPECT_LE(std::hypot(patterns.u[i] - points.u[of], patterns.v[i] - points.v[of]), 2.0F);
    EXPECT_EQ(patterns.rho[i], points.rho[of]);
    EXPECT_EQ(patterns.weight[i], points.weight[of]);
    EXPECT_EQ(patterns.colour[i],
              image.at(static_cast<int>(patterns.u[i]), static_cast<int>(patterns.v[i])));
  }
}

/// A reference of one keyframe with the true depths of the scene.
TrackingReference reference_of(const SyntheticScene& scene) {
  const CameraModel camera = small_camera();
  Window window(camera);
  Keyframe& k = window.insert(make_keyframe(1, scene_view(scene, camera, SE3()), SE3()));
  k.points = scene_points(scene, camera, k.image(), {SE3()}, 0, 4);
  for (Point& p : k.points) p.hessian = 1e4;
  window.update_geometry();
  return build_tracking_reference(window, active_points(window),
                                  window.newest().pyramid->num_levels(), 25.0);
}

TEST(UnknownMotion, WhatAPoseLeavesUnexplainedIsLeastWhereTheCameraIs) {
  const SyntheticScene scene(3);
  const TrackingReference reference = reference_of(scene);
  const ReferenceLevel patterns = with_patterns(reference.levels[0], reference.pyramid->level(0));
  const SE3 truth(SO3::exp(Vec3(0.002, -0.003, 0.001)), Vec3(0.01, 0.0, -0.3));
  const ImagePyramidPtr image = scene_view(scene, small_camera(), truth.inverse());
  CoarseTracker tracker{TrackerConfig()};
  const TrackingResult right = tracker.refine(reference, *image, 0.0, {}, truth, {});
  ASSERT_TRUE(right.good);
  const auto unexplained = [&](const ReferenceLevel& points, const TrackingResult& pose) {
    return tracker.unexplained(reference, points, image->level(0), 0.0, pose);
  };
  const double least = unexplained(patterns, right);
  const double of_its_points = right.rmse / (right.correlation * right.correlation);
  EXPECT_NEAR(unexplained(reference.levels[0], right), of_its_points, 0.02 * of_its_points);
  for (const double way : {-0.25, -0.15, 0.1, 0.2}) {
    TrackingResult wrong = right;
    wrong.T_current_reference = SE3(SO3(), Vec3(0.0, 0.0, way)) * right.T_current_reference;
    EXPECT_GT(unexplained(patterns, wrong), 1.1 * least) << way;
  }
}

TEST(UnknownMotion, TheLikeliestStartsAreThoseNearTheTruth) {
  const SyntheticScene scene(3);
  const TrackingReference reference = reference_of(scene);
  const SE3 truth(SO3(), Vec3(0.0, 0.0, -0.3));
  const ImagePyramidPtr image = scene_view(scene, small_camera(), truth.inverse());
  std::vector<SE3> starts;
  for (int i = -10; i <= 10; ++i) starts.push_back({SO3(), Vec3(0.0, 0.0, 0.06 * i)});
  CoarseTracker tracker{TrackerConfig()};
  const std::vector<SE3> likeliest = tracker.likeliest(reference, *image, 0.0, {}, starts, 3);
  ASSERT_EQ(likeliest.size(), 3U);
  EXPECT_NEAR(likeliest.front().translation().z(), -0.3, 1e-9);
  for (const SE3& T : likeliest) EXPECT_NEAR(T.translation().z(), -0.3, 0.061);
}

TEST(UnknownMotion, ResidualsBeyondTheCutoffTellByCorrelation) {
  // One pixel of eight disagrees, little or entirely: the same robust residuals.
  const SyntheticScene scene(3);
  const TrackingReference reference = reference_of(scene);
  const ImageF& image = reference.pyramid->level(0);
  CoarseTracker tracker{TrackerConfig()};
  TrackingResult still;
  std::array<double, 2> left{};
  for (std::size_t k = 0; k < 2; ++k) {
    ReferenceLevel points = reference.levels[0];
    for (std::size_t i = 0; i < points.size(); i += 8) {
      const float off = k == 0 ? 25.0F : 80.0F;
      points.colour[i] += points.colour[i] > 128.0F ? -off : off;
    }
    left[k] = tracker.unexplained(reference, points, image, 0.0, still);
  }
  EXPECT_GT(left[1], 1.1 * left[0]);
}

TEST(UnknownMotion, AmongPointsThatAgreeThoseThatDoNotHaveNoSay) {
  // A weak world with a few points of something strong that is not where they are: a pose that is
  // right hardly correlates, but for what agrees with it.
  const SyntheticScene scene(3);
  TrackingReference reference = reference_of(scene);
  const ImageF& image = reference.pyramid->level(0);
  CoarseTracker tracker{TrackerConfig()};
  const double whole = tracker.fit(reference, image, SE3(), {}).correlation;
  EXPECT_GT(whole, 0.99);
  ReferenceLevel& points = reference.levels[0];
  for (std::size_t i = 0; i < points.size(); i += 20) {
    points.colour[i] += points.colour[i] > 128.0F ? -120.0F : 120.0F;
  }
  const CoarseTracker::Fit fit = tracker.fit(reference, image, SE3(), {});
  EXPECT_NEAR(fit.misfits, 0.05, 0.01);
  EXPECT_GT(fit.correlation, whole - 0.005);
  EXPECT_LT(tracker.refine(reference, *reference.pyramid, 0.0, {}, SE3(), {}).correlation, 0.9);
  // Nor do they hide that nothing correlates.
  for (std::size_t i = 0; i < points.size(); ++i) {
    points.colour[i] = 100.0F + static_cast<float>(i * 7919 % 13);
  }
  ImageF noise(image.width(), image.height());
  for (std::size_t i = 0; i < noise.size(); ++i) {
    noise.data()[i] = 100.0F + static_cast<float>(i * 104729 % 11);
  }
  EXPECT_LT(std::abs(tracker.fit(reference, noise, SE3(), {}).correlation), 0.2);
}

}  // namespace
}  // namespace sovo
