#include "driver/dataset_fixture.h"

namespace sovo {
namespace {

class DatasetLayouts : public DatasetFixture {};

TEST_F(DatasetLayouts, KittiGrey) {
  write_kitti("00", 4);
  const auto source = open(path("00"));
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->layout(), LayoutKind::kKittiGrey);
  EXPECT_EQ(source->size(), 4U);
  EXPECT_NEAR(source->rig().baseline(), 0.1, 1e-12);
  EXPECT_EQ(source->rig().left.width, kWidth);
  for (int n = 0; n < 4; ++n) {
    const SourceResult r = next(source.get());
    ASSERT_EQ(r.state, SourceState::kFrame) << r.message;
    EXPECT_EQ(r.frame.stamp_ns, n * 100'000'000);
    EXPECT_EQ(r.frame.sequence, static_cast<std::uint64_t>(n));
    EXPECT_EQ(r.frame.clock, 3);
    EXPECT_EQ(level_of(r.frame.left), n);
    EXPECT_EQ(level_of(r.frame.right), 100 + n);
    EXPECT_EQ(r.frame.left.step, kWidth);
    EXPECT_EQ(r.frame.left.data->size(), static_cast<std::size_t>(kWidth * kHeight));
  }
  EXPECT_EQ(next(source.get()).state, SourceState::kEndOfStream);
  EXPECT_EQ(next(source.get()).state, SourceState::kEndOfStream);
  EXPECT_EQ(source->counts().delivered, 4U);
}

TEST_F(DatasetLayouts, KittiColourUsesItsOwnProjections) {
  write_kitti("02", 3, true);
  const auto source = open(path("02"));
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->layout(), LayoutKind::kKittiColour);
  EXPECT_NEAR(source->rig().baseline(), 0.2, 1e-12);
}

TEST_F(DatasetLayouts, KittiWithoutTimesIsTenHertzAndSaysSo) {
  write_kitti("00", 3);
  std::filesystem::remove(path("00/times.txt"));
  const auto source = open(path("00"));
  ASSERT_NE(source, nullptr);
  ASSERT_EQ(source->notes().size(), 1U);
  next(source.get());
  EXPECT_EQ(next(source.get()).frame.stamp_ns, 100'000'000);
}

TEST_F(DatasetLayouts, KittiWithTooFewTimesIsRefused) {
  write_kitti("00", 3);
  write_text("00/times.txt", "0.0\n0.1\n");
  DatasetOptions options;
  options.path = path("00");
  const auto source = open_dataset(options);
  ASSERT_FALSE(source.ok());
  EXPECT_NE(source.error().find("times.txt"), std::string::npos) << source.error();
}

TEST_F(DatasetLayouts, KittiRawTakesTheCalibrationOfTheDay) {
  write_kitti_raw("2011_09_26", 3);
  const std::string drive = path("2011_09_26/2011_09_26_drive_0001_extract");
  for (const std::string& given : {drive, drive + "/"}) {
    const auto source = open(given);
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->layout(), LayoutKind::kKittiRawGrey);
    EXPECT_EQ(source->rig().left.distortion, Distortion::kRadtan);
    EXPECT_NEAR(source->rig().baseline(), 0.1, 1e-12);
    constexpr std::int64_t kFirst = 1'317'081'599'000'000'000;  // 2011-09-26 23:59:59 UTC
    for (int n = 0; n < 3; ++n) {
      const SourceResult r = next(source.get());
      ASSERT_EQ(r.state, SourceState::kFrame) << r.message;
      EXPECT_EQ(r.frame.stamp_ns, kFirst + n * 100'000'000);
      EXPECT_EQ(r.frame.right.stamp_offset_ns, 0) << "triggered together";
      EXPECT_EQ(level_of(r.frame.left), n);
      EXPECT_EQ(level_of(r.frame.right), 100 + n);
    }
  }
}

TEST_F(DatasetLayouts, KittiRawErrorsSayWhatToDo) {
  write_kitti_raw("2011_09_26", 3);
  const std::string name = "2011_09_26/2011_09_26_drive_0001_extract";
  const auto error_of = [&](const std::string& folder) {
    DatasetOptions options;
    options.path = path(folder);
    const auto source = open_dataset(options);
    return source.ok() ? std::string() : source.error();
  };
  EXPECT_NE(error_of("2011_09_26").find("give one of the drives in it"), std::string::npos);
  const std::string times = name + "/image_01/timestamps.txt";
  write_text(times, "2011-09-26 13:02:25.9\n2011-09-26 13:02:26.0\n");
  EXPECT_NE(error_of(name).find("has 2 times, none for image"), std::string::npos);
  for (const std::string wrong : {"2011-09-26", "2011-13-26 13:02:26.1", "2011-09-26 13:02:x",
                                  "2011-09-26 24:02:26.1", "2011-09-26 13:60:26.1"}) {
    write_text(times, "2011-09-26 13:02:25.9\n\n" + wrong + "\n");
    EXPECT_NE(error_of(name).find("timestamps.txt:3: wanted a time like"), std::string::npos)
        << error_of(name);
  }
  write_text(times, "2011-09-26 13:02:25.9\n2011-09-26 13:02:25.9\n2011-09-26 13:02:26.0\n");
  EXPECT_NE(error_of(name).find("0000000001.png is not after"), std::string::npos);
  std::filesystem::remove(path(times));
  EXPECT_NE(error_of(name).find("timestamps.txt"), std::string::npos);
  write_kitti_raw("2011_09_26", 3);
  std::filesystem::remove(path("2011_09_26/calib_cam_to_cam.txt"));
  EXPECT_NE(error_of(name).find("calib_cam_to_cam.txt"), std::string::npos) << error_of(name);
}

TEST_F(DatasetLayouts, EurocByEitherFolder) {
  write_euroc("MH", 3);
  for (const char* name : {"MH", "MH/mav0"}) {
    const auto source = open(path(name));
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->layout(), LayoutKind::kEuroc);
    EXPECT_NEAR(source->rig().baseline(), 0.1, 1e-12);
    const SourceResult r = next(source.get());
    ASSERT_EQ(r.state, SourceState::kFrame) << r.message;
    EXPECT_EQ(r.frame.stamp_ns, euroc_stamp(0));
    EXPECT_EQ(level_of(r.frame.right), 100);
  }
}

TEST_F(DatasetLayouts, EurocPairsByStampAndCountsTheRest) {
  write_euroc("MH", 5, 2'000'000);
  const std::string stamp = std::to_string(euroc_stamp(2) + 2'000'000);
  std::ifstream in(path("MH/mav0/cam1/data.csv"));
  std::string csv;
  for (std::string line; std::getline(in, line);) {
    if (line.rfind(stamp, 0) != 0) csv += line + "\n";
  }
  write_text("MH/mav0/cam1/data.csv", csv);
  const auto source = open(path("MH"));
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->size(), 4U);
  ASSERT_EQ(source->notes().size(), 1U);
  EXPECT_NE(source->notes()[0].find("1 images have no partner"), std::string::npos);
  std::vector<int> levels;
  for (int n = 0; n < 4; ++n) {
    const SourceResult r = next(source.get());
    levels.push_back(level_of(r.frame.left));
    EXPECT_EQ(r.frame.right.stamp_offset_ns, 2'000'000);
    EXPECT_NEAR(r.frame.pair_error_s, 0.002, 1e-12);
  }
  EXPECT_EQ(levels, (std::vector<int>{0, 1, 3, 4}));
}

TEST_F(DatasetLayouts, EurocListMayGoOnBeyondTheImages) {
  write_euroc("MH", 4);
  for (const char* camera : {"cam0", "cam1"}) {
    const std::string base = std::string("MH/mav0/") + camera + "/data/";
    for (const int n : {2, 3}) {
      std::filesystem::remove(path(base + std::to_string(euroc_stamp(n)) + ".png"));
    }
  }
  const auto source = open(path("MH"));
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->size(), 2U);
  ASSERT_EQ(source->notes().size(), 1U);
  EXPECT_NE(source->notes()[0].find("2 pairs are listed but not there"), std::string::npos);
}

TEST_F(DatasetLayouts, TumViHasExposures) {
  write_euroc("room", 2);
  write_text("room/dso/camchain.yaml",
             "cam0:\n  T_cam_imu:\n  - [1.0, 0.0, 0.0, 0.0]\n  - [0.0, 1.0, 0.0, 0.0]\n"
             "  - [0.0, 0.0, 1.0, 0.0]\n  - [0.0, 0.0, 0.0, 1.0]\n  camera_model: pinhole\n"
             "  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]\n  distortion_model: radtan\n"
             "  intrinsics: [50.0, 50.0, 31.5, 23.5]\n  resolution: [64, 48]\n"
             "cam1:\n  T_cn_cnm1:\n  - [1.0, 0.0, 0.0, -0.1]\n  - [0.0, 1.0, 0.0, 0.0]\n"
             "  - [0.0, 0.0, 1.0, 0.0]\n  - [0.0, 0.0, 0.0, 1.0]\n  camera_model: pinhole\n"
             "  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]\n  distortion_model: radtan\n"
             "  intrinsics: [50.0, 50.0, 31.5, 23.5]\n  resolution: [64, 48]\n");
  const std::string stamp = std::to_string(euroc_stamp(0));
  write_text("room/dso/cam0/times.txt",
             "# filename timestamp[s] [exposuretime[ms]]\n" + stamp + " 1403636584.76355 1.5\n");
  const auto source = open(path("room"));
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->layout(), LayoutKind::kTumVi);
  const SourceResult r = next(source.get());
  EXPECT_FLOAT_EQ(r.frame.left.exposure_s, 0.0015F);
  EXPECT_EQ(r.frame.right.exposure_s, 0.0F);
}

TEST_F(DatasetLayouts, FoldersNamedByStamp) {
  write_calibration("plain/calibration.yaml");
  for (int n = 0; n < 3; ++n) {
    const std::string stamp = std::to_string(euroc_stamp(n));
    write_jpeg("plain/left/" + stamp + ".jpg", 50 + n);
    write_pgm("plain/right/" + stamp + ".pgm", 20 + n);
  }
  const auto source = open(path("plain"));
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(source->layout(), LayoutKind::kFolders);
  EXPECT_EQ(source->rig().name, "tiny");
  const SourceResult r = next(source.get());
  ASSERT_EQ(r.state, SourceState::kFrame) << r.message;
  EXPECT_EQ(r.frame.stamp_ns, euroc_stamp(0));
  EXPECT_NEAR(level_of(r.frame.left), 50, 1);
  EXPECT_EQ(level_of(r.frame.right), 20);
}

TEST_F(DatasetLayouts, FoldersNamedByCounterTakeTimesOrTheRate) {
  write_calibration("plain/calibration.yaml");
  for (int n = 7; n < 12; ++n) {
    write_image16("plain/left/frame_" + std::to_string(n) + ".png", 1000 * n);
    write_image16("plain/right/frame_" + std::to_string(n) + ".png", 1000 * n + 1);
  }
  DatasetOptions options;
  options.path = path("plain");
  options.frame_rate = 4.0;
  auto source = open(options);
  ASSERT_NE(source, nullptr);
  SourceResult r = next(source.get());
  EXPECT_EQ(r.frame.left.format, PixelFormat::kMono16);
  EXPECT_EQ(r.frame.left.step, 2 * kWidth);
  EXPECT_EQ(level_of(r.frame.left), 7000);
  r = next(source.get());
  EXPECT_EQ(level_of(r.frame.left), 8000);
  EXPECT_EQ(r.frame.stamp_ns, 250'000'000);
  write_text("plain/times.txt", "5.5\n5.75\n6\n6.25\n6.5\n");
  source = open(options);
  ASSERT_NE(source, nullptr);
  EXPECT_EQ(next(source.get()).frame.stamp_ns, 5'500'000'000);
  write_text("plain/times.txt", "5.5\n");
  EXPECT_FALSE(open_dataset(options).ok());
}

TEST_F(DatasetLayouts, WhatIsNoDatasetIsRefusedWithAHint) {
  DatasetOptions options;
  options.path = path("nowhere");
  EXPECT_FALSE(open_dataset(options).ok());
  write_kitti("sequences/00", 1);
  options.path = folder_.string();
  const auto source = open_dataset(options);
  ASSERT_FALSE(source.ok());
  EXPECT_NE(source.error().find("sequences"), std::string::npos) << source.error();
}

TEST_F(DatasetLayouts, MissingCalibrationIsNamed) {
  write_image("plain/left/1.png", 1);
  write_image("plain/right/1.png", 1);
  DatasetOptions options;
  options.path = path("plain");
  const auto source = open_dataset(options);
  ASSERT_FALSE(source.ok());
  EXPECT_NE(source.error().find("calib"), std::string::npos) << source.error();
}

}  // namespace
}  // namespace sovo
