#include "sovo/io/calibration.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "io/calibration_test_support.h"
#include "io/io_test_support.h"
#include "sovo/io/image_file.h"
#include "sovo/io/photometric_file.h"
#include "sovo/io/text.h"

namespace sovo {
namespace {

const std::string kKitti =
    "P0: 700 0 600 0 0 700 180 0 0 0 1 0\n"
    "P1: 700 0 600 -378 0 700 180 0 0 0 1 0\n"
    "P2: 700 0 600 45 0 700 180 0.1 0 0 1 0.006\n"
    "P3: 700 0 600 -333 0 700 180 1.9 0 0 1 0.003\n"
    "Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n";

const std::string kSensor =
    "sensor_type: camera\ncomment: made up\nT_BS:\n  cols: 4\n  rows: 4\n"
    "  data: [0, 0, 1, 0.1,\n   -1, 0, 0, TY,\n   0, -1, 0, 0.3,\n   0, 0, 0, 1]\nrate_hz: 20\n"
    "resolution: [640, 480]\ncamera_model: pinhole\nintrinsics: [400, 401, 320, 240] #fu\n"
    "distortion_model: radial-tangential\ndistortion_coefficients: [-0.3, 0.1, 0.001, -0.002]\n";

const std::string kKalibr =
    "cam0:\n  T_cam_imu:\n  - [0, -1, 0, 0.01]\n  - [0, 0, -1, 0.02]\n  - [1, 0, 0, 0.03]\n"
    "  - [0, 0, 0, 1]\n  camera_model: pinhole\n  distortion_coeffs: [0.01, -0.01, 0.006, -0.002]\n"
    "  distortion_model: equidistant\n  intrinsics: [190, 191, 254, 256]\n"
    "  resolution: [512, 512]\n  rostopic: /cam0\n"
    "cam1:\n  T_cn_cnm1:\n  - [1, 0, 0, -0.101]\n  - [0, 1, 0, 0.002]\n  - [0, 0, 1, 0.001]\n"
    "  - [0, 0, 0, 1]\n  camera_model: pinhole\n  distortion_coeffs: [-0.3, 0.1, 0.01, 0.02]\n"
    "  distortion_model: radtan\n  intrinsics: [189, 188, 252, 255]\n"
    "  resolution: [512, 510]\n";

std::string opencv_matrix(const std::string& name, int rows, int cols, const std::string& data) {
  return name + ": !!opencv-matrix\n   rows: " + std::to_string(rows) +
         "\n   cols: " + std::to_string(cols) + "\n   dt: d\n   data: [ " + data + " ]\n";
}

const std::string kOpencv =
    "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n" +
    opencv_matrix("M1", 3, 3, "400., 0., 320., 0., 401., 240., 0., 0., 1.") +
    opencv_matrix("D1", 1, 5, "-0.3, 0.1, 0.001, 0.002, 0.01") +
    opencv_matrix("M2", 3, 3, "410., 0., 321., 0., 411., 241., 0., 0., 1.") +
    opencv_matrix("D2", 8, 1, "-3e-1, 0.1, 0, 0, 0.01, 0.1, 0.2, 0.3") +
    opencv_matrix("R", 3, 3, "1, 0, 0, 0, 1, 0, 0, 0, 1") +
    opencv_matrix("T", 3, 1, "-0.06, 0.001, 0.002");

TEST(Calibration, SovoRoundTripIsExact) {
  const TemporaryFolder folder;
  const StereoRig rig = some_rig();
  const auto loaded =
      load_calibration(folder.write("calibration.yaml", format_sovo_calibration(rig)));
  ASSERT_TRUE(loaded) << loaded.error();
  EXPECT_EQ(loaded->rig.name, "bench");
  expect_same_camera(loaded->rig.left, rig.left);
  expect_same_camera(loaded->rig.right, rig.right);
  EXPECT_LT(distance(loaded->rig.T_right_left, rig.T_right_left), 1e-14);
  EXPECT_LT(distance(loaded->rig.T_base_left, rig.T_base_left), 1e-14);
}

TEST(Calibration, TheShippedExamplesLoad) {
  const auto folder = std::filesystem::path(__FILE__).parent_path() / "../../config/cameras";
  const auto loaded = load_calibration((folder / "example.yaml").string());
  ASSERT_TRUE(loaded) << loaded.error();
  EXPECT_DOUBLE_EQ(loaded->rig.baseline(), 0.11);
  const auto underwater = load_calibration((folder / "underwater.yaml").string());
  ASSERT_TRUE(underwater) << underwater.error();
  EXPECT_TRUE(underwater->rig.left.port && underwater->rig.right.port);
  EXPECT_NEAR(underwater->rig.baseline(), 0.18, 1e-3);
}

TEST(Calibration, RosRoundTrip) {
  const TemporaryFolder folder;
  const StereoRig rig = some_rig();
  const CameraInfoPair pair = format_ros_calibration(rig);
  const std::string left = folder.write("left.yaml", pair.left);
  const std::string right = folder.write("right.yaml", pair.right);
  for (const std::string& path : {left, right, folder / ""}) {
    const auto loaded = load_calibration(path);
    ASSERT_TRUE(loaded) << loaded.error();
    EXPECT_EQ(loaded->format, "ROS camera_info");
    EXPECT_EQ(loaded->rig.name, "bench");
    expect_same_camera(loaded->rig.left, rig.left);
    expect_same_camera(loaded->rig.right, rig.right);
    EXPECT_LT(distance(loaded->rig.T_right_left, rig.T_right_left), 1e-12);
  }
}

/// The 3x3 or 3x4 matrix of a camera_info text.
MatX matrix_of(const std::string& text, const std::string& key, int cols) {
  const std::size_t begin = text.find('[', text.find(key));
  const std::string data = text.substr(begin + 1, text.find(']', begin) - begin - 1);
  const auto numbers = split(data, ", ");
  MatX m(3, cols);
  for (int i = 0; i < 3 * cols; ++i) {
    m(i / cols, i % cols) = *parse_double(numbers[static_cast<std::size_t>(i)]);
  }
  return m;
}

TEST(Calibration, RosRectificationHasEqualRowsAndDisparityOfDepth) {
  const StereoRig rig = some_rig();
  const CameraInfoPair pair = format_ros_calibration(rig);
  const MatX r_left = matrix_of(pair.left, "rectification", 3);
  const MatX r_right = matrix_of(pair.right, "rectification", 3);
  const MatX p_left = matrix_of(pair.left, "projection", 4);
  const MatX p_right = matrix_of(pair.right, "projection", 4);
  EXPECT_LT((r_left * r_left.transpose() - Mat3::Identity()).norm(), 1e-12);
  EXPECT_GT(r_left.determinant(), 0.0);
  EXPECT_GT(r_left(2, 2), 0.99);
  for (const Vec3& point : {Vec3(0.3, -0.2, 2.0), Vec3(-1.0, 0.5, 5.0), Vec3(0.0, 0.0, 50.0)}) {
    const Vec3 rectified = r_left * point;
    Vec4 h;
    h << rectified, 1.0;
    const Vec3 left = p_left * h;
    const Vec3 right = p_right * h;
    const Vec3 direct = r_right * (rig.T_right_left * point);
    EXPECT_NEAR(left.y() / left.z(), right.y() / right.z(), 1e-9);
    EXPECT_NEAR(p_left(0, 0) * direct.x() / direct.z() + p_left(0, 2), right.x() / right.z(), 1e-9);
    EXPECT_NEAR(p_left(1, 1) * direct.y() / direct.z() + p_left(1, 2), right.y() / right.z(), 1e-9);
    const double disparity = left.x() / left.z() - right.x() / right.z();
    EXPECT_NEAR(disparity, p_left(0, 0) * rig.baseline() / rectified.z(), 1e-9);
  }
}

TEST(Calibration, KittiGreyAndColour) {
  const TemporaryFolder folder;
  CalibrationOptions options;
  options.image_width = 1226;
  options.image_height = 370;
  const std::string path = folder.write("calib.txt", kKitti);
  const auto grey = load_calibration(path, options);
  ASSERT_TRUE(grey) << grey.error();
  EXPECT_EQ(grey->rig.left.width, 1226);
  EXPECT_EQ(grey->rig.right.fx, 700.0);
  EXPECT_EQ(grey->rig.left.distortion, Distortion::kNone);
  EXPECT_LT((grey->rig.T_right_left.translation() - Vec3(-0.54, 0, 0)).norm(), 1e-12);
  options.kitti_colour = true;
  const auto colour = load_calibration(folder / "", options);
  ASSERT_TRUE(colour) << colour.error();
  const Vec3 t = colour->rig.T_right_left.translation();
  EXPECT_NEAR(t.x(), (-333.0 - 600.0 * 0.003 - (45.0 - 600.0 * 0.006)) / 700.0, 1e-12);
  EXPECT_NEAR(t.z(), -0.003, 1e-12);
}

TEST(Calibration, KittiTakesItsImageSizeFromTheFirstImage) {
  const TemporaryFolder folder;
  folder.write("calib.txt", kKitti);
  EXPECT_TRUE(contains(load_error(folder / "calib.txt"), "image size is not known"));
  std::filesystem::create_directories(folder / "image_0");
  std::filesystem::create_directories(folder / "image_1");
  const GreyImage image{1226, 370, PixelFormat::kMono8, std::vector<std::uint8_t>(1226 * 370)};
  ASSERT_TRUE(write_png(folder / "image_0/000000.png", image));
  ASSERT_TRUE(write_png(folder / "image_1/000000.png", image));
  const auto loaded = load_calibration(folder / "");
  ASSERT_TRUE(loaded) << loaded.error();
  EXPECT_EQ(loaded->rig.left.width, 1226);
  EXPECT_EQ(loaded->rig.right.height, 370);
}

TEST(Calibration, KittiErrorsNameTheNumber) {
  const TemporaryFolder folder;
  EXPECT_TRUE(contains(load_error(folder.write("a.txt", with(kKitti, "-378", "nan"))),
                       "a.txt:2: P1: number 4 must be a finite number, not 'nan'"));
  EXPECT_TRUE(contains(load_error(folder.write("b.txt", with(kKitti, " 180 0 0 0 1 0", ""))),
                       "b.txt:1: P0 has 6 numbers; 12"));
  EXPECT_TRUE(
      contains(load_error(folder.write("c.txt", with(kKitti, "P1", "Q1"))), "P1 is missing"));
}

TEST(Calibration, EurocKeepsTheBodyFrame) {
  const TemporaryFolder folder;
  folder.write("mav0/cam0/sensor.yaml", with(kSensor, "TY", "0.05"));
  folder.write("mav0/cam1/sensor.yaml", with(kSensor, "TY", "-0.06"));
  for (const std::string& path : {folder / "", folder / "mav0", folder / "mav0/cam0/sensor.yaml"}) {
    const auto loaded = load_calibration(path);
    ASSERT_TRUE(loaded) << loaded.error();
    EXPECT_EQ(loaded->rig.left.num_coefficients, 4);
    EXPECT_EQ(loaded->rig.left.d[3], -0.002);
    EXPECT_LT((loaded->rig.T_right_left.translation() - Vec3(-0.11, 0, 0)).norm(), 1e-12);
    EXPECT_LT((loaded->rig.T_base_left.translation() - Vec3(0.1, 0.05, 0.3)).norm(), 1e-12);
  }
  folder.write("mav0/cam1/sensor.yaml", with(kSensor, "TY", ".nan"));
  EXPECT_TRUE(contains(load_error(folder / ""), "'T_BS.data' must hold finite numbers"));
  folder.write("mav0/cam1/sensor.yaml", with(kSensor, "intrinsics", "intrinsic"));
  EXPECT_TRUE(contains(load_error(folder / ""), "'intrinsics' is missing"));
  std::filesystem::remove(folder / "mav0/cam1/sensor.yaml");
  EXPECT_TRUE(contains(load_error(folder / ""), "cam1/sensor.yaml"));
}

TEST(Calibration, KalibrWithDifferentCameras) {
  const TemporaryFolder folder;
  const auto loaded = load_calibration(folder.write("camchain.yaml", kKalibr));
  ASSERT_TRUE(loaded) << loaded.error();
  EXPECT_EQ(loaded->rig.left.distortion, Distortion::kEquidistant);
  EXPECT_EQ(loaded->rig.right.distortion, Distortion::kRadtan);
  EXPECT_EQ(loaded->rig.right.height, 510);
  EXPECT_EQ(loaded->rig.T_right_left.translation(), Vec3(-0.101, 0.002, 0.001));
  EXPECT_LT((loaded->rig.T_base_left.inverse().translation() - Vec3(0.01, 0.02, 0.03)).norm(),
            1e-12);
  EXPECT_TRUE(contains(load_error(folder.write("a.yaml", with(kKalibr, "pinhole", "omni"))),
                       "a.yaml:7: 'cam0.camera_model' is 'omni'"));
  EXPECT_TRUE(
      contains(load_error(folder.write("b.yaml", with(kKalibr, "[1, 0, 0, -", "[2, 0, 0, -"))),
               "'cam1.T_cn_cnm1' is no rigid motion"))
      << load_error(folder / "b.yaml");
  EXPECT_TRUE(contains(load_error(folder.write("c.yaml", with(kKalibr, "radtan", "fov"))),
                       "distortion model 'fov'"));
}

TEST(Calibration, OpencvWithFiveAndEightCoefficients) {
  const TemporaryFolder folder;
  const auto loaded = load_calibration(folder.write("stereo.yaml", kOpencv));
  ASSERT_TRUE(loaded) << loaded.error();
  EXPECT_EQ(loaded->rig.left.num_coefficients, 5);
  EXPECT_EQ(loaded->rig.right.num_coefficients, 8);
  EXPECT_EQ(loaded->rig.right.d[7], 0.3);
  EXPECT_EQ(loaded->rig.right.fy, 411.0);
  EXPECT_EQ(loaded->rig.T_right_left.translation(), Vec3(-0.06, 0.001, 0.002));
  const std::string millimetres = with(kOpencv, "-0.06, 0.001, 0.002", "-60, 1, 2");
  EXPECT_TRUE(contains(load_error(folder.write("a.yaml", millimetres)), "looks like millimetres"));
  CalibrationOptions options;
  options.validate = false;
  EXPECT_EQ(load_error(folder / "a.yaml", options), "");
  const std::string swapped = with(kOpencv, "-0.06, 0.001, 0.002", "0.06, 0.001, 0.002");
  EXPECT_TRUE(contains(load_error(folder.write("b.yaml", swapped)), "look swapped"));
  EXPECT_TRUE(contains(load_error(folder.write("c.yaml", with(kOpencv, "-0.3, ", ""))),
                       "D1' has 4 numbers, not rows x cols"))
      << load_error(folder / "c.yaml");
}

TEST(Calibration, SovoErrorsNameLineAndField) {
  const TemporaryFolder folder;
  const std::string text = format_sovo_calibration(some_rig());
  const auto error = [&](const std::string& from, const std::string& to) {
    return load_error(folder.write("s.yaml", with(text, from, to)));
  };
  EXPECT_TRUE(contains(error("fx: 402.5", "fx: nan"), "s.yaml:6: 'left.fx' must be a number"));
  EXPECT_TRUE(contains(error("fx:", "fxx:"), "did you mean 'fx'?"));
  EXPECT_TRUE(contains(error("fx: 402.5", "fx: -402.5"), "left camera: the focal length"));
  EXPECT_TRUE(contains(error("cx: 322", "cx: 3220"), "left camera: the principal point"));
  EXPECT_TRUE(contains(error("width: 640", "width: 0"), "left camera: the image size"));
  EXPECT_TRUE(contains(error("T_right_left: [", "T_right_left: [5, "), "13 numbers"));
  EXPECT_TRUE(contains(error("T_right_left: [0.9", "T_right_left: [1.9"), "orthonormal"));
  EXPECT_TRUE(contains(error("calibration: 1", "calibration: 2"), "version 2"));
  EXPECT_TRUE(contains(error("radtan", "fov"), "s.yaml:"));
  EXPECT_TRUE(contains(error("mask: \"\"", "mask: \"none.png\""), "none.png"));
}

TEST(Calibration, UnknownThingsAreNamed) {
  const TemporaryFolder folder;
  EXPECT_TRUE(contains(load_error(folder / "missing"), "no such file"));
  EXPECT_TRUE(contains(load_error(folder / ""), "has no calibration"));
  EXPECT_TRUE(
      contains(load_error(folder.write("a.yaml", "x: 1\n")), "no calibration that is known"));
  EXPECT_TRUE(contains(load_error(folder.write("b.yaml", "")), "is empty"));
  EXPECT_TRUE(contains(load_error(folder.write("c.yaml", "hello\n")), "is no calibration"));
  EXPECT_TRUE(
      contains(load_error(folder.write("left.yaml", format_ros_calibration(some_rig()).left)),
               "right.yaml"));
}

TEST(RigCheck, NamesWhatCannotBe) {
  EXPECT_TRUE(check_rig(some_rig()).empty());
  StereoRig rig = some_rig();
  rig.T_right_left.translation().setZero();
  ASSERT_EQ(check_rig(rig).size(), 1U);
  EXPECT_TRUE(contains(check_rig(rig)[0], "baseline is 0"));
  rig = some_rig();
  rig.T_right_left.translation() *= 1000.0;
  ASSERT_EQ(check_rig(rig).size(), 1U);
  EXPECT_TRUE(contains(check_rig(rig)[0], "millimetres"));
  rig = some_rig();
  rig.T_right_left = rig.T_right_left.inverse();
  ASSERT_EQ(check_rig(rig).size(), 1U);
  EXPECT_TRUE(contains(check_rig(rig)[0], "swapped"));
  rig = some_rig();
  rig.right.d[2] = std::numeric_limits<double>::quiet_NaN();
  rig.T_right_left.translation().x() = std::numeric_limits<double>::infinity();
  ASSERT_EQ(check_rig(rig).size(), 2U);
  EXPECT_TRUE(contains(check_rig(rig)[0], "right camera"));
}

GreyImage grey16(int width, int height, std::uint16_t value) {
  GreyImage image{width, height, PixelFormat::kMono16, {}};
  for (int i = 0; i < width * height; ++i) {
    image.data.push_back(static_cast<std::uint8_t>(value & 255U));
    image.data.push_back(static_cast<std::uint8_t>(value >> 8U));
  }
  return image;
}

TEST(PhotometricFile, ResponseVignetteMaskAndTimes) {
  const TemporaryFolder folder;
  std::string response;
  for (int i = 0; i < 256; ++i) response += format_double(2.0 * i + 10.0) + " ";
  const auto values = read_response(folder.write("pcalib.txt", response));
  ASSERT_TRUE(values) << values.error();
  EXPECT_FLOAT_EQ((*values)[0], 0.0F);
  EXPECT_FLOAT_EQ((*values)[100], 100.0F);
  EXPECT_FLOAT_EQ((*values)[255], 255.0F);
  EXPECT_TRUE(contains(read_response(folder.write("b", "1 2 3\n")).error(), "has 3 values"));
  EXPECT_TRUE(contains(read_response(folder.write("c", "1 2 2\n")).error(), "c:1: value 3 is not"));

  GreyImage image = grey16(4, 3, 40000);
  image.data[0] = image.data[1] = 0;
  image.data[2] = 20000 & 255;
  image.data[3] = 20000 >> 8;
  ASSERT_TRUE(write_png(folder / "vignette.png", image));
  ImageU8 mask;
  const auto vignette = read_vignette(folder / "vignette.png", 4, 3, &mask);
  ASSERT_TRUE(vignette) << vignette.error();
  EXPECT_EQ(vignette->at(0, 0), 1.0F);
  EXPECT_EQ(vignette->at(1, 0), 0.5F);
  EXPECT_EQ(vignette->at(2, 2), 1.0F);
  EXPECT_EQ(mask.at(0, 0), 0);
  EXPECT_EQ(mask.at(1, 0), 255);
  EXPECT_TRUE(contains(read_vignette(folder / "vignette.png", 5, 3, &mask).error(), "is 4x3, but"));
  EXPECT_EQ(read_mask(folder / "vignette.png", 4, 3)->at(0, 0), 0);

  const auto times = read_exposure_times(
      folder.write("times.txt", "# id t ms\n100 1520530308.199447626 1.5\n101 1520530308.25\n"));
  ASSERT_TRUE(times) << times.error();
  ASSERT_EQ(times->size(), 2U);
  EXPECT_EQ((*times)[0].stamp_ns, 1520530308199447626);
  EXPECT_DOUBLE_EQ((*times)[0].exposure_s, 0.0015);
  EXPECT_EQ((*times)[1].exposure_s, 0.0);
  EXPECT_TRUE(contains(read_exposure_times(folder.write("t", "1 2 x\n")).error(), "t:1: the exp"));
}

TEST(Calibration, MasksAndPhotometricFilesBesideOurYaml) {
  const TemporaryFolder folder;
  StereoRig rig = some_rig();
  std::string text = format_sovo_calibration(rig);
  text = with(text, "vignette: \"\"", "vignette: \"v.png\"");
  folder.write("calibration.yaml", text);
  ASSERT_TRUE(write_png(folder / "v.png", grey16(640, 480, 500)));
  ASSERT_TRUE(write_png(folder / "mask_right.png", grey16(656, 492, 0)));
  const auto loaded = load_calibration(folder / "");
  ASSERT_TRUE(loaded) << loaded.error();
  EXPECT_EQ(loaded->left_photometric.vignette.width(), 640);
  EXPECT_TRUE(loaded->right_photometric.empty());
  EXPECT_TRUE(loaded->left_mask.empty());
  EXPECT_EQ(loaded->right_mask.at(0, 0), 0);
}

TEST(Calibration, SurvivesTruncatedAndRandomFiles) {
  const TemporaryFolder folder;
  const CameraInfoPair pair = format_ros_calibration(some_rig());
  folder.write("right.yaml", pair.right);
  std::mt19937 random(3);
  for (const std::string& text :
       {kKitti, kKalibr, kOpencv, pair.left, format_sovo_calibration(some_rig()),
        format_sovo_calibration(rig_behind_ports())}) {
    for (int i = 0; i < 100; ++i) {
      std::string noisy = i % 2 == 0 ? text.substr(0, random() % text.size()) : text;
      for (int k = 0; k < 3 * (i % 2) && !noisy.empty(); ++k) {
        noisy[random() % noisy.size()] = static_cast<char>(random() % 256);
      }
      const auto loaded = load_calibration(folder.write("left.yaml", noisy));
      if (loaded) {
        EXPECT_TRUE(check_rig(loaded->rig).empty());
      } else {
        EXPECT_FALSE(loaded.error().empty());
      }
    }
  }
}

TEST(Calibration, ReadsRealFiles) {
  const std::string euroc = shared_data("euroc/MH_01_head");
  const std::string kitti = shared_data("kitti/sequences/06");
  const std::string colour = shared_data("kitti/sequences/02");
  const std::string tumvi = shared_data("tumvi/room1_head");
  if (euroc.empty() || kitti.empty() || colour.empty() || tumvi.empty()) {
    GTEST_SKIP() << "no real clips at ../shared/data or $SOVO_SHARED/data";
  }
  const auto a = load_calibration(euroc);
  ASSERT_TRUE(a) << a.error();
  EXPECT_NEAR(a->rig.baseline(), 0.1101, 1e-4);
  const auto b = load_calibration(kitti);
  ASSERT_TRUE(b) << b.error();
  EXPECT_NEAR(b->rig.baseline(), 0.5372, 1e-4);
  const auto c = load_calibration(colour);
  ASSERT_TRUE(c) << c.error();
  EXPECT_NEAR(c->rig.baseline(), 0.5333, 1e-4);
  const auto d = load_calibration(tumvi);
  ASSERT_TRUE(d) << d.error();
  EXPECT_EQ(d->rig.left.distortion, Distortion::kEquidistant);
  EXPECT_EQ(d->left_photometric.inverse_response.size(), 256U);
  EXPECT_EQ(d->left_photometric.vignette.width(), 512);
  const auto e = load_calibration(tumvi + "/dso/camchain.yaml");
  ASSERT_TRUE(e) << e.error();
  EXPECT_LT(distance(e->rig.T_right_left, d->rig.T_right_left), 1e-6);
  EXPECT_LT(distance(e->rig.T_base_left, d->rig.T_base_left), 1e-6);
  const auto times = read_exposure_times(tumvi + "/dso/cam0/times.txt");
  ASSERT_TRUE(times) << times.error();
  EXPECT_NEAR(times->front().exposure_s, 1.462315e-3, 1e-9);
}

}  // namespace
}  // namespace sovo
