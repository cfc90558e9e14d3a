#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>
#include <turbojpeg.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "sovo/driver/dataset/dataset_source.h"
#include "sovo/io/calibration.h"
#include "sovo/io/image_file.h"

namespace sovo {

/// Makes tiny datasets in a folder that goes away with the test. Every image is of one grey level,
/// so that a test sees which one it got.
class DatasetFixture : public testing::Test {
 protected:
  static constexpr int kWidth = 64;
  static constexpr int kHeight = 48;

  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "sovo_dataset_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  void write_text(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }

  void write_image(const std::string& name, int level, int width = kWidth) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    const auto size = static_cast<std::size_t>(width) * kHeight;
    const GreyImage image{width, kHeight, PixelFormat::kMono8,
                          std::vector<std::uint8_t>(size, static_cast<std::uint8_t>(level))};
    ASSERT_TRUE(write_png(path(name), image).ok());
  }

  void write_image16(const std::string& name, int level) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    GreyImage image{kWidth, kHeight, PixelFormat::kMono16, {}};
    for (int i = 0; i < kWidth * kHeight; ++i) {
      image.data.push_back(static_cast<std::uint8_t>(level % 256));
      image.data.push_back(static_cast<std::uint8_t>(level / 256));
    }
    ASSERT_TRUE(write_png(path(name), image).ok());
  }

  void write_jpeg(const std::string& name, int level) const {
    const std::vector<unsigned char> grey(kWidth * kHeight, static_cast<unsigned char>(level));
    unsigned char* out = nullptr;
    unsigned long size = 0;
    tjhandle handle = tjInitCompress();
    ASSERT_EQ(tjCompress2(handle, grey.data(), kWidth, 0, kHeight, TJPF_GRAY, &out, &size,
                          TJSAMP_GRAY, 95, 0),
              0);
    write_text(name, std::string(reinterpret_cast<const char*>(out), size));
    tjFree(out);
    tjDestroy(handle);
  }

  void write_pgm(const std::string& name, int level) const {
    write_text(name, "P5 64 48 255\n" + std::string(kWidth * kHeight, static_cast<char>(level)));
  }

  /// A rig of two equal pinhole cameras of `width` x 48, 0.1 m apart.
  static StereoRig rig(int width = kWidth) {
    StereoRig rig;
    rig.name = "tiny";
    rig.left.width = width;
    rig.left.height = kHeight;
    rig.left.fx = rig.left.fy = 50.0;
    rig.left.cx = 31.5;
    rig.left.cy = 23.5;
    rig.right = rig.left;
    rig.T_right_left = SE3(SO3(), Vec3(-0.1, 0.0, 0.0));
    return rig;
  }

  void write_calibration(const std::string& name, int width = kWidth) const {
    write_text(name, format_sovo_calibration(rig(width)));
  }

  /// KITTI layout of `frames` pairs; left images have the level n, right ones 100 + n.
  void write_kitti(const std::string& root, int frames, bool colour = false) const {
    write_text(root + "/calib.txt",
               "P0: 50 0 31.5 0 0 50 23.5 0 0 0 1 0\nP1: 50 0 31.5 -5 0 50 23.5 0 0 0 1 0\n"
               "P2: 50 0 31.5 1 0 50 23.5 0 0 0 1 0\nP3: 50 0 31.5 -9 0 50 23.5 0 0 0 1 0\n");
    std::string times;
    for (int n = 0; n < frames; ++n) {
      const std::string name = "/00000" + std::to_string(n) + ".png";
      write_image(root + (colour ? "/image_2" : "/image_0") + name, n);
      write_image(root + (colour ? "/image_3" : "/image_1") + name, 100 + n);
      times += std::to_string(0.1 * n) + "\n";
    }
    write_text(root + "/times.txt", times);
  }

  /// A drive of KITTI raw with the calibration of its day beside it, images as they come; times
  /// are 0.1 s apart, and the right camera's images arrive 8 ms later.
  void write_kitti_raw(const std::string& day, int frames) const {
    std::string calibration;
    for (const std::string number : {"00", "01"}) {
      calibration += "S_" + number + ": 64 48\nK_" + number + ": 50 0 31.5 0 50 23.5 0 0 1\nD_" +
                     number + ": -0.1 0 0 0 0\nR_" + number + ": 1 0 0 0 1 0 0 0 1\nT_" + number +
                     (number == "00" ? ": 0 0 0\n" : ": -0.1 0 0\n") + "S_rect_" + number +
                     ": 60 40\nP_rect_" + number + ": 50 0 30 0 0 50 20 0 0 0 1 0\n";
      std::string times;
      for (int n = 0; n < frames; ++n) {
        const std::string folder = day + "/" + day + "_drive_0001_extract/image_" + number;
        write_image(folder + "/data/000000000" + std::to_string(n) + ".png",
                    (number == "00" ? 0 : 100) + n);
        times += "2011-09-26 23:59:59." + std::to_string(n) +
                 (number == "00" ? "00000000\n" : "08000000\n");
        write_text(folder + "/timestamps.txt", times);
      }
    }
    write_text(day + "/calib_cam_to_cam.txt", calibration);
  }

  /// EuRoC layout; the right camera is `skew_ns` late.
  void write_euroc(const std::string& root, int frames, std::int64_t skew_ns = 0) const {
    for (int camera = 0; camera < 2; ++camera) {
      const std::string base = root + "/mav0/cam" + std::to_string(camera);
      std::string csv = "#timestamp [ns],filename\n";
      for (int n = 0; n < frames; ++n) {
        const std::string stamp = std::to_string(euroc_stamp(n) + camera * skew_ns);
        csv += stamp + "," + stamp + ".png\n";
        write_image(base + "/data/" + stamp + ".png", 100 * camera + n);
      }
      write_text(base + "/data.csv", csv);
      write_text(base + "/sensor.yaml", sensor_yaml(camera == 0 ? 0.0 : 0.1));
    }
  }

  static std::int64_t euroc_stamp(int n) {
    return 1'403'636'584'763'555'584 + n * std::int64_t{50'000'000};
  }

  static std::string sensor_yaml(double x) {
    return "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1.0, 0.0, 0.0, " +
           std::to_string(x) +
           ",\n         0.0, 1.0, 0.0, 0.0,\n         0.0, 0.0, 1.0, 0.0,\n"
           "         0.0, 0.0, 0.0, 1.0]\nrate_hz: 20\nresolution: [64, 48]\n"
           "camera_model: pinhole\nintrinsics: [50.0, 50.0, 31.5, 23.5]\n"
           "distortion_model: radial-tangential\ndistortion_coefficients: [0.0, 0.0, 0.0, 0.0]\n";
  }

  /// Opens with the options and fails the test when that fails.
  static std::unique_ptr<DatasetSource> open(const DatasetOptions& options) {
    auto source = open_dataset(options);
    EXPECT_TRUE(source.ok()) << (source.ok() ? "" : source.error());
    return source.ok() ? std::move(*source) : nullptr;
  }

  static std::unique_ptr<DatasetSource> open(const std::string& path) {
    DatasetOptions options;
    options.path = path;
    return open(options);
  }

  static SourceResult next(DatasetSource* source) {
    return source->next(std::chrono::milliseconds(60'000));
  }

  std::filesystem::path folder_;
};

/// The first pixel of an image, of either depth.
inline int level_of(const SideImage& side) {
  if (!side.valid || !side.data || side.data->empty()) return -1;
  if (side.format == PixelFormat::kMono8) return side.data->at(0);
  return side.data->at(0) + 256 * side.data->at(1);
}

}  // namespace sovo
