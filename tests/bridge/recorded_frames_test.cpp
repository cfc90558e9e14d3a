#include "sovo/bridge/recorded_frames.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <random>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/camera_info_conversion.h"
#include "sovo/bridge/cdr_codec.h"
#include "sovo/bridge/image_conversion.h"
#include "sovo/bridge/image_topics.h"
#include "sovo/bridge/mcap_source.h"
#include "sovo/bridge/recording_topics.h"
#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/topics.h"
#include "sovo/io/jpeg_encoder.h"
#include "sovo/io/recording_writer.h"
#include "test_bus.h"
#include "test_cameras.h"

namespace sovo::bridge {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kPeriod = 50'000'000;

/// A bag that is written message by message.
class RecordedFramesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = fs::temp_directory_path() / (name + std::to_string(::getpid()));
    fs::create_directories(folder_);
    RecordingConfig config;
    config.min_free_bytes = 0;
    writer_ = require(RecordingWriter::create((folder_ / "bag.mcap").string(), config));
  }
  void TearDown() override { fs::remove_all(folder_); }

  void put(const std::string& topic, const char* type, std::int64_t stamp, const Bytes& bytes) {
    const auto number =
        writer_->topic_number(recording_topic(topic, *find_schema(type), reliable(5)));
    const auto ns = static_cast<std::uint64_t>(stamp);
    ASSERT_TRUE(writer_->write(number, ns, ns, bytes).ok());
  }

  Bytes image_bytes(std::int64_t stamp, int seed) const {
    return encode(to_image(test_side(64, 48, seed), {to_message(stamp), borrow("optical")}));
  }

  void put_image(const std::string& topic, std::int64_t stamp, int seed) {
    put(topic, MessageTraits<msg::Image>::kRosName, stamp, image_bytes(stamp, seed));
  }

  void put_jpeg(const std::string& topic, std::int64_t stamp) {
    const SideImage side = test_side(64, 48, 0);
    JpegEncoder encoder;
    const auto jpeg = encoder.encode(side.data->data(), 64, 48, 64, 95);
    ASSERT_TRUE(jpeg.ok());
    const std::vector<std::uint8_t> data(jpeg->begin(), jpeg->end());
    msg::CompressedImage message{};
    message.header.stamp = to_message(stamp);
    message.header.frame_id = borrow("optical");
    message.format = borrow("jpeg");
    borrow(message.data, data);
    put(topic, MessageTraits<msg::CompressedImage>::kRosName, stamp, encode(message));
  }

  void put_infos(const std::string& left, const std::string& right) {
    const StereoRig rig = test_cameras().rig;
    for (const bool is_left : {true, false}) {
      CameraInfoMessage info(rig, rectify(rig), is_left, "optical");
      put((is_left ? left : right) + "/camera_info", MessageTraits<msg::CameraInfo>::kRosName, 0,
          encode(info.at(0)));
    }
  }

  Result<std::unique_ptr<McapSource>> open(const RecordedFramesConfig& topics = {}) {
    EXPECT_TRUE(writer_->close().ok());
    McapSourceConfig config;
    config.path = (folder_ / "bag.mcap").string();
    config.topics = topics;
    return McapSource::open(config);
  }

  fs::path folder_;
  std::unique_ptr<RecordingWriter> writer_;
};

std::vector<SourceResult> read_all(McapSource& source) {
  std::vector<SourceResult> results;
  while (true) {
    results.push_back(source.next(std::chrono::milliseconds(0)));
    if (results.back().state == SourceState::kEndOfStream) break;
  }
  results.pop_back();
  return results;
}

TEST_F(RecordedFramesTest, PairsImagesOfTwoTopicsAndGivesLateOnesAlone) {
  put_infos("/cam0", "/cam1");
  for (int i = 0; i < 5; ++i) {
    put_image("/cam0/image_raw", i * kPeriod, i);
    if (i != 2 && i != 4) put_image("/cam1/image_raw", i * kPeriod + 1'000'000, i + 10);
  }
  auto source = require(open());
  EXPECT_EQ(source->about(), "/cam0/image_raw and /cam1/image_raw");
  EXPECT_EQ(source->cameras().rig.left.fx, test_cameras().rig.left.fx);
  EXPECT_EQ(source->size(), 5U);
  const auto results = read_all(*source);
  ASSERT_EQ(results.size(), 5U);
  for (std::size_t i = 0; i < 5; ++i) {
    ASSERT_EQ(results[i].state, SourceState::kFrame) << results[i].message;
    const StereoFrame& frame = results[i].frame;
    EXPECT_EQ(frame.sequence, i);
    EXPECT_EQ(frame.stamp_ns, static_cast<std::int64_t>(i) * kPeriod);
    EXPECT_EQ(*frame.left.data, *test_side(64, 48, static_cast<int>(i)).data);
    EXPECT_EQ(frame.right.valid, i != 2 && i != 4);
  }
  EXPECT_NEAR(results[0].frame.pair_error_s, 0.001, 1e-9);
}

TEST_F(RecordedFramesTest, BeginAnewAfterARewind) {
  put_infos("/cam0", "/cam1");
  for (int i = 0; i < 3; ++i) {
    put_image("/cam0/image_raw", i * kPeriod, i);
    if (i != 0) put_image("/cam1/image_raw", i * kPeriod, i);
  }
  ASSERT_TRUE(writer_->close().ok());
  auto recording = require(Recording::open((folder_ / "bag.mcap").string()));
  const auto frames = require(RecordedFrames::open(*recording, {}));
  for (const int before : {1, 3, 0}) {
    frames->rewind();
    for (int i = 0; i < before; ++i) EXPECT_EQ(frames->next().state, SourceState::kFrame);
    frames->rewind();
    for (int i = 0; i < 3; ++i) {
      const SourceResult next = frames->next();
      ASSERT_EQ(next.state, SourceState::kFrame) << next.message;
      EXPECT_EQ(next.frame.stamp_ns, i * kPeriod);
      EXPECT_EQ(next.frame.right.valid, i != 0);
    }
    EXPECT_EQ(frames->next().state, SourceState::kEndOfStream);
  }
}

TEST_F(RecordedFramesTest, ATopicThatIsNamedAndNotThereIsSaid) {
  put_infos("/cam0", "/cam1");
  put_image("/cam0/image_raw", 0, 1);
  put_image("/cam1/image_raw", 0, 1);
  ASSERT_TRUE(writer_->close().ok());
  auto recording = require(Recording::open((folder_ / "bag.mcap").string()));
  const auto refused = RecordedFrames::open(*recording, {"/cam7/image_raw", "/cam1/image_raw"});
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().find("/cam7/image_raw"), std::string::npos) << refused.error();
  EXPECT_EQ(refused.error().find("StereoFrame"), std::string::npos) << refused.error();
}

TEST_F(RecordedFramesTest, CompressedImagesDoWhenThereAreNoOthers) {
  put_infos("/rig/left", "/rig/right");
  put_jpeg("/rig/left/image_raw/compressed", kPeriod);
  put_jpeg("/rig/right/image_raw/compressed", kPeriod);
  const auto results = read_all(*require(open()));
  ASSERT_EQ(results.size(), 1U);
  ASSERT_EQ(results[0].state, SourceState::kFrame) << results[0].message;
  EXPECT_EQ(results[0].frame.left.width, 64);
  EXPECT_EQ(results[0].frame.right.data->size(), 64U * 48U);
}

TEST_F(RecordedFramesTest, RawImagesWithCalibrationComeBeforeAllOthers) {
  put_infos("/sovo/left", "/sovo/right");
  for (const std::string side : {"left", "right"}) {
    put_image("/sovo/" + side + "/image_raw", 0, 1);
    put_image("/sovo/" + side + "/image_rect", 0, 1);
    put_image("/sovo/" + side + "/image_color", 0, 1);
    put_jpeg("/sovo/" + side + "/preview/compressed", 0);
    put_image("/other/" + side + "/image_raw", 0, 1);
  }
  EXPECT_EQ(require(open())->about(), "/sovo/left/image_raw and /sovo/right/image_raw");
}

TEST_F(RecordedFramesTest, TwoPairsMustBeNamed) {
  for (const std::string camera : {"/front", "/rear"}) {
    put_infos(camera + "/left", camera + "/right");
    put_image(camera + "/left/image_raw", 0, 1);
    put_image(camera + "/right/image_raw", 0, 1);
  }
  const auto refused = open();
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().find("more than one stereo pair"), std::string::npos);
  McapSourceConfig named;
  named.path = (folder_ / "bag.mcap").string();
  named.topics = {"rear/left/image_raw", "/rear/right/image_raw", 0.005};
  EXPECT_EQ(require(McapSource::open(named))->about(),
            "/rear/left/image_raw and /rear/right/image_raw");
}

TEST_F(RecordedFramesTest, DamagedImagesAreRefusedOneByOne) {
  put_infos("/cam0", "/cam1");
  std::mt19937 random(7);
  for (int i = 0; i < 300; ++i) {
    Bytes bytes = image_bytes(i * kPeriod, i);
    const std::size_t most = i % 3 == 0 ? bytes.size() : 80;
    for (int flips = 0; flips < 3; ++flips) {
      bytes[random() % most] = static_cast<std::uint8_t>(random());
    }
    if (i % 5 == 0) bytes.resize(random() % bytes.size());
    put("/cam0/image_raw", MessageTraits<msg::Image>::kRosName, i * kPeriod, bytes);
    put_image("/cam1/image_raw", i * kPeriod, i);
  }
  int refused = 0;
  for (const SourceResult& result : read_all(*require(open()))) {
    refused += result.state == SourceState::kBadFrame ? 1 : 0;
    if (result.state != SourceState::kFrame) continue;
    EXPECT_EQ(result.frame.left.data->size(),
              static_cast<std::size_t>(result.frame.left.step) * result.frame.left.height);
  }
  EXPECT_GT(refused, 60);
}

TEST(ImageTopics, CameraInfoLiesBesideTheImage) {
  EXPECT_EQ(info_topic("/cam/left/image_raw"), "/cam/left/camera_info");
  EXPECT_EQ(info_topic("/cam/left/image_raw/compressed"), "/cam/left/camera_info");
  EXPECT_TRUE(is_rectified("/cam/left/image_rect/compressed"));
  EXPECT_FALSE(is_rectified("/rectangle/image_raw"));
}

}  // namespace
}  // namespace sovo::bridge
