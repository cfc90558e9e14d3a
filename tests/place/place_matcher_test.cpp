#include "sovo/place/place_matcher.h"

#include <gtest/gtest.h>

#include "place/place_test_support.h"
#include "sovo/geometry/linear_solvers.h"

namespace sovo {
namespace {

using test::Cloud;
using test::place_camera;

constexpr double kSigmaPx = 0.7;

SE3 view(int i) {
  const double s = 0.1 * i;
  return {SO3::exp(Vec3(0.05 * s, 0.1 * s, 0.6 * s)), Vec3(0.3 * s, -0.1 * s, 0.2 * s)};
}

/// e where the true motion is exp(e) times the found one.
Vec6 error_of(const PlaceMatch& match, const SE3& T_a_b) {
  return (T_a_b * match.T_a_b.inverse()).log();
}

TEST(PlaceMatcher, FindsTheMotionWithinItsCovariance) {
  double nees = 0.0;
  constexpr int kTrials = 60;
  for (int i = 0; i < kTrials; ++i) {
    std::mt19937 random(static_cast<unsigned>(100 + i));
    const Cloud cloud(150, random);
    const Place a = cloud.seen_from(view(0), kSigmaPx, random);
    const Place b = cloud.seen_from(view(1 + i % 8), kSigmaPx, random);
    const auto match = match_places(place_camera(), a, b, {});
    ASSERT_TRUE(match.has_value()) << i;
    EXPECT_GT(match->support, 0.5);
    const Vec6 e = error_of(*match, view(0).inverse() * view(1 + i % 8));
    EXPECT_LT(e.head<3>().norm(), 0.05);
    EXPECT_LT(e.tail<3>().norm(), 0.01);
    nees += e.dot(VecX(solve_symmetric(match->covariance, e))) / (6 * kTrials);
  }
  // A pair's two residuals share keypoints; the covariance takes them for one.
  EXPECT_GT(nees, 0.3);
  EXPECT_LT(nees, 1.5);
}

TEST(PlaceMatcher, HalfOfTheNamesMayBeWrong) {
  std::mt19937 random(3);
  const Cloud cloud(200, random);
  const Place a = cloud.seen_from(view(0), kSigmaPx, random);
  Place b = cloud.seen_from(view(4), kSigmaPx, random);
  // The descriptors of the first half change hands.
  const std::size_t half = b.landmarks.size() / 2;
  for (std::size_t i = 0; i + 1 < half; ++i) {
    std::swap(b.landmarks[i].keypoint.descriptor, b.landmarks[i + 1].keypoint.descriptor);
  }
  const auto match = match_places(place_camera(), a, b, {});
  ASSERT_TRUE(match.has_value());
  const Vec6 e = error_of(*match, view(0).inverse() * view(4));
  EXPECT_LT(e.dot(VecX(solve_symmetric(match->covariance, e))), 20.0);
}

TEST(PlaceMatcher, NothingBetweenDifferentPlaces) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    const Cloud here(200, random);
    Cloud elsewhere(200, random);
    // Things look alike, but stand elsewhere.
    for (std::size_t i = 0; i < 100; ++i) elsewhere.points[i].second = here.points[i].second;
    const Place a = here.seen_from(view(0), kSigmaPx, random);
    const Place b = elsewhere.seen_from(view(0), kSigmaPx, random);
    EXPECT_FALSE(match_places(place_camera(), a, b, {}).has_value()) << seed;
  }
}

TEST(PlaceMatcher, AFewLandmarksAreNoPlace) {
  std::mt19937 random(4);
  const Cloud cloud(15, random);
  const Place a = cloud.seen_from(view(0), kSigmaPx, random);
  EXPECT_FALSE(match_places(place_camera(), a, a, {}).has_value());
  EXPECT_FALSE(match_places(place_camera(), a, Place(), {}).has_value());
}

TEST(PlaceMatcher, DepthsOfOneViewSuffice) {
  std::mt19937 random(6);
  const Cloud cloud(200, random);
  const Place a = cloud.seen_from(view(0), kSigmaPx, random);
  Place b = cloud.seen_from(view(3), kSigmaPx, random);
  // RANSAC needs a few with both; the fit takes all that have one.
  for (std::size_t i = 0; i < b.landmarks.size(); ++i) {
    if (i % 4 != 0) b.landmarks[i].sigma = 0.0F;
  }
  const auto match = match_places(place_camera(), a, b, {});
  ASSERT_TRUE(match.has_value());
  EXPECT_GT(match->inliers, static_cast<int>(b.landmarks.size() / 2));
}

TEST(PlaceMatcher, WhereTheMotionIsExpectedNamesMayRepeat) {
  std::mt19937 random(12);
  Cloud cloud(240, random);
  // Every thing looks like three others that stand elsewhere.
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    cloud.points[i].second = cloud.points[i % 60].second;
  }
  const Place a = cloud.seen_from(view(0), kSigmaPx, random);
  const Place b = cloud.seen_from(view(3), kSigmaPx, random);
  const SE3 truth = view(0).inverse() * view(3);
  EXPECT_FALSE(match_places(place_camera(), a, b, {}).has_value());
  const SE3 expected = truth * SE3(SO3::exp(Vec3(0.01, 0.01, 0)), Vec3(0.03, 0, 0.05));
  const auto match = match_places_near(place_camera(), a, b, expected, {});
  ASSERT_TRUE(match.has_value());
  const Vec6 e = error_of(*match, truth);
  EXPECT_LT(e.dot(VecX(solve_symmetric(match->covariance, e))), 20.0);
}

TEST(PlaceMatcher, WhatMovesAlongCanBeLeftOut) {
  std::mt19937 random(8);
  const Cloud world(120, random);
  const Cloud body(160, random);
  Place a = world.seen_from(view(0), kSigmaPx, random);
  Place b = world.seen_from(view(6), kSigmaPx, random);
  for (Place* place : {&a, &b}) {
    const Place along = body.seen_from(SE3(), 0.1, random);
    place->landmarks.insert(place->landmarks.end(), along.landmarks.begin(), along.landmarks.end());
  }
  const auto stays = match_places(place_camera(), a, b, {});
  ASSERT_TRUE(stays.has_value());
  EXPECT_LT(stays->T_a_b.translation().norm(), 0.01) << "most of what is seen moves along";
  const auto moves = match_places(place_camera(), a, b, {.min_shift_px = 2.0});
  ASSERT_TRUE(moves.has_value());
  EXPECT_LT(error_of(*moves, view(0).inverse() * view(6)).norm(), 0.05);
}

TEST(PlaceMatcher, TheRefinedMotionIsTheBest) {
  // Central differences: no small step from it lessens the weighted errors.
  std::mt19937 random(9);
  const Cloud cloud(120, random);
  const Place a = cloud.seen_from(view(0), kSigmaPx, random);
  const Place b = cloud.seen_from(view(5), kSigmaPx, random);
  std::vector<LandmarkPair> pairs;
  for (const Landmark& l : a.landmarks) {
    for (const Landmark& m : b.landmarks) {
      if (hamming(l.keypoint.descriptor, m.keypoint.descriptor) < 60) pairs.push_back({&l, &m});
    }
  }
  ASSERT_GT(pairs.size(), 50U);
  const SE3 truth = view(0).inverse() * view(5);
  const PlaceMatch best = refine_motion(place_camera(), pairs, truth, kSigmaPx, 100.0);
  // From elsewhere it leads to the same place.
  for (int k = 0; k < 6; ++k) {
    Vec6 x = Vec6::Zero();
    x[k] = 0.02;
    const PlaceMatch again =
        refine_motion(place_camera(), pairs, SE3::exp(x) * truth, kSigmaPx, 100.0);
    EXPECT_LT((again.T_a_b * best.T_a_b.inverse()).log().norm(), 1e-5) << k;
  }
}

}  // namespace
}  // namespace sovo
