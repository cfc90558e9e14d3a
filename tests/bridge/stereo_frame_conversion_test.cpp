#include "sovo/bridge/stereo_frame_conversion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/ros_conversion.h"
#include "test_cameras.h"

namespace sovo::bridge {
namespace {

TEST(StereoFrameConversion, ThereAndBack) {
  StereoFrame frame = test_frame(3);
  frame.frame_id = "left";
  const msg::StereoFrame message = to_message(frame);
  EXPECT_EQ(message.left.data._buffer, frame.left.data->data()) << "pixels must not be copied";
  const auto back = from_message(message);
  ASSERT_TRUE(back.ok()) << back.error();
  EXPECT_EQ(back->stamp_ns, frame.stamp_ns);
  EXPECT_EQ(back->session, frame.session);
  EXPECT_EQ(back->sequence, frame.sequence);
  EXPECT_EQ(back->clock, frame.clock);
  EXPECT_EQ(back->stamp_sigma_s, frame.stamp_sigma_s);
  EXPECT_EQ(back->pair_error_s, frame.pair_error_s);
  EXPECT_EQ(back->frame_id, "left");
  EXPECT_EQ(back->right.width, 640);
  EXPECT_EQ(back->right.height, 400);
  EXPECT_EQ(back->right.step, 640);
  EXPECT_EQ(back->right.exposure_s, frame.right.exposure_s);
  EXPECT_EQ(back->right.gain_db, frame.right.gain_db);
  EXPECT_EQ(back->right.stamp_offset_ns, frame.right.stamp_offset_ns);
  EXPECT_EQ(back->right.dropped, frame.right.dropped);
  EXPECT_EQ(*back->left.data, *frame.left.data);
  EXPECT_EQ(*back->right.data, *frame.right.data);
}

TEST(StereoFrameConversion, NegativeStampsSurvive) {
  for (const std::int64_t stamp : {-1LL, -1'000'000'000LL, -1'500'000'000LL, 0LL, 999'999'999LL}) {
    EXPECT_EQ(stamp_ns(to_message(stamp)), stamp);
    EXPECT_LT(to_message(stamp).nanosec, 1'000'000'000U);
  }
}

TEST(StereoFrameConversion, AMissingSideStaysMissing) {
  StereoFrame frame = test_frame(0);
  frame.right = {};
  frame.right.dropped = 5;
  const auto back = from_message(to_message(frame));
  ASSERT_TRUE(back.ok()) << back.error();
  EXPECT_TRUE(back->left.valid);
  EXPECT_FALSE(back->right.valid);
  EXPECT_EQ(back->right.dropped, 5U);
}

TEST(StereoFrameConversion, ASideThatDoesNotFitItsSizeIsWrittenAsMissing) {
  StereoFrame frame = test_frame(0);
  frame.left.height = 481;
  EXPECT_FALSE(to_message(frame).left.valid);
}

TEST(StereoFrameConversion, SixteenBitsAndPaddedRowsArePassedOn) {
  const std::vector<std::uint8_t> data(3 * 24, 9);
  msg::SideImage m{};
  m.valid = true;
  m.width = 10;
  m.height = 3;
  m.step = 24;
  m.encoding = borrow("mono16");
  borrow(m.data, data);
  const auto side = from_message(m, "left");
  ASSERT_TRUE(side.ok()) << side.error();
  EXPECT_EQ(side->format, PixelFormat::kMono16);
  EXPECT_EQ(side->step, 24);
}

SideImage grey_of(const char* encoding, const std::vector<std::uint8_t>& data, std::uint32_t step) {
  msg::SideImage m{};
  m.valid = true;
  m.width = 2;
  m.height = static_cast<std::uint32_t>(data.size()) / step;
  m.step = step;
  m.encoding = borrow(encoding);
  borrow(m.data, data);
  const auto side = from_message(m, "left");
  EXPECT_TRUE(side.ok()) << side.error();
  return side.ok() ? *side : SideImage{};
}

TEST(StereoFrameConversion, ColourBecomesGrey) {
  // Red, then blue; BT.601 luma of pure red is 76, of pure blue 29.
  const std::vector<std::uint8_t> red_blue = {255, 0, 0, 0, 0, 255, 1, 1};
  const SideImage rgb = grey_of("rgb8", red_blue, 8);
  EXPECT_EQ(*rgb.data, (std::vector<std::uint8_t>{76, 29}));
  EXPECT_EQ(rgb.step, 2);
  EXPECT_EQ(rgb.format, PixelFormat::kMono8);
  EXPECT_EQ(*grey_of("bgr8", red_blue, 8).data, (std::vector<std::uint8_t>{29, 76}));
  EXPECT_EQ(*grey_of("rgb8", std::vector<std::uint8_t>(6, 255), 6).data,
            (std::vector<std::uint8_t>{255, 255}));
  EXPECT_EQ(*grey_of("yuv422_yuy2", {10, 128, 20, 128}, 4).data,
            (std::vector<std::uint8_t>{10, 20}));
}

TEST(StereoFrameConversion, MalformedMessagesAreRefusedByField) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::string long_id(300, 'x');
  using M = msg::StereoFrame;
  const std::vector<std::pair<std::string, std::function<void(M&)>>> cases = {
      {"nanosec", [](M& m) { m.header.stamp.nanosec = 1'000'000'000; }},
      {"frame_id", [&](M& m) { m.header.frame_id = borrow(long_id); }},
      {"stamp_sigma_s", [&](M& m) { m.stamp_sigma_s = nan; }},
      {"pair_error_s", [&](M& m) { m.pair_error_s = INFINITY; }},
      {"left: size 0x480", [](M& m) { m.left.width = 0; }},
      {"left: size", [](M& m) { m.left.height = 16385; }},
      {"left: size", [](M& m) { m.left.width = m.left.height = m.left.step = 0xFFFFFFFF; }},
      {"left: step", [](M& m) { m.left.step = 751; }},
      {"left: data", [](M& m) { m.left.height = 481; }},
      {"left: data", [](M& m) { m.left.step = 0x80000000; }},
      {"left: data", [](M& m) { m.left.data._length -= 1; }},
      {"left: data", [](M& m) { m.left.data._length = 0, m.left.data._buffer = nullptr; }},
      {"left: step", [](M& m) { m.left.encoding = borrow("mono16"); }},
      {"left.encoding 'jpeg'", [](M& m) { m.left.encoding = borrow("jpeg"); }},
      {"left.encoding '?"
       "?'",
       [](M& m) { m.left.encoding = borrow("\x1b\n"); }},
      {"left.encoding ''", [](M& m) { m.left.encoding = nullptr; }},
      {"right: exposure_s", [&](M& m) { m.right.exposure_s = nan; }},
      {"right: exposure_s", [](M& m) { m.right.exposure_s = -1.0F; }},
      {"right: gain_db", [&](M& m) { m.right.gain_db = nan; }},
      {"right: stamp_offset_ns",
       [](M& m) { m.right.stamp_offset_ns = std::numeric_limits<std::int64_t>::min(); }},
  };
  const StereoFrame frame = test_frame(0);
  for (const auto& [field, spoil] : cases) {
    M message = to_message(frame);
    ASSERT_TRUE(from_message(message).ok());
    spoil(message);
    const auto result = from_message(message);
    ASSERT_FALSE(result.ok()) << field;
    EXPECT_NE(result.error().find(field), std::string::npos) << result.error();
  }
}

}  // namespace
}  // namespace sovo::bridge
