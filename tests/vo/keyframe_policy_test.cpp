#include "sovo/vo/keyframe_policy.h"

#include <gtest/gtest.h>

#include "window_test_support.h"

namespace sovo {
namespace {

class KeyframeDecision : public ::testing::Test {
 protected:
  KeyframeDecision() {
    camera_.width = 640;
    camera_.height = 480;
  }

  /// Flow of the whole image without rotation [px], residual over that of the first frame.
  bool wanted(double flow_px, double rmse_ratio, double log_gain = 0.0, double approach = 0.0,
              bool blurred = false, double frames = 2.0, double inlier_ratio = 1.0,
              bool young = false) const {
    TrackingResult tracked;
    tracked.rmse = rmse_ratio;
    tracked.inlier_ratio = inlier_ratio;
    tracked.affine.a = log_gain;
    return wants_keyframe(KeyframeConfig(), camera_, TrackingReference(), tracked,
                          {flow_px, flow_px, approach}, 0.0, {1.0, blurred, frames, young});
  }

  CameraModel camera_;
};

TEST_F(KeyframeDecision, FlowOrBrightnessAloneSuffices) {
  EXPECT_FALSE(wanted(54.0, 1.0));
  EXPECT_TRUE(wanted(57.0, 1.0));
  EXPECT_FALSE(wanted(0.0, 1.0, 0.49));
  EXPECT_TRUE(wanted(0.0, 1.0, 0.51));
  EXPECT_TRUE(wanted(0.0, 1.0, -0.51));
}

TEST_F(KeyframeDecision, MotionAlongTheViewSufficesWhereItMakesLittleFlow) {
  EXPECT_FALSE(wanted(5.0, 1.0, 0.0, 0.20));
  EXPECT_TRUE(wanted(5.0, 1.0, 0.0, 0.22));
}

TEST_F(KeyframeDecision, ABadFitMakesOneWhereThereIsParallax) {
  EXPECT_FALSE(wanted(8.0, 1.9));
  EXPECT_TRUE(wanted(8.0, 2.1));
}

TEST_F(KeyframeDecision, ABadFitOfACameraAtRestDoesNot) {
  EXPECT_FALSE(wanted(0.2, 2.1));
  EXPECT_FALSE(wanted(0.0, 10.0));
}

TEST_F(KeyframeDecision, ABlurredFrameWaitsForASharpOneWhileThereIsTime) {
  const auto blurred = [this](double flow_px, double rmse_ratio, double frames) {
    return wanted(flow_px, rmse_ratio, 0.0, 0.0, true, frames);
  };
  ASSERT_TRUE(wanted(57.0, 1.0));
  EXPECT_FALSE(blurred(57.0, 1.0, 5.0)) << "the next one moves a fifth more";
  EXPECT_FALSE(blurred(60.0, 1.0, 5.0));
  EXPECT_TRUE(blurred(61.0, 1.0, 5.0));
  EXPECT_TRUE(blurred(77.0, 1.0, 1.0)) << "the next one will be twice as far";
  ASSERT_TRUE(wanted(8.0, 2.1));
  EXPECT_FALSE(blurred(8.0, 2.1, 5.0)) << "blur fits badly";
  ASSERT_TRUE(wanted(20.0, 1.0, -0.51));
  EXPECT_FALSE(wanted(20.0, 1.0, -0.51, 0.0, true, 5.0)) << "and takes contrast";
  EXPECT_FALSE(wanted(8.0, 2.1, 0.0, 0.0, true, 5.0, 0.8));
  EXPECT_TRUE(wanted(8.0, 2.1, 0.0, 0.0, true, 5.0, 0.7)) << "the next one may not fit at all";
  EXPECT_FALSE(wanted(8.0, 1.9, 0.0, 0.0, true, 5.0, 0.7));
}

TEST_F(KeyframeDecision, TheVeryNextFrameHasToHaveMovedMore) {
  const auto after = [this](double frames, double flow_px, double log_gain = 0.0) {
    return wanted(flow_px, 1.0, log_gain, 0.0, false, frames);
  };
  EXPECT_FALSE(after(1.0, 74.0));
  EXPECT_TRUE(after(1.0, 76.0));
  EXPECT_FALSE(after(1.2, 57.0)) << "frames that come unevenly";
  EXPECT_TRUE(after(1.8, 57.0));
  EXPECT_TRUE(after(1.0, 0.0, 0.51)) << "another light does not wait";
  EXPECT_TRUE(wanted(8.0, 2.1, 0.0, 0.0, false, 1.0)) << "nor does a bad fit";
  EXPECT_FALSE(wanted(57.0, 1.0, 0.0, 0.0, false, 1.0, 0.9));
  EXPECT_TRUE(wanted(57.0, 1.0, 0.0, 0.0, false, 1.0, 0.8)) << "the one after may not fit";
  EXPECT_TRUE(wanted(57.0, 1.0, 0.0, 0.0, false, 1.0, 1.0, true)) << "a map that is growing";
}

/// A window without images, whose points are a metre away.
class LeavingTest : public ::testing::Test {
 protected:
  Keyframe& add(double x, int points = 20) {
    const auto id = static_cast<std::uint32_t>(window_.size());
    Keyframe& k =
        window_.insert(test::make_keyframe(id, nullptr, SE3(SO3(), Vec3(x, 0, 0)), Affine()));
    k.points.resize(static_cast<std::size_t>(points));
    for (Point& p : k.points) {
      p.rho = 1.0;
      p.last_state = p.last_but_one_state = ResidualState::kIn;
    }
    window_.update_geometry();
    return k;
  }
  /// Ids of those that are to leave.
  std::vector<std::uint32_t> leaving() {
    mark_leaving_keyframes(KeyframeConfig(), &window_);
    std::vector<std::uint32_t> ids;
    for (int i = 0; i < window_.size(); ++i) {
      if (window_[i].leaving) ids.push_back(window_[i].id);
    }
    return ids;
  }

  Window window_{test::small_camera()};
};

using Ids = std::vector<std::uint32_t>;

TEST_F(LeavingTest, AKeyframeLeavesWithItsPointsWhileEnoughStay) {
  for (int i = 0; i < 6; ++i) add(i);
  EXPECT_EQ(leaving(), Ids());
  for (const int i : {1, 2, 3}) {
    window_[i].points.resize(4);
    window_[i].points_gone = 70;
  }
  EXPECT_EQ(leaving(), Ids()) << "more than a twentieth is left";
  for (const int i : {1, 2, 3}) window_[i].points_gone = 96;
  EXPECT_EQ(leaving(), Ids{1}) << "five stay";
  // The newest one never does.
  window_[1].points_gone = window_[2].points_gone = window_[3].points_gone = 0;
  window_[5].points.clear();
  window_[5].points_gone = 100;
  EXPECT_EQ(leaving(), Ids());
}

TEST_F(LeavingTest, AKeyframeOfAnotherBrightnessLeaves) {
  for (int i = 0; i < 6; ++i) add(i);
  window_[2].affine.a = 0.69;
  EXPECT_EQ(leaving(), Ids());
  window_[2].affine.a = -0.71;
  EXPECT_EQ(leaving(), Ids{2});
}

TEST_F(LeavingTest, OfAFullWindowTheOneWithTheNearestNeighboursLeavesButNeverTheFirst) {
  for (const double x : {0.0, 0.01, 3.0, 4.0, 5.0, 6.0}) add(x);
  EXPECT_EQ(leaving(), Ids());
  add(7.0);
  EXPECT_EQ(leaving(), Ids{1});
}

TEST_F(LeavingTest, OfTwoCrowdsTheOneFarFromTheNewestKeyframeIsThinned) {
  // The near one is a little tighter, which would decide without the distance.
  for (const double x : {-20.0, 0.0, 0.1, 5.0, 9.0, 9.09, 10.0}) add(x);
  const Ids ids = leaving();
  ASSERT_EQ(ids.size(), 1U);
  EXPECT_TRUE(ids[0] == 1 || ids[0] == 2) << ids[0];
}

class LeavingPointsTest : public LeavingTest {
 protected:
  LeavingPointsTest() {
    for (int i = 0; i < 5; ++i) add(0.1 * i, i == 0 ? 1 : 0);
    for (int t = 1; t < 5; ++t) residual(t).state = ResidualState::kIn;
    point().good_residuals = 4;
    point().hessian = 51.0;
  }
  Point& point() { return window_[0].points[0]; }
  Residual& residual(int target) {
    return point().residuals[static_cast<std::size_t>(window_[target].slot)];
  }
  /// What becomes of the point: 's'tays, is 'd'ropped or 'm'arginalized.
  char fate() {
    point().remove = false;
    const LeavingPoints out = mark_leaving_points(WindowConfig(), &window_);
    EXPECT_EQ(out.marginalize.size() + static_cast<std::size_t>(out.dropped),
              point().remove ? 1U : 0U);
    return !point().remove ? 's' : out.dropped > 0 ? 'd' : 'm';
  }
};

TEST_F(LeavingPointsTest, APointStaysUntilItIsSeenNoMore) {
  EXPECT_EQ(fate(), 's');
  point().last_state = ResidualState::kOutlier;
  EXPECT_EQ(fate(), 's') << "an outlier once";
  point().last_but_one_state = ResidualState::kOutlier;
  EXPECT_EQ(fate(), 'm') << "twice";
  point().last_but_one_state = ResidualState::kIn;
  point().last_state = ResidualState::kOutOfView;
  EXPECT_EQ(fate(), 'm');
}

TEST_F(LeavingPointsTest, APointLeavesWithItsKeyframeOrWithThoseThatSawIt) {
  window_[0].leaving = true;
  EXPECT_EQ(fate(), 'm');
  window_[0].leaving = false;
  window_[1].leaving = window_[2].leaving = true;
  EXPECT_EQ(fate(), 's') << "two are left that see it, but it is not a point of long standing";
  point().good_residuals = 15;
  EXPECT_EQ(fate(), 'm');
}

TEST_F(LeavingPointsTest, OnlyWhatTellsSomethingIsMarginalized) {
  window_[0].leaving = true;
  EXPECT_EQ(fate(), 'm');
  point().good_residuals = 3;
  EXPECT_EQ(fate(), 'd');
  point().good_residuals = 4;
  point().hessian = 49.0;
  EXPECT_EQ(fate(), 'd');
  point().hessian = 51.0;
  residual(1).state = residual(2).state = ResidualState::kAbsent;
  EXPECT_EQ(fate(), 'd') << "seen by two";
  residual(1).state = ResidualState::kIn;
  EXPECT_EQ(fate(), 'm');
}

TEST_F(LeavingPointsTest, WhatIsErasedIsCounted) {
  window_[0].points.resize(5);
  window_[0].points[1].remove = window_[0].points[4].remove = true;
  window_[0].points_gone = 10;
  erase_marked_points(&window_);
  EXPECT_EQ(window_[0].points.size(), 3U);
  EXPECT_EQ(window_[0].points_gone, 12);
}

}  // namespace
}  // namespace sovo
