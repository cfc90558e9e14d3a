#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

#include "sovo/vo/coarse_tracker.h"
#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

/// Sunlit leaves: from a metre farther on each spot is brighter or darker than it was, by chance.
class FewInliers : public ::testing::Test {
 protected:
  FewInliers() {
    const Window window = window_of_one(scene_);
    reference_ = build_tracking_reference(window, active_points(window),
                                          window.newest().pyramid->num_levels(), 50.0);
  }

  /// `glitter`: by which six of ten spots of 5 px are brighter or darker [grey levels].
  TrackingResult track(double glitter, const SyntheticScene& seen,
                       const TrackerConfig& config = {}) const {
    constexpr int kSpot = 5;
    ImageF image = scene_view(seen, small_camera(), SE3())->level(0);
    std::mt19937 random(3);
    for (int y0 = 0; y0 < image.height(); y0 += kSpot) {
      for (int x0 = 0; x0 < image.width(); x0 += kSpot) {
        const double drawn = uniform(random);
        const auto change = static_cast<float>(drawn < 0.3   ? glitter
                                               : drawn < 0.6 ? -glitter
                                                             : 0.0);
        for (int y = y0; y < std::min(y0 + kSpot, image.height()); ++y) {
          for (int x = x0; x < std::min(x0 + kSpot, image.width()); ++x) {
            image.at(x, y) = std::clamp(image.at(x, y) + change, 0.0F, 240.0F);
          }
        }
      }
    }
    const std::vector<SE3> start = {SE3()};
    return CoarseTracker(config).track(reference_, *pyramid_of(std::move(image)), 0.0, {}, start,
                                       {30.0, 1.0, SE3()});
  }

  SyntheticScene scene_{3};
  TrackingReference reference_;
};

TEST_F(FewInliers, AreEnoughWhereTheImageCorrelates) {
  const TrackerConfig config;
  const TrackingResult seen = track(35.0, scene_);
  ASSERT_LT(seen.inlier_ratio, config.min_inlier_ratio - 0.05);
  ASSERT_LT(seen.T_current_reference.log().norm(), 0.02);
  EXPECT_TRUE(seen.good);
}

TEST_F(FewInliers, AreNotWhereItCorrelatesLittleOrTheyAreFewer) {
  TrackerConfig config;
  const TrackingResult seen = track(35.0, scene_);
  config.few_inliers_correlation = seen.correlation + 0.01;
  EXPECT_FALSE(track(35.0, scene_, config).good);
  config = {};
  config.least_inlier_ratio = seen.inlier_ratio + 0.01;
  EXPECT_FALSE(track(35.0, scene_, config).good);
}

// Thresholds are lower there, and what still correlates is the vehicle's own body or its shadow.
TEST_F(FewInliers, AreNotAmongWeakTexture) {
  reference_.threshold_share = 0.8;
  TrackerConfig config;
  config.huber /= 0.8;
  config.cutoff /= 0.8;
  const TrackingResult seen = track(35.0, scene_, config);
  ASSERT_LT(seen.inlier_ratio, config.min_inlier_ratio - 0.05);
  ASSERT_GT(seen.correlation, config.few_inliers_correlation + 0.05);
  EXPECT_FALSE(seen.good);
}

TEST_F(FewInliers, ThatCorrelateMakeNoPoseOfAnotherScene) {
  EXPECT_FALSE(track(35.0, SyntheticScene(11)).good);
}

}  // namespace
}  // namespace sovo
