#include "sovo/bridge/session_lock.h"

#include <gtest/gtest.h>

namespace sovo::bridge {
namespace {

using Verdict = SessionLock::Verdict;
const auto kAlive = [](std::uint64_t) { return true; };
const auto kGone = [](std::uint64_t) { return false; };

TEST(SessionLock, FollowsTheFirstWhileItLives) {
  SessionLock lock;
  EXPECT_EQ(lock.judge(1, 10, kAlive), Verdict::kSwitched);
  EXPECT_EQ(lock.judge(1, 10, kAlive), Verdict::kFollowed);
  EXPECT_EQ(lock.judge(2, 20, kAlive), Verdict::kNewForeign);
  EXPECT_EQ(lock.judge(2, 20, kAlive), Verdict::kForeign);
  EXPECT_EQ(lock.judge(2, 21, kAlive), Verdict::kNewForeign);
  EXPECT_EQ(lock.judge(1, 10, kAlive), Verdict::kFollowed);
  EXPECT_EQ(lock.foreign_frames(), 3U);
}

TEST(SessionLock, SwitchesWhenTheFirstHasGone) {
  SessionLock lock;
  EXPECT_EQ(lock.judge(1, 10, kAlive), Verdict::kSwitched);
  EXPECT_EQ(lock.judge(2, 20, kGone), Verdict::kSwitched);
  EXPECT_EQ(lock.publisher(), 2U);
  EXPECT_EQ(lock.judge(2, 20, kGone), Verdict::kFollowed);
}

TEST(SessionLock, TheSamePublisherMayBeginANewSession) {
  SessionLock lock;
  EXPECT_EQ(lock.judge(1, 10, kAlive), Verdict::kSwitched);
  EXPECT_EQ(lock.judge(1, 11, kAlive), Verdict::kSwitched);
}

TEST(SessionLock, TheSameSessionOfASecondPublisherIsForeign) {
  SessionLock lock;
  EXPECT_EQ(lock.judge(1, 10, kAlive), Verdict::kSwitched);
  EXPECT_EQ(lock.judge(2, 10, kAlive), Verdict::kNewForeign);
}

TEST(SessionLock, ACalibrationHeardFirstDecides) {
  SessionLock lock;
  lock.prefer(1, kAlive);
  EXPECT_EQ(lock.judge(2, 20, kAlive), Verdict::kNewForeign);
  EXPECT_EQ(lock.judge(1, 10, kAlive), Verdict::kSwitched);
  lock.prefer(2, kAlive);
  EXPECT_EQ(lock.publisher(), 1U);
  lock.prefer(2, kGone);
  EXPECT_EQ(lock.publisher(), 2U);
}

TEST(GapCounter, CountsMissingNumbers) {
  GapCounter gaps;
  for (const std::uint64_t sequence : {5, 6, 9, 10, 12}) gaps.count(sequence);
  EXPECT_EQ(gaps.lost(), 3U);
  gaps.count(2);
  gaps.count(3);
  EXPECT_EQ(gaps.lost(), 3U);
  gaps.restart();
  gaps.count(100);
  EXPECT_EQ(gaps.lost(), 3U);
}

}  // namespace
}  // namespace sovo::bridge
