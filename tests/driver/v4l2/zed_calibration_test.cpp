#include <gtest/gtest.h>

#include <random>

#include "io/io_test_support.h"
#include "sovo/driver/sim/sim_source.h"
#include "sovo/io/calibration.h"
#include "sovo/io/calibration_check.h"

namespace sovo {
namespace {

// As Stereolabs write it: lengths in millimetres, TY and TZ without a resolution, CV about y.
const char* const kConf = R"([LEFT_CAM_2K]
fx=1400.1
fy=1400.2
cx=1104
cy=621
k1=-0.17
k2=0.027

[RIGHT_CAM_2K]
fx=1400.1
fy=1400.2
cx=1104
cy=621
k1=-0.17
k2=0.027

[LEFT_CAM_VGA]
fx=350.5
fy=351.25
cx=330.5
cy=190.25
k1=-0.174
k2=0.0275
p1=0.0003
p2=-0.0002
k3=0.001

[RIGHT_CAM_VGA]
fx=352.0
fy=352.5
cx=339.0
cy=186.0
k1=-0.171
k2=0.026
p1=0.0
p2=0.0001
k3=0.0

[STEREO]
Baseline=120.0
TY=0.9
TZ=-0.6
CV_2K=0.1
CV_VGA=0.012
RX_2K=0.2
RX_VGA=0.004
RZ_2K=0.3
RZ_VGA=-0.003

[MISC]
Sensor_ID=0
)";

CalibrationOptions vga() {
  CalibrationOptions options;
  options.image_width = 672;
  options.image_height = 376;
  return options;
}

/// The cameras of the file, from the meaning of its words: the right one 12 cm to the right.
StereoRig true_rig() {
  StereoRig rig;
  rig.left = {672,
              376,
              350.5,
              351.25,
              330.5,
              190.25,
              Distortion::kRadtan,
              {-0.174, 0.0275, 0.0003, -0.0002, 0.001},
              5};
  rig.right = {
      672, 376, 352.0, 352.5, 339.0, 186.0, Distortion::kRadtan, {-0.171, 0.026, 0.0, 0.0001, 0.0},
      5};
  rig.T_right_left = SE3(SO3::exp(Vec3(0.004, 0.012, -0.003)), Vec3(-0.12, -0.0009, 0.0006));
  return rig;
}

std::vector<ImagePair> render(const StereoRig& rig) {
  sim::SimConfig config;
  config.world = sim::World::kHall;
  config.frames = 1;
  config.sensor.motion_blur = false;
  Calibration calibration;
  calibration.rig = rig;
  sim::SimSource source(config, calibration, sim::own_motion(config.world));
  const SourceResult result = source.next(std::chrono::seconds(240));
  EXPECT_EQ(result.state, SourceState::kFrame) << result.message;
  const auto to_float = [](const SideImage& side) {
    ImageF image(side.width, side.height);
    for (int y = 0; y < side.height; ++y) {
      for (int x = 0; x < side.width; ++x) image.at(x, y) = (*side.data)[y * side.step + x];
    }
    return image;
  };
  std::vector<ImagePair> pairs(1);
  pairs[0] = {to_float(result.frame.left), to_float(result.frame.right)};
  return pairs;
}

TEST(ZedCalibration, FitsTheViewsOfCamerasThatStandAsItSays) {
  const TemporaryFolder folder;
  const auto loaded = load_calibration(folder.write("SN1.conf", kConf), vga());
  ASSERT_TRUE(loaded) << loaded.error();
  const auto pairs = render(true_rig());
  const auto report = check_calibration_on_images(loaded->rig, pairs);
  EXPECT_TRUE(report.findings.empty()) << report.findings.at(0).message;
  EXPECT_GT(report.matches, report.points / 3);
  EXPECT_LT(report.median_abs_across_px, 0.3);
  // The other sign would put the cameras the other way round.
  StereoRig wrong = loaded->rig;
  wrong.T_right_left = SE3(wrong.T_right_left.rotation(), -wrong.T_right_left.translation());
  EXPECT_FALSE(check_calibration_on_images(wrong, pairs).findings.empty());
}

TEST(ZedCalibration, EveryResolutionHasItsOwnValues) {
  const TemporaryFolder folder;
  const std::string path = folder.write("SN1.conf", kConf);
  CalibrationOptions options;
  options.image_width = 2208;
  options.image_height = 1242;
  const auto large = load_calibration(path, options);
  ASSERT_TRUE(large) << large.error();
  EXPECT_EQ(large->rig.left.fx, 1400.1);
  EXPECT_NEAR(large->rig.T_right_left.rotation().log().y(), 0.1, 1e-12);
  EXPECT_NEAR(large->rig.T_right_left.translation().y(), -0.0009, 1e-12);
  options.image_width = 640;
  const auto unknown = load_calibration(path, options);
  ASSERT_FALSE(unknown);
  EXPECT_TRUE(contains(unknown.error(), "2208x1242, 672x376")) << unknown.error();
  EXPECT_FALSE(load_calibration(path, {}));
}

TEST(ZedCalibration, MutatedFilesAreReadOrRefusedWithAReason) {
  const TemporaryFolder folder;
  std::mt19937_64 random(5);
  int refused = 0;
  for (int n = 0; n < 300; ++n) {
    std::string text = kConf;
    for (int k = 0; k < 3; ++k) text[random() % text.size()] = static_cast<char>(random() % 128);
    if (n % 5 == 0) text.resize(random() % text.size());
    const auto loaded = load_calibration(folder.write("SN1.conf", text), vga());
    if (loaded) continue;
    ++refused;
    EXPECT_FALSE(loaded.error().empty());
  }
  EXPECT_GT(refused, 50);
}

}  // namespace
}  // namespace sovo
