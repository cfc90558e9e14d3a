#include "sovo/odometry/dead_reckoning.h"

#include <gtest/gtest.h>

namespace sovo::test {

namespace {

constexpr std::int64_t kStep = 50'000'000;  // [ns]

/// A second of its motion: 2 m forward, 0.4 rad to the left.
Vec6 of_a_second() {
  Vec6 v;
  v << 0.1, 0.0, 2.0, 0.0, -0.4, 0.0;
  return v;
}

SE3 after(double seconds) { return SE3::exp(seconds * of_a_second()); }

DeadReckoning moving(int frames) {
  DeadReckoning out;
  for (int i = 0; i < frames; ++i) out.note(i * kStep, after(0.05 * i), i > 0);
  return out;
}

double apart(const SE3& a, const SE3& b) { return (a.inverse() * b).log().norm(); }

}  // namespace

TEST(DeadReckoning, GoesOnAsTheCameraMoved) {
  const DeadReckoning moved = moving(10);
  EXPECT_LT(apart(moved.at(9 * kStep), after(0.45)), 1e-9);
  EXPECT_LT(apart(moved.at(13 * kStep), after(0.65)), 1e-9);
  EXPECT_LT(apart(moved.since_last(13 * kStep), after(0.2)), 1e-9);
}

TEST(DeadReckoning, TurnsForHalfASecondAndGoesOnForTwo) {
  const DeadReckoning moved = moving(10);
  const Vec3 way = of_a_second().head<3>();
  const SE3 turned = after(0.45 + 0.5);
  EXPECT_LT(apart(moved.at(29 * kStep), turned * SE3(SO3(), 0.5 * way)), 1e-9);
  EXPECT_LT(apart(moved.at(900 * kStep), turned * SE3(SO3(), 1.5 * way)), 1e-9);
}

TEST(DeadReckoning, TwoWrongStepsOfFiveDoNotCount) {
  DeadReckoning moved = moving(10);
  moved.note(10 * kStep, after(0.5) * SE3(SO3::exp(Vec3(0.1, 0, 0)), Vec3(0, 0, 3)), true);
  moved.note(11 * kStep, after(0.55), true);
  EXPECT_LT(apart(moved.since_last(13 * kStep), after(0.1)), 1e-9);
}

TEST(DeadReckoning, TimeBetweenFramesCounts) {
  DeadReckoning moved;
  for (const int i : {0, 1, 4, 6, 7}) moved.note(i * kStep, after(0.05 * i), true);
  EXPECT_LT(apart(moved.at(8 * kStep), after(0.4)), 1e-9);
}

TEST(DeadReckoning, WhereANewSegmentBeginsIsNoStep) {
  DeadReckoning moved = moving(10);
  const SE3 elsewhere(SO3(), Vec3(7, 0, 0));
  moved.note(20 * kStep, elsewhere, false);
  EXPECT_LT(apart(moved.at(20 * kStep), elsewhere), 1e-12);
  EXPECT_LT(apart(moved.at(22 * kStep), elsewhere * after(0.1)), 1e-9) << "as it moved before";
}

TEST(DeadReckoning, FartherOffIsPossibleTheLongerItIs) {
  const DeadReckoning moved = moving(10);
  const ReckonedPose soon = moved.reckon(11 * kStep);
  const ReckonedPose late = moved.reckon(29 * kStep);
  ASSERT_TRUE(soon.knows_motion && late.knows_motion);
  EXPECT_LT(apart(soon.T_odom_left, after(0.55)), 1e-9);
  EXPECT_TRUE(soon.is_likely(soon.T_odom_left));
  // 0.1 s: 0.2 m of way; a second: 2 m.
  const auto off = [](const ReckonedPose& r, double metres, double radians) {
    return r.T_odom_left * SE3(SO3::exp(Vec3(0, radians, 0)), Vec3(metres, 0, 0));
  };
  EXPECT_TRUE(soon.is_likely(off(soon, 0.02, 0.02)));
  EXPECT_FALSE(soon.is_likely(off(soon, 0.1, 0.0)));
  EXPECT_FALSE(soon.is_likely(off(soon, 0.0, 0.1)));
  EXPECT_TRUE(soon.is_possible(off(soon, 0.1, 0.5)));
  EXPECT_FALSE(soon.is_possible(off(soon, 1.0, 0.0)));
  EXPECT_FALSE(soon.is_possible(off(soon, 0.0, 1.0)));
  EXPECT_TRUE(late.is_likely(off(late, 0.5, 0.2)));
  EXPECT_TRUE(late.is_possible(off(late, 5.0, 2.0)));
  EXPECT_FALSE(late.is_possible(off(late, 15.0, 0.0)));
}

TEST(DeadReckoning, WhereNoMotionIsKnownNothingIsLikelyAndAllIsPossible) {
  DeadReckoning moved = moving(10);
  moved.forget_motion();
  const ReckonedPose open = moved.reckon(12 * kStep);
  EXPECT_FALSE(open.knows_motion);
  EXPECT_TRUE(open.is_possible(open.T_odom_left * SE3(SO3(), Vec3(100, 0, 0))));
  EXPECT_FALSE(open.is_likely(open.T_odom_left * SE3(SO3(), Vec3(0.01, 0, 0))));
}

TEST(DeadReckoning, StaysWhereNothingIsKnown) {
  DeadReckoning moved;
  EXPECT_LT(apart(moved.at(kStep), SE3()), 1e-12);
  const SE3 here(SO3(), Vec3(1, 2, 3));
  moved.note(0, here, false);
  EXPECT_LT(apart(moved.at(kStep), here), 1e-12);
  moved = moving(10);
  moved.forget_motion();
  EXPECT_LT(apart(moved.at(12 * kStep), after(0.45)), 1e-12);
}

}  // namespace sovo::test
