#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "sovo/vo/coarse_tracker.h"
#include "sovo/vo/motion_hypotheses.h"
#include "sovo/vo/pattern_fit.h"
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

/// An image that moved ahead sees the reference's points here.
const SE3 kAhead(SO3::exp(Vec3(0.002, -0.003, 0.001)), Vec3(0.01, 0.0, -0.3));

SE3 farther(double way) { return SE3(SO3(), Vec3(0.0, 0.0, way)) * kAhead; }

TEST(UnknownMotion, WhatAPoseLeavesUnexplainedIsLeastWhereTheCameraIs) {
  const SyntheticScene scene(3);
  const TrackingReference reference = reference_of(scene);
  const ReferencePatterns patterns(reference.levels[0], reference.pyramid->level(0));
  const ImagePyramidPtr image = scene_view(scene, small_camera(), kAhead.inverse());
  CoarseTracker tracker{TrackerConfig()};
  const TrackingResult right = tracker.refine(reference, *image, 0.0, {}, kAhead, {});
  ASSERT_TRUE(right.good);
  const double of_its_points = right.rmse / (right.correlation * right.correlation);
  EXPECT_NEAR(tracker.unexplained(reference, image->level(0), 0.0, right), of_its_points,
              0.02 * of_its_points);
  for (const bool known : {true, false}) {
    const KnownLight light{{}, known};
    const double least = patterns.unexplained(image->level(0), kAhead, light, RobustNorm());
    for (const double way : {-0.25, -0.15, 0.1, 0.2, 0.3}) {
      const SE3 wrong = farther(way);
      EXPECT_GT(patterns.unexplained(image->level(0), wrong, light, RobustNorm()), 1.1 * least)
          << way;
    }
  }
}

TEST(UnknownMotion, AVignetteThatIsNotKnownHardlySpeaksForACameraAtRest) {
  const SyntheticScene scene(3);
  const TrackingReference reference = reference_of(scene);
  const ReferencePatterns patterns(reference.levels[0], reference.pyramid->level(0));
  const ImagePyramidPtr image = scene_view(scene, small_camera(), kAhead.inverse());
  ImageF shaded = image->level(0);
  for (int y = 0; y < shaded.height(); ++y) {
    for (int x = 0; x < shaded.width(); ++x) {
      shaded.row(y)[x] *= 1.0F + 0.3F * std::sin(0.05F * static_cast<float>(x + 2 * y));
    }
  }
  const auto lead = [&](bool known) {
    const KnownLight light{{}, known};
    return patterns.unexplained(shaded, SE3(), light, RobustNorm()) /
           patterns.unexplained(shaded, kAhead, light, RobustNorm());
  };
  EXPECT_GT(lead(false), 1.3 * lead(true));
}

TEST(UnknownMotion, PatternsThatContradictThePoseExplainNothing) {
  const SyntheticScene scene(3);
  const TrackingReference reference = reference_of(scene);
  const ImageF& image = reference.pyramid->level(0);
  const ReferencePatterns patterns(reference.levels[0], image);
  ImageF negative = image;
  for (std::size_t i = 0; i < negative.size(); ++i) negative.data()[i] *= -1.0F;
  const double nothing = patterns.unexplained(negative, SE3(), {}, RobustNorm());
  EXPECT_GT(nothing, 1e6);
  const SE3 behind(SO3(), Vec3(0.0, 0.0, -1e3));
  EXPECT_EQ(patterns.unexplained(image, behind, {}, RobustNorm()), nothing) << "none in view";
  EXPECT_NEAR(patterns.unexplained(image, SE3(), {}, RobustNorm()), 0.0, 0.02);
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
    TrackingReference other = reference;
    ReferenceLevel& points = other.levels[0];
    for (std::size_t i = 0; i < points.size(); i += 8) {
      const float off = k == 0 ? 25.0F : 80.0F;
      points.colour[i] += points.colour[i] > 128.0F ? -off : off;
    }
    left[k] = tracker.unexplained(other, image, 0.0, still);
  }
  EXPECT_GT(left[1], 1.1 * left[0]);
}

}  // namespace
}  // namespace sovo
