#include <thread>

#include "driver/dataset_fixture.h"
#include "io/io_test_support.h"

namespace sovo {
namespace {

class DatasetSources : public DatasetFixture {};

TEST_F(DatasetSources, BadImagesAreReportedAndTheStreamGoesOn) {
  write_kitti("00", 6);
  std::filesystem::remove(path("00/image_1/000001.png"));
  write_text("00/image_0/000002.png", "\x89PNG\r\n\x1a\nrubbish");
  write_image("00/image_0/000003.png", 3, kWidth + 8);
  write_text("00/image_1/000004.png", "");
  const auto source = open(path("00"));
  ASSERT_NE(source, nullptr);
  std::vector<SourceResult> results;
  for (int n = 0; n < 6; ++n) results.push_back(next(source.get()));
  for (const int n : {0, 5}) EXPECT_EQ(results[n].state, SourceState::kFrame) << n;
  const std::vector<std::string> wanted{"image_1/000001.png", "image_0/000002.png",
                                        "the image is 72x48 pixels, the calibration is for 64x48",
                                        "image_1/000004.png: the file is empty"};
  for (int n = 1; n < 5; ++n) {
    EXPECT_EQ(results[n].state, SourceState::kBadFrame) << n;
    EXPECT_NE(results[n].message.find(wanted[n - 1]), std::string::npos) << results[n].message;
    EXPECT_EQ(results[n].frame.sequence, static_cast<std::uint64_t>(n));
  }
  EXPECT_EQ(next(source.get()).state, SourceState::kEndOfStream);
  EXPECT_EQ(source->counts().delivered, 2U);
  EXPECT_EQ(source->counts().bad, 4U);
}

TEST_F(DatasetSources, BothSidesMissingInTheMiddleIsABadFrame) {
  write_kitti("00", 3);
  std::filesystem::remove(path("00/image_0/000001.png"));
  std::filesystem::remove(path("00/image_1/000001.png"));
  const auto source = open(path("00"));
  ASSERT_NE(source, nullptr);
  next(source.get());
  EXPECT_EQ(next(source.get()).state, SourceState::kBadFrame);
  const SourceResult last = next(source.get());
  EXPECT_EQ(last.state, SourceState::kFrame);
  EXPECT_EQ(last.frame.sequence, 2U);
}

TEST_F(DatasetSources, ReverseMirrorsTheStamps) {
  write_euroc("MH", 4, 1'000'000);
  DatasetOptions options;
  options.path = path("MH");
  options.reverse = true;
  const auto source = open(options);
  ASSERT_NE(source, nullptr);
  for (int n = 0; n < 4; ++n) {
    const SourceResult r = next(source.get());
    ASSERT_EQ(r.state, SourceState::kFrame);
    EXPECT_EQ(level_of(r.frame.left), 3 - n);
    EXPECT_EQ(r.frame.stamp_ns, euroc_stamp(n));
    EXPECT_EQ(r.frame.right.stamp_offset_ns, -1'000'000);
    EXPECT_EQ(source->original_stamp(r.frame.stamp_ns), euroc_stamp(3 - n));
  }
}

TEST_F(DatasetSources, ReverseMirrorsUnevenStamps) {
  write_kitti("00", 3);
  write_text("00/times.txt", "1.0\n1.1\n1.5\n");
  DatasetOptions options;
  options.path = path("00");
  options.reverse = true;
  const auto source = open(options);
  ASSERT_NE(source, nullptr);
  std::vector<std::int64_t> fed;
  for (int n = 0; n < 3; ++n) fed.push_back(next(source.get()).frame.stamp_ns);
  EXPECT_EQ(fed, (std::vector<std::int64_t>{1'000'000'000, 1'400'000'000, 1'500'000'000}));
}

TEST_F(DatasetSources, StartAndMaxFramesSelectBeforeReversing) {
  write_kitti("00", 8);
  DatasetOptions options;
  options.path = path("00");
  options.start_frame = 2;
  options.max_frames = 3;
  options.reverse = true;
  auto source = open(options);
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->size(), 3U);
  for (const int level : {4, 3, 2}) EXPECT_EQ(level_of(next(source.get()).frame.left), level);
  EXPECT_EQ(next(source.get()).state, SourceState::kEndOfStream);
  options.start_frame = 8;
  EXPECT_FALSE(open_dataset(options).ok());
}

TEST_F(DatasetSources, RestampShiftsToNowAndBack) {
  write_kitti("00", 3);
  DatasetOptions options;
  options.path = path("00");
  options.restamp = true;
  const auto source = open(options);
  ASSERT_NE(source, nullptr);
  const std::int64_t first = next(source.get()).frame.stamp_ns;
  const std::int64_t second = next(source.get()).frame.stamp_ns;
  EXPECT_GT(first, 1'600'000'000'000'000'000);
  EXPECT_EQ(second - first, 100'000'000);
  EXPECT_EQ(source->original_stamp(first), 0);
  EXPECT_EQ(source->original_stamp(second), 100'000'000);
}

TEST_F(DatasetSources, PacedFramesAreNeverEarlyAndTimeOutsLoseNone) {
  write_kitti("00", 4);
  DatasetOptions options;
  options.path = path("00");
  options.rate = 2.0;
  const auto source = open(options);
  ASSERT_NE(source, nullptr);
  const auto begin = std::chrono::steady_clock::now();
  std::vector<int> levels;
  while (true) {
    const SourceResult r = source->next(std::chrono::milliseconds(3));
    if (r.state == SourceState::kTimeout) continue;
    if (r.state != SourceState::kFrame) break;
    levels.push_back(level_of(r.frame.left));
    const auto elapsed = std::chrono::steady_clock::now() - begin;
    EXPECT_GE(elapsed, std::chrono::nanoseconds(r.frame.stamp_ns / 2));
  }
  EXPECT_EQ(levels, (std::vector<int>{0, 1, 2, 3}));
}

TEST_F(DatasetSources, ClosingEarlyIsClean) {
  write_kitti("00", 9);
  for (int n = 0; n < 5; ++n) {
    const auto source = open(path("00"));
    ASSERT_NE(source, nullptr);
    for (int i = 0; i < n; ++i) next(source.get());
  }
}

TEST_F(DatasetSources, CalibrationOfOtherImagesIsRefused) {
  write_kitti("00", 3);
  write_calibration("other.yaml", 80);
  write_calibration("fitting.yaml");
  DatasetOptions options;
  options.path = path("00");
  options.calibration = path("other.yaml");
  const auto source = open_dataset(options);
  ASSERT_FALSE(source.ok());
  EXPECT_NE(source.error().find("64x48"), std::string::npos) << source.error();
  options.calibration = path("fitting.yaml");
  const auto fitting = open(options);
  ASSERT_NE(fitting, nullptr);
  EXPECT_EQ(fitting->rig().name, "tiny");
}

TEST_F(DatasetSources, WrongOptionsAreRefused) {
  write_kitti("00", 3);
  DatasetOptions good;
  good.path = path("00");
  for (int n = 0; n < 4; ++n) {
    DatasetOptions options = good;
    if (n == 0) options.rate = -1.0;
    if (n == 1) options.start_frame = -1;
    if (n == 2) options.max_frames = -1;
    if (n == 3) options.frame_rate = 0.0;
    EXPECT_FALSE(open_dataset(options).ok()) << n;
  }
}

struct Clip {
  const char* name;
  LayoutKind kind;
  std::size_t pairs;
  int width;
  double baseline;
};

class RealClips : public testing::TestWithParam<Clip> {};

TEST_P(RealClips, OpenAndDecode) {
  const std::string path = shared_data(GetParam().name);
  if (path.empty()) GTEST_SKIP() << "no data/" << GetParam().name << " in the shared folder";
  DatasetOptions options;
  options.path = path;
  auto opened = open_dataset(options);
  ASSERT_TRUE(opened.ok()) << opened.error();
  DatasetSource& source = **opened;
  EXPECT_EQ(source.layout(), GetParam().kind);
  EXPECT_EQ(source.size(), GetParam().pairs);
  EXPECT_EQ(source.rig().left.width, GetParam().width);
  EXPECT_NEAR(source.rig().baseline(), GetParam().baseline, 1e-3);
  for (int n = 0; n < 3; ++n) {
    const SourceResult r = source.next(std::chrono::milliseconds(60'000));
    ASSERT_EQ(r.state, SourceState::kFrame) << r.message;
    EXPECT_EQ(r.frame.right.width, source.rig().right.width);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Shared, RealClips,
    testing::Values(Clip{"kitti/sequences/00", LayoutKind::kKittiGrey, 121, 1241, 0.5372},
                    Clip{"kitti/sequences/02", LayoutKind::kKittiColour, 8, 1241, 0.5333},
                    Clip{"kitti/sequences/06", LayoutKind::kKittiGrey, 51, 1226, 0.5372},
                    Clip{"euroc/MH_01_head", LayoutKind::kEuroc, 150, 752, 0.1101},
                    Clip{"tumvi/room1_head", LayoutKind::kTumVi, 60, 512, 0.1010}));

TEST(RealTumVi, HasPhotometricCalibrationAndExposure) {
  const std::string path = shared_data("tumvi/room1_head");
  if (path.empty()) GTEST_SKIP() << "no data/tumvi/room1_head in the shared folder";
  DatasetOptions options;
  options.path = path;
  auto opened = open_dataset(options);
  ASSERT_TRUE(opened.ok()) << opened.error();
  const Calibration& calibration = (*opened)->calibration();
  EXPECT_EQ(calibration.rig.left.distortion, Distortion::kEquidistant);
  EXPECT_EQ(calibration.left_photometric.inverse_response.size(), 256U);
  EXPECT_EQ(calibration.left_photometric.vignette.width(), 512);
  const SourceResult r = (*opened)->next(std::chrono::milliseconds(60'000));
  EXPECT_NEAR(r.frame.left.exposure_s, 0.001462315, 1e-8);
}

}  // namespace
}  // namespace sovo
