#include "sovo/bridge/camera_views.h"

#include <gtest/gtest.h>

#include <set>

#include "sovo/bridge/camera_publisher.h"
#include "sovo/bridge/image_conversion.h"
#include "sovo/bridge/reader.h"
#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/topics.h"
#include "sovo/io/image_codecs.h"
#include "test_bus.h"
#include "test_cameras.h"

namespace sovo::bridge {
namespace {

/// A camera process that publishes the same picture again and again.
struct Camera {
  Participant participant = open_remote_participant();
  CameraPublisher publisher = require(CameraPublisher::open(participant, test_cameras(), 0));
  std::uint64_t sequence = 0;

  void publish() {
    const auto done = publisher.publish(test_frame(++sequence));
    EXPECT_TRUE(done.ok()) << done.error();
  }

  /// Publishes until the reader has a message, and gives it to `look`.
  template <class T, class F>
  void show(Reader<T>& reader, F&& look) {
    bool seen = false;
    EXPECT_TRUE(eventually([&] {
      publish();
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      const auto taken = reader.take_each([&](const T& m, const dds_sample_info_t&) {
        if (!seen) look(m);
        seen = true;
      });
      return taken.ok() && seen;
    })) << reader.topic();
  }
};

std::int64_t frame_stamp(std::uint64_t sequence) { return test_frame(sequence).stamp_ns; }

/// Whether a stamp is that of a frame that was published.
bool is_of_a_frame(const msg::Header& header, std::uint64_t newest) {
  std::set<std::int64_t> stamps;
  for (std::uint64_t i = 1; i <= newest; ++i) stamps.insert(frame_stamp(i));
  return stamps.contains(stamp_ns(header.stamp));
}

TEST(CameraViews, NothingIsMadeWithoutAReader) {
  Camera camera;
  const Participant other = open_participant();
  auto diagnostics = require(
      Reader<msg::DiagnosticArray>::open(other, topics::kDiagnostics, topics::kDiagnosticsQos));
  std::string frames;
  std::string made;
  // The report comes from the thread that would make them, after the frames before it.
  EXPECT_TRUE(eventually([&] {
    camera.publish();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    const auto taken =
        diagnostics.take_each([&](const msg::DiagnosticArray& m, const dds_sample_info_t&) {
          const auto& values = m.status._buffer[0].values;
          for (std::uint32_t i = 0; i < values._length; ++i) {
            const std::string key = values._buffer[i].key;
            if (key == "frames") frames = values._buffer[i].value;
            if (key == "views_made") made = values._buffer[i].value;
          }
        });
    return taken.ok() && !frames.empty() && std::stoi(frames) > 3;
  }));
  EXPECT_EQ(made, "0");
  EXPECT_EQ(camera.publisher.view_counters().made, 0U);

  auto raw = require(Reader<msg::Image>::open(other, "left/image_raw", topics::kImageQos));
  camera.show(raw, [](const msg::Image&) {});
  EXPECT_TRUE(eventually([&] { return camera.publisher.view_counters().made > 0; }));
}

TEST(CameraViews, RawImagesAreTheFramesOwnPixels) {
  Camera camera;
  const Participant other = open_participant();
  auto raw = require(Reader<msg::Image>::open(other, "right/image_raw", topics::kImageQos));
  camera.show(raw, [&](const msg::Image& m) {
    EXPECT_EQ(m.width, 640U);
    EXPECT_EQ(m.height, 400U);
    EXPECT_EQ(m.step, 640U);
    EXPECT_STREQ(m.encoding, "mono8");
    EXPECT_STREQ(m.header.frame_id, "cam_right_camera_optical_frame");
    EXPECT_TRUE(is_of_a_frame(m.header, camera.sequence));
    const SideImage sent = test_side(640, 400, 2);
    ASSERT_EQ(m.data._length, sent.data->size());
    EXPECT_TRUE(std::equal(sent.data->begin(), sent.data->end(), m.data._buffer));
  });
}

TEST(CameraViews, PreviewsAreSmallJpegsWithTheStampOfTheirFrame) {
  Camera camera;
  const Participant other = open_participant();
  struct Expected {
    const char* topic;
    int width, height;
  };
  for (const Expected& expected : {Expected{"left/preview/compressed", 640, 408},
                                   Expected{"left/preview_small/compressed", 320, 204},
                                   Expected{"left/image_raw/compressed", 752, 480},
                                   Expected{"right/preview/compressed", 640, 400}}) {
    auto reader =
        require(Reader<msg::CompressedImage>::open(other, expected.topic, topics::kCompressedQos));
    camera.show(reader, [&](const msg::CompressedImage& m) {
      EXPECT_STREQ(m.format, "mono8; jpeg compressed mono8");
      EXPECT_TRUE(is_of_a_frame(m.header, camera.sequence));
      const auto decoded = codecs::decode_jpeg({m.data._buffer, m.data._length});
      ASSERT_TRUE(decoded.ok()) << decoded.error();
      EXPECT_EQ(decoded->width, expected.width);
      EXPECT_EQ(decoded->height, expected.height);
    });
  }
}

TEST(CameraViews, CameraInfoIsThatOfRosWithTheBaselineInTheRightOne) {
  Camera camera;
  const Participant other = open_participant();
  auto left = require(Reader<msg::CameraInfo>::open(other, "left/camera_info", topics::kImageQos));
  auto right =
      require(Reader<msg::CameraInfo>::open(other, "right/camera_info", topics::kImageQos));
  double focal = 0.0;
  double row = 0.0;
  camera.show(left, [&](const msg::CameraInfo& m) {
    EXPECT_STREQ(m.distortion_model, "plumb_bob");
    ASSERT_EQ(m.d._length, 5U);
    EXPECT_EQ(m.d._buffer[0], -0.28);
    EXPECT_EQ(m.k[0], 458.6);
    EXPECT_EQ(m.p[3], 0.0);
    EXPECT_TRUE(is_of_a_frame(m.header, camera.sequence));
    focal = m.p[0];
    row = m.p[6];
  });
  camera.show(right, [&](const msg::CameraInfo& m) {
    EXPECT_STREQ(m.distortion_model, "equidistant");
    EXPECT_EQ(m.d._length, 4U);
    EXPECT_EQ(m.p[0], focal);
    EXPECT_EQ(m.p[6], row);
    EXPECT_NEAR(m.p[3], -focal * test_cameras().rig.baseline(), 1e-9);
    EXPECT_NEAR(m.p[7], 0.0, 1e-9);
  });
}

TEST(CameraViews, RectifiedImagesHaveTheSizeOfTheRawOnes) {
  Camera camera;
  const Participant other = open_participant();
  auto rect = require(Reader<msg::Image>::open(other, "left/image_rect", topics::kImageQos));
  camera.show(rect, [&](const msg::Image& m) {
    EXPECT_EQ(m.width, 752U);
    EXPECT_EQ(m.height, 480U);
    ASSERT_EQ(m.data._length, 752U * 480U);
    EXPECT_NE(m.data._buffer[240 * 752 + 376], 0);
  });
}

/// A camera process with a source that has colour: UYVY on the left, NV12 on the right.
struct ColourCamera : Camera {
  static constexpr std::uint8_t kU = 118;
  static constexpr std::uint8_t kV = 140;

  ColourWanted wanted = std::make_shared<std::atomic<bool>>(false);
  ColourKeeper left{wanted};
  ColourKeeper right{wanted};

  /// Levels at which these colour differences leave no value out of range.
  static SideImage luma(int width, int height, int seed) {
    SideImage side = test_side(width, height, seed);
    auto data = std::make_shared<std::vector<std::uint8_t>>(*side.data);
    for (std::uint8_t& level : *data) level = static_cast<std::uint8_t>(40 + level * 2 / 3);
    side.data = data;
    return side;
  }

  void publish_colour() {
    *wanted = publisher.wants_colour();
    StereoFrame frame = test_frame(++sequence);
    frame.left = luma(752, 480, 1);
    frame.right = luma(640, 400, 2);
    std::vector<std::uint8_t> uyvy;
    for (const std::uint8_t level : *frame.left.data) {
      uyvy.push_back(uyvy.size() % 4 == 0 ? kU : kV);
      uyvy.push_back(level);
    }
    std::vector<std::uint8_t> nv12 = *frame.right.data;
    for (int i = 0; i < 640 * 200; ++i) nv12.push_back(i % 2 == 0 ? kU : kV);
    const StereoColour colour = {left.keep({CameraFormat::kUyvy, 752, 480, 1504, uyvy}),
                                 right.keep({CameraFormat::kNv12, 640, 400, 640, nv12})};
    const auto done = publisher.publish(frame, colour);
    EXPECT_TRUE(done.ok()) << done.error();
  }

  /// Publishes until the reader has got `count` messages, which `look` sees.
  template <class T, class F>
  bool publish_until(Reader<T>& reader, int count, F&& look) {
    return eventually([&] {
      publish_colour();
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      const auto taken = reader.take_each([&](const T& m, const dds_sample_info_t&) {
        look(m);
        --count;
      });
      return taken.ok() && count <= 0;
    });
  }
};

/// That an image shows the colours of ColourCamera over the luma of a side.
void expect_colour(const msg::Image& m, const SideImage& luma) {
  EXPECT_STREQ(m.encoding, "rgb8");
  ASSERT_EQ(m.width, static_cast<std::uint32_t>(luma.width));
  ASSERT_EQ(m.height, static_cast<std::uint32_t>(luma.height));
  EXPECT_EQ(m.step, 3 * m.width);
  ASSERT_EQ(m.data._length, 3 * luma.data->size());
  double worst_luma = 0.0;
  double worst_red = 0.0;
  double worst_blue = 0.0;
  for (std::size_t i = 0; i < luma.data->size(); ++i) {
    const std::uint8_t* c = m.data._buffer + 3 * i;
    const double level = (*luma.data)[i];
    const double seen = 0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2];
    worst_luma = std::max(worst_luma, std::abs(seen - level));
    worst_red = std::max(worst_red, std::abs(c[0] - level - 1.402 * (ColourCamera::kV - 128)));
    worst_blue = std::max(worst_blue, std::abs(c[2] - level - 1.772 * (ColourCamera::kU - 128)));
  }
  EXPECT_LT(worst_luma, 1.0);
  EXPECT_LT(worst_red, 1.0);
  EXPECT_LT(worst_blue, 1.0);
}

TEST(CameraViews, ColourIsTheFramesOwnOnBothSides) {
  ColourCamera camera;
  const Participant other = open_participant();
  auto left = require(Reader<msg::Image>::open(other, "left/image_color", topics::kImageQos));
  EXPECT_TRUE(camera.publish_until(left, 1, [&](const msg::Image& m) {
    EXPECT_STREQ(m.header.frame_id, "cam_left_camera_optical_frame");
    EXPECT_TRUE(is_of_a_frame(m.header, camera.sequence));
    expect_colour(m, ColourCamera::luma(752, 480, 1));
  }));
  auto right = require(Reader<msg::Image>::open(other, "right/image_color", topics::kImageQos));
  EXPECT_TRUE(camera.publish_until(right, 1, [&](const msg::Image& m) {
    EXPECT_STREQ(m.header.frame_id, "cam_right_camera_optical_frame");
    EXPECT_TRUE(is_of_a_frame(m.header, camera.sequence));
    expect_colour(m, ColourCamera::luma(640, 400, 2));
  }));
  EXPECT_EQ(camera.publisher.view_counters().failed, 0U);
}

TEST(CameraViews, ColourIsNeitherKeptNorMadeWithoutItsReader) {
  ColourCamera camera;
  const Participant other = open_participant();
  // Reading this keeps the thread of the views at work; it is not counted as made.
  auto info = require(Reader<msg::CameraInfo>::open(other, "left/camera_info", topics::kImageQos));
  const auto pass = [](const msg::CameraInfo&) {};
  EXPECT_TRUE(camera.publish_until(info, 4, pass));
  EXPECT_EQ(camera.left.kept() + camera.right.kept(), 0U);
  EXPECT_EQ(camera.publisher.view_counters().made, 0U);
  {
    auto color = require(Reader<msg::Image>::open(other, "left/image_color", topics::kImageQos));
    EXPECT_TRUE(camera.publish_until(color, 2, [](const msg::Image&) {}));
    EXPECT_GE(camera.left.kept(), 2U);
    // It is counted when it has been written, and may be read before.
    EXPECT_TRUE(eventually([&] { return camera.publisher.view_counters().made >= 2; }));
  }
  EXPECT_TRUE(eventually([&] { return !camera.publisher.wants_colour(); }));
  const std::uint64_t kept = camera.left.kept();
  const std::uint64_t made = camera.publisher.view_counters().made;
  EXPECT_TRUE(camera.publish_until(info, 4, pass));
  EXPECT_EQ(camera.left.kept(), kept);
  EXPECT_EQ(camera.publisher.view_counters().made, made);
}

TEST(CameraViews, DamagedColourIsCountedAndCostsNothingElse) {
  Camera camera;
  const Participant other = open_participant();
  auto color = require(Reader<msg::Image>::open(other, "left/image_color", topics::kImageQos));
  auto raw = require(Reader<msg::Image>::open(other, "left/image_raw", topics::kImageQos));
  EXPECT_TRUE(eventually([&] { return camera.publisher.wants_colour(); }));
  const auto bytes = std::make_shared<std::vector<std::uint8_t>>(100, 1);
  const StereoColour damaged = {{CameraFormat::kMjpeg, 752, 480, 752, bytes, 0, 752}, {}};
  EXPECT_TRUE(eventually([&] {
    EXPECT_TRUE(camera.publisher.publish(test_frame(++camera.sequence), damaged).ok());
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return camera.publisher.view_counters().failed > 1;
  }));
  camera.show(raw, [](const msg::Image& m) { EXPECT_STREQ(m.encoding, "mono8"); });
  EXPECT_EQ(require(color.take_each([](const msg::Image&, const dds_sample_info_t&) {})), 0U);
}

TEST(ImageConversion, ReducingGivesTheMeansOfBlocks) {
  const std::vector<std::uint8_t> pixels = {10, 20, 100, 100, 9, 30, 40, 100, 100, 9};
  std::vector<std::uint8_t> storage;
  const GreyView small = reduced({pixels.data(), 4, 2, 5}, 2, &storage);
  EXPECT_EQ(small.width, 2);
  EXPECT_EQ(small.height, 1);
  EXPECT_EQ(small.data[0], 25);
  EXPECT_EQ(small.data[1], 100);
  EXPECT_EQ(reduced({pixels.data(), 4, 2, 5}, 8, &storage).data, pixels.data());
}

TEST(ImageConversion, SixteenBitsBecomeTheirUpperEight) {
  SideImage side;
  side.valid = true;
  side.format = PixelFormat::kMono16;
  side.width = 2;
  side.height = 1;
  side.step = 6;
  side.data = std::make_shared<std::vector<std::uint8_t>>(
      std::vector<std::uint8_t>{0xFF, 0x12, 0x00, 0xFE, 7, 7});
  std::vector<std::uint8_t> storage;
  const GreyView grey = grey_view(side, &storage);
  EXPECT_EQ(grey.step, 2);
  EXPECT_EQ(grey.data[0], 0x12);
  EXPECT_EQ(grey.data[1], 0xFE);
}

}  // namespace
}  // namespace sovo::bridge
