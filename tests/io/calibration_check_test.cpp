#include "sovo/io/calibration_check.h"

#include <gtest/gtest.h>

#include "io/io_test_support.h"
#include "sovo/io/calibration.h"
#include "sovo/io/image_file.h"
#include "support/cameras.h"
#include "support/synthetic_scene.h"

namespace sovo {
namespace {

StereoRig checked_rig() {
  StereoRig rig;
  rig.left = test::make_camera(320, 240, 200.0, 201.0, 158.0, 121.0, Distortion::kRadtan,
                               {-0.2, 0.05, 1e-4, -1e-4});
  rig.right = test::make_camera(320, 240, 203.0, 202.0, 161.0, 119.0, Distortion::kRadtan,
                                {-0.21, 0.06, 0.0, 1e-4});
  rig.T_right_left = SE3(SO3::exp(Vec3(0.01, -0.02, 0.005)), Vec3(-0.12, 0.002, -0.001));
  return rig;
}

/// What the rig's cameras see.
std::vector<ImagePair> render(const StereoRig& rig) {
  const test::SyntheticScene scene(5);
  std::vector<ImagePair> pairs(1);
  pairs[0].left = scene.render(rig.left, SE3());
  pairs[0].right = scene.render(rig.right, rig.T_right_left.inverse());
  return pairs;
}

/// The views of `checked_rig`.
const std::vector<ImagePair>& views() {
  static const std::vector<ImagePair> pairs = render(checked_rig());
  return pairs;
}

bool has(const CalibrationReport& report, CalibrationFault fault) {
  return report.findings.size() == 1 && report.findings[0].fault == fault;
}

std::string text_of(const CalibrationReport& report) {
  std::string text = std::to_string(report.matches) + "/" + std::to_string(report.points) +
                     " exchanged " + std::to_string(report.exchanged_matches) + " depth " +
                     std::to_string(report.median_depth) + " across " +
                     std::to_string(report.median_abs_across_px);
  for (const auto& finding : report.findings) text += "\n" + finding.message;
  return text;
}

TEST(CalibrationCheck, GoodCalibrationHasNoFindings) {
  const auto report = check_calibration_on_images(checked_rig(), views());
  EXPECT_TRUE(report.findings.empty()) << text_of(report);
  EXPECT_GT(report.matches, report.points / 2) << text_of(report);
  EXPECT_GT(report.median_depth, 1.0);
  EXPECT_LT(report.median_depth, 8.0);
  EXPECT_LT(report.median_abs_across_px, 0.2);
}

TEST(CalibrationCheck, NamesExchangedImages) {
  auto pairs = views();
  std::swap(pairs[0].left, pairs[0].right);
  const auto report = check_calibration_on_images(checked_rig(), pairs);
  EXPECT_TRUE(has(report, CalibrationFault::kSwapped)) << text_of(report);
}

TEST(CalibrationCheck, NamesMillimetres) {
  StereoRig rig = checked_rig();
  rig.T_right_left.translation() *= 1000.0;
  auto report = check_calibration_on_images(rig, views());
  EXPECT_TRUE(has(report, CalibrationFault::kInvalid)) << text_of(report);
  EXPECT_TRUE(contains(text_of(report), "millimetres"));
  // A baseline of a few millimetres is still possible as metres: the depths tell.
  StereoRig small = checked_rig();
  small.T_right_left.translation() *= 0.05;
  const auto pairs = render(small);
  rig.T_right_left.translation() = small.T_right_left.translation() * 1000.0;
  report = check_calibration_on_images(rig, pairs);
  EXPECT_TRUE(has(report, CalibrationFault::kScale)) << text_of(report);
}

TEST(CalibrationCheck, NamesSmallAndLargeDecalibration) {
  const auto pairs = views();
  for (const double offset_px : {-2.0, 2.5, 12.0, -20.0}) {
    StereoRig rig = checked_rig();
    const SE3 turn(SO3::exp(Vec3(offset_px / rig.right.fy, 0.0, 0.0)), Vec3::Zero());
    rig.T_right_left = turn * rig.T_right_left;
    const auto report = check_calibration_on_images(rig, pairs);
    EXPECT_TRUE(has(report, CalibrationFault::kDecalibrated))
        << offset_px << ": " << text_of(report);
  }
}

TEST(CalibrationCheck, NamesImagesThatCannotBeUsed) {
  auto pairs = views();
  pairs[0].right.fill(30.0F);
  EXPECT_TRUE(has(check_calibration_on_images(checked_rig(), pairs), CalibrationFault::kUnmatched));
  pairs[0].left.fill(0.0F);
  EXPECT_TRUE(
      has(check_calibration_on_images(checked_rig(), pairs), CalibrationFault::kLittleTexture));
  pairs[0].left.resize(100, 100);
  EXPECT_TRUE(has(check_calibration_on_images(checked_rig(), pairs), CalibrationFault::kImageSize));
}

ImageF float_image(const std::string& path) {
  const auto grey = read_grey_image(path);
  EXPECT_TRUE(grey) << grey.error();
  ImageF image(grey->width, grey->height);
  for (std::size_t i = 0; i < image.size(); ++i) image.data()[i] = grey->data[i];
  return image;
}

TEST(CalibrationCheck, RealClipsAreWellCalibrated) {
  const std::string euroc = shared_data("euroc/MH_01_head");
  const std::string kitti = shared_data("kitti/sequences/06");
  if (euroc.empty() || kitti.empty()) {
    GTEST_SKIP() << "no real clips at ../shared/data or $SOVO_SHARED/data";
  }
  const std::vector<std::pair<std::string, std::array<std::string, 2>>> clips = {
      {euroc,
       {"/mav0/cam0/data/1403636584763555584.png", "/mav0/cam1/data/1403636584763555584.png"}},
      {kitti, {"/image_0/000000.png", "/image_1/000000.png"}}};
  for (const auto& [folder, names] : clips) {
    const auto calibration = load_calibration(folder);
    ASSERT_TRUE(calibration) << calibration.error();
    std::vector<ImagePair> pairs(1);
    pairs[0] = {float_image(folder + names[0]), float_image(folder + names[1])};
    const auto good = check_calibration_on_images(calibration->rig, pairs);
    EXPECT_TRUE(good.findings.empty()) << text_of(good);
    std::swap(pairs[0].left, pairs[0].right);
    const auto exchanged = check_calibration_on_images(calibration->rig, pairs);
    EXPECT_TRUE(has(exchanged, CalibrationFault::kSwapped)) << text_of(exchanged);
  }
}

}  // namespace
}  // namespace sovo
