#include "sovo/odometry/frame_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "odometry/odometry_test_support.h"

namespace sovo::test {
namespace {

/// Frame `i` with both images of frame `of`.
StereoFrame repeated_frame(int i, int of) {
  StereoFrame frame = drive_frame(of);
  frame.stamp_ns = drive_frame(i).stamp_ns;
  frame.sequence = drive_frame(i).sequence;
  return frame;
}

void expect_refused(const OdometryOutput& o) {
  EXPECT_EQ(o.state, OdometryState::kDegraded);
  EXPECT_FALSE(o.pose_valid);
  EXPECT_NE(o.reason.find("left image is the one before"), std::string::npos) << o.reason;
}

TEST(FrameCheck, APairThatComesAgainIsNoneWhileTheCameraMoves) {
  Playback run(test_config());
  for (int i = 0; i < kDriveFrames; ++i) {
    if (i % 5 == 4) {
      expect_refused(run.give(repeated_frame(i, i - 1)));
    } else {
      EXPECT_TRUE(run.give(drive_frame(i)).pose_valid) << i;
    }
  }
  EXPECT_EQ(run.recorder.frames.back().rejected, 4U);
  EXPECT_EQ(run.recorder.frames.back().segment, 0U);
  expect_follows_the_drive(published(run.recorder), 0.015, 0.05);
}

TEST(FrameCheck, ItIsNoneWhereNoMotionIsKnown) {
  Playback run(test_config());
  run.give(drive_frame(3));
  expect_refused(run.give(repeated_frame(4, 3)));
  run.give_drive(5, kDriveFrames);
  EXPECT_EQ(run.recorder.frames.back().state, OdometryState::kTracking);
  expect_follows_the_drive(published(run.recorder), 0.015, 0.05);
}

TEST(FrameCheck, WhatPadsTheRowsIsNotCompared) {
  Playback run(test_config());
  run.give_drive(0, 4);
  StereoFrame frame = repeated_frame(4, 3);
  SideImage& left = frame.left;
  auto padded = std::make_shared<std::vector<std::uint8_t>>();
  for (int y = 0; y < left.height; ++y) {
    const auto row = left.data->begin() + y * left.step;
    padded->insert(padded->end(), row, row + left.width);
    padded->insert(padded->end(), 16, static_cast<std::uint8_t>(y));
  }
  left.data = padded;
  left.step = left.width + 16;
  expect_refused(run.give(frame));
}

TEST(FrameCheck, ACameraThatMovedIsBelievedToStandAfterASecond) {
  constexpr int kSecond = static_cast<int>(1'000'000'000 / kPeriodNs);
  Playback run(test_config());
  run.give_drive(0, 6);
  for (int i = 6; i < 5 + kSecond; ++i) expect_refused(run.give(repeated_frame(i, 5)));
  const OdometryOutput o = run.give(repeated_frame(5 + kSecond, 5));
  EXPECT_TRUE(o.pose_valid);
  EXPECT_EQ(o.state, OdometryState::kDegraded);
  EXPECT_NE(o.reason.find("frozen"), std::string::npos) << o.reason;
}

/// Frame `i` of a camera whose sensor is at its limit, with 8 or 16 bits a pixel.
StereoFrame white_frame(int i, PixelFormat format) {
  StereoFrame frame = drive_frame(i);
  for (SideImage* side : {&frame.left, &frame.right}) {
    const bool deep = format == PixelFormat::kMono16;
    side->format = format;
    side->step = side->width * (deep ? 2 : 1);
    const auto bytes =
        static_cast<std::size_t>(side->step) * static_cast<std::size_t>(side->height);
    auto data = std::make_shared<std::vector<std::uint8_t>>(bytes, std::uint8_t{0xFF});
    // Twelve bits, shifted up.
    for (std::size_t k = 0; deep && k < bytes; k += 2) (*data)[k] = 0xF0;
    side->data = data;
  }
  return frame;
}

TEST(FrameCheck, WhiteImagesAreOverexposedAndRepeatNothing) {
  for (const PixelFormat format : {PixelFormat::kMono8, PixelFormat::kMono16}) {
    Playback run(test_config());
    run.give_drive(0, 6);
    for (int i = 6; i < 10; ++i) {
      const OdometryOutput o = run.give(white_frame(i, format));
      EXPECT_FALSE(o.pose_valid) << i;
      EXPECT_NE(o.reason.find("is white"), std::string::npos) << o.reason;
      EXPECT_EQ(o.reason.find("the one before"), std::string::npos) << o.reason;
    }
    EXPECT_EQ(run.recorder.frames.back().rejected, 0U);
  }
}

TEST(FrameCheck, WhiteRowsDoNotMakeAnImageWhite) {
  Playback run(test_config());
  run.give_drive(0, 5);
  StereoFrame frame = drive_frame(5);
  auto data = std::make_shared<std::vector<std::uint8_t>>(*frame.left.data);
  std::fill(data->end() - 12 * frame.left.step, data->end(), std::uint8_t{0xFF});
  frame.left.data = data;
  EXPECT_TRUE(run.give(frame).pose_valid);
  frame.stamp_ns += kPeriodNs;
  expect_refused(run.give(frame));
}

TEST(FrameCheck, ARightImageThatComesAgainMeasuresNoScale) {
  Playback run(test_config());
  run.give_drive(0, 6);
  StereoFrame frame = drive_frame(6);
  frame.right = drive_frame(5).right;
  const OdometryOutput o = run.give(frame);
  EXPECT_TRUE(o.pose_valid);
  EXPECT_EQ(o.state, OdometryState::kDegraded);
  EXPECT_NE(o.reason.find("right image is the one before"), std::string::npos) << o.reason;
  run.give_drive(7, 12);
  EXPECT_EQ(run.recorder.frames.back().state, OdometryState::kTracking);
}

TEST(FrameCheck, ACameraWithoutNoiseMayStand) {
  constexpr int kSecond = static_cast<int>(1'000'000'000 / kPeriodNs);
  Playback run(test_config());
  StereoFrame frame = drive_frame(0);
  const auto next = [&] {
    frame.stamp_ns += kPeriodNs;
    return run.give(frame);
  };
  next();
  for (int i = 1; i < kSecond / 4; ++i) expect_refused(next());
  // No driver is late for longer: it stands, or after a second it may be frozen.
  for (int i = kSecond / 4; i < 2 * kSecond; ++i) {
    const OdometryOutput o = next();
    EXPECT_TRUE(o.pose_valid);
    EXPECT_LT(o.T_odom_left.translation().norm(), 1e-3);
    EXPECT_EQ(o.reason.find("frozen") != std::string::npos, i >= kSecond) << i << ": " << o.reason;
    EXPECT_EQ(o.state == OdometryState::kDegraded, i >= kSecond) << i << ": " << o.reason;
  }
  // That it stands is known by now: a new image that comes again is as good as any.
  const std::int64_t stamp_ns = frame.stamp_ns;
  frame = with_noise(frame, 1);
  frame.stamp_ns = stamp_ns;
  for (int i = 0; i < 2; ++i) {
    const OdometryOutput o = next();
    EXPECT_TRUE(o.pose_valid);
    EXPECT_NE(o.state, OdometryState::kDegraded) << o.reason;
  }
}

}  // namespace
}  // namespace sovo::test
