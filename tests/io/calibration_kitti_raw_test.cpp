#include <gtest/gtest.h>

#include <filesystem>

#include "io/io_test_support.h"
#include "sovo/io/calibration.h"
#include "sovo/io/image_file.h"

namespace sovo {
namespace {

/// Made up in the form of a day of KITTI raw: cameras 1 and 3 turned, each pair of its own size.
const std::string kDay =
    "calib_time: 09-Jan-2012 13:57:47\ncorner_dist: 9.950000e-02\n"
    "S_00: 1.392000e+03 5.120000e+02\n"
    "K_00: 9.8e+02 0 6.9e+02 0 9.75e+02 2.5e+02 0 0 1\nD_00: -0.37 0.2 0.001 0.002 -0.07\n"
    "R_00: 1 0 0 0 1 0 0 0 1\nT_00: 2.5e-16 -4e-16 3e-16\n"
    "S_rect_00: 1.242000e+03 3.750000e+02\nR_rect_00: 1 0 0 0 1 0 0 0 1\n"
    "P_rect_00: 720 0 610 0 0 720 173 0 0 0 1 0\n"
    "S_01: 1.392000e+03 5.120000e+02\n"
    "K_01: 990 0 700 0 985 255 0 0 1\nD_01: -0.36 0.19 0.0003 -0.0006 -0.06\n"
    "R_01: 0.8 -0.6 0 0.6 0.8 0 0 0 1\nT_01: -0.537 0.006 -0.012\n"
    "S_rect_01: 1.242000e+03 3.750000e+02\nR_rect_01: 1 0 0 0 1 0 0 0 1\n"
    "P_rect_01: 720 0 610 -388.8 0 720 173 0 0 0 1 0\n"
    "S_02: 1000 500\nK_02: 960 0 694 0 955 240 0 0 1\nD_02: -0.36 0.2 0.001 0.0005 -0.07\n"
    "R_02: 0.8 0 0.6 0 1 0 -0.6 0 0.8\nT_02: 0.06 -0.001 0.0001\n"
    "S_rect_02: 1242 375\nP_rect_02: 720 0 610 45 0 720 173 0.2 0 0 1 0.003\n"
    "S_03: 1000 500\nK_03: 961 0 695 0 956 241 0 0 1\nD_03: -0.36 0.2 0.001 0.0005 -0.07\n"
    "R_03: 1 0 0 0 1 0 0 0 1\nT_03: -0.47 0.005 0.01\n"
    "S_rect_03: 1242 375\nP_rect_03: 720 0 610 -338 0 720 173 2.2 0 0 1 0.003\n";

class KittiRaw : public ::testing::Test {
 protected:
  /// `text` as the file of a day, for images of a size (0: not known).
  Result<Calibration> load(const std::string& text, int width = 0, int height = 0,
                           std::optional<bool> colour = {}) const {
    folder_.write("calib_cam_to_cam.txt", text);
    CalibrationOptions options;
    options.image_width = width;
    options.image_height = height;
    options.kitti_colour = colour;
    return load_calibration(folder_ / "", options);
  }

  /// What is wrong with the day when `from` is replaced.
  std::string error_with(const std::string& from, const std::string& to, int width = 0,
                         int height = 0) const {
    std::string text = kDay;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    const auto loaded = load(text.replace(at, from.size(), to), width, height);
    return loaded ? "" : loaded.error();
  }

  TemporaryFolder folder_;
};

TEST_F(KittiRaw, ImagesAsTheyComeHaveTheirLensesAndTheMotionBetweenThem) {
  for (const int width : {0, 1392}) {
    const auto loaded = load(kDay, width, width == 0 ? 0 : 512);
    ASSERT_TRUE(loaded) << loaded.error();
    const StereoRig& rig = loaded->rig;
    EXPECT_EQ(rig.left.width, 1392);
    EXPECT_EQ(rig.right.height, 512);
    EXPECT_EQ(rig.left.fx, 980.0);
    EXPECT_EQ(rig.left.fy, 975.0);
    EXPECT_EQ(rig.left.cx, 690.0);
    EXPECT_EQ(rig.left.cy, 250.0);
    EXPECT_EQ(rig.right.distortion, Distortion::kRadtan);
    EXPECT_EQ(rig.right.num_coefficients, 5);
    EXPECT_EQ(rig.right.d[3], -0.0006);
    EXPECT_EQ(rig.right.d[4], -0.06);
    // A point one metre ahead of the left camera, as the right one has it.
    const Vec3 seen = rig.T_right_left * Vec3(1, 2, 3);
    EXPECT_LT((seen - Vec3(0.8 - 1.2 - 0.537, 0.6 + 1.6 + 0.006, 3 - 0.012)).norm(), 1e-9);
  }
}

TEST_F(KittiRaw, ColourCamerasAreGivenAgainstCameraZero) {
  const auto loaded = load(kDay, 1000, 500, true);
  ASSERT_TRUE(loaded) << loaded.error();
  EXPECT_EQ(loaded->rig.left.fx, 960.0);
  const Vec3 in_first(0.3, -0.2, 4.0);
  const Vec3 in_left(0.8 * 0.3 + 0.6 * 4.0 + 0.06, -0.2 - 0.001, -0.6 * 0.3 + 0.8 * 4.0 + 0.0001);
  const Vec3 in_right = in_first + Vec3(-0.47, 0.005, 0.01);
  EXPECT_LT((loaded->rig.T_right_left * in_left - in_right).norm(), 1e-9);
}

TEST_F(KittiRaw, ImagesOfTheRectifiedSizeHaveNoDistortion) {
  const auto grey = load(kDay, 1242, 375);
  ASSERT_TRUE(grey) << grey.error();
  EXPECT_EQ(grey->rig.left.distortion, Distortion::kNone);
  EXPECT_EQ(grey->rig.left.fx, 720.0);
  EXPECT_LT((grey->rig.T_right_left.translation() - Vec3(-0.54, 0, 0)).norm(), 1e-12);
  const auto colour = load(kDay, 1242, 375, true);
  ASSERT_TRUE(colour) << colour.error();
  EXPECT_NEAR(colour->rig.baseline(), 383.0 / 720.0, 1e-4);
}

TEST_F(KittiRaw, ADriveHasTheCalibrationOfItsDayForTheSizeOfItsImages) {
  ASSERT_TRUE(load(kDay));
  const auto width_for = [&](const std::string& drive, int width, int height) {
    const std::string images = folder_ / drive + "/image_00/data";
    std::filesystem::create_directories(images);
    const auto bytes = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    const GreyImage image{width, height, PixelFormat::kMono8, std::vector<std::uint8_t>(bytes)};
    EXPECT_TRUE(write_png(images + "/0000000000.png", image));
    const auto loaded = load_calibration(folder_ / drive);
    EXPECT_TRUE(loaded) << loaded.error();
    return loaded ? loaded->rig.left.width : 0;
  };
  EXPECT_EQ(width_for("drive_extract", 1392, 512), 1392);
  EXPECT_EQ(width_for("drive_sync", 1242, 375), 1242);
  std::filesystem::create_directories(folder_ / "no_drive");
  EXPECT_TRUE(contains(load_calibration(folder_ / "no_drive").error(), "has no calibration"));
}

TEST_F(KittiRaw, ErrorsNameTheLineAndWhatIsWanted) {
  EXPECT_TRUE(contains(error_with("", "", 640, 480),
                       "is for images of 1392x512 as they come, or 1242x375 rectified, not of "
                       "640x480"));
  EXPECT_TRUE(contains(error_with("D_00: -0.37", "D_00:"), ":5: D_00 has 4 numbers; 5"));
  EXPECT_TRUE(contains(error_with("T_01: -0.537", "T_01: inf"),
                       ":15: T_01: number 1 must be a finite number, not 'inf'"));
  EXPECT_TRUE(contains(error_with("K_01", "L_01"), "K_01 is missing"));
  EXPECT_TRUE(contains(error_with("R_01: 0.8", "R_01: 0.9"), "R_01 is no rigid motion"));
  EXPECT_TRUE(contains(error_with("P_rect_01", "P_01", 1242, 375), "P_rect_01 is missing"));
  for (const std::string wrong : {"-5", "0", "1e30", "1392.5"}) {
    EXPECT_TRUE(contains(error_with("S_00: 1.392000e+03", "S_00: " + wrong),
                         ": S_00 must be a width and a height in pixels"));
  }
}

TEST_F(KittiRaw, ATornFileIsRefusedOrWhole) {
  for (std::size_t length = 0; length < kDay.size(); length += 7) {
    const auto loaded = load(kDay.substr(0, length));
    if (loaded) {
      EXPECT_GT(length, kDay.find("T_01: -0.537 0.006"));
    } else {
      EXPECT_FALSE(loaded.error().empty());
    }
  }
}

}  // namespace
}  // namespace sovo
