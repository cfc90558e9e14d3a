// Writes a rendered stereo sequence in the EuRoC ASL layout, with its true trajectory:
//     make_synthetic_dataset FOLDER [FRAMES]

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "sovo/io/image_file.h"
#include "sovo/io/text.h"
#include "sovo/io/trajectory_file.h"
#include "support/cameras.h"
#include "support/synthetic_scene.h"

namespace {

using namespace sovo;

constexpr std::int64_t kFirstStamp = 1700000000000000000;
constexpr std::int64_t kPeriod = 50000000;
constexpr double kBaseline = 0.11;

struct Side {
  std::string name;
  CameraModel camera;
  SE3 T_left_this;
};

std::array<Side, 2> sides() {
  const auto left = test::make_camera(320, 240, 210.0, 209.0, 158.6, 121.3, Distortion::kRadtan,
                                      {-0.05, 0.01, 0.0002, -0.0001});
  const auto right = test::make_camera(320, 240, 207.0, 206.0, 161.2, 118.4, Distortion::kRadtan,
                                       {-0.04, 0.008, -0.0001, 0.0002});
  const SE3 T_left_right(SO3::exp(Vec3(0.004, -0.006, 0.003)), Vec3(kBaseline, 0.001, -0.002));
  return {Side{"cam0", left, SE3()}, Side{"cam1", right, T_left_right}};
}

/// Sideways and forwards through the room, with a little rotation.
SE3 pose_at(int frame) {
  const double t = 0.05 * frame;
  const Vec3 position(0.35 * t - 0.35, 0.05 * std::sin(1.5 * t), 0.15 * t - 1.2);
  const Vec3 rotation(0.02 * std::sin(1.1 * t), 0.05 * std::sin(0.9 * t), 0.02 * std::sin(0.7 * t));
  return {SO3::exp(rotation), position};
}

std::string sensor_yaml(const Side& side) {
  const CameraModel& c = side.camera;
  std::string text = "sensor_type: camera\ncomment: rendered\nT_BS:\n  cols: 4\n  rows: 4\n";
  const Mat3 rotation = side.T_left_this.rotation().matrix();
  text += "  data: [";
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) text += format_double(rotation(row, column)) + ", ";
    text += format_double(side.T_left_this.translation()[row]) + ",\n         ";
  }
  text += "0.0, 0.0, 0.0, 1.0]\nrate_hz: 20\n";
  text += "resolution: [" + std::to_string(c.width) + ", " + std::to_string(c.height) + "]\n";
  text += "camera_model: pinhole\nintrinsics: [" + format_double(c.fx) + ", " +
          format_double(c.fy) + ", " + format_double(c.cx) + ", " + format_double(c.cy) + "]\n";
  text += "distortion_model: radial-tangential\ndistortion_coefficients: [";
  for (std::size_t i = 0; i < 4; ++i) text += (i == 0 ? "" : ", ") + format_double(c.d[i]);
  return text + "]\n";
}

Result<void> write_image(const test::SyntheticScene& scene, const Side& side, int frame,
                         const std::filesystem::path& file) {
  ImageF image = scene.render(side.camera, pose_at(frame) * side.T_left_this);
  test::add_noise(1.0, static_cast<unsigned>(2 * frame + (side.name == "cam1")), &image);
  const ImageU8 grey = test::quantized(image);
  GreyImage out{grey.width(), grey.height(), PixelFormat::kMono8, {}};
  out.data.assign(grey.data(), grey.data() + grey.size());
  return write_png(file.string(), out);
}

Result<void> write_side(const Side& side, int frames, const std::filesystem::path& root) {
  const test::SyntheticScene scene(7);
  const auto folder = root / "mav0" / side.name;
  std::filesystem::create_directories(folder / "data");
  if (auto done = write_text_file((folder / "sensor.yaml").string(), sensor_yaml(side)); !done) {
    return done;
  }
  std::string csv = "#timestamp [ns],filename\n";
  for (int i = 0; i < frames; ++i) {
    const std::string stamp = std::to_string(kFirstStamp + i * kPeriod);
    csv += stamp + "," + stamp + ".png\n";
    auto done = write_image(scene, side, i, folder / "data" / (stamp + ".png"));
    if (!done) return done;
  }
  return write_text_file((folder / "data.csv").string(), csv);
}

Result<void> write_truth(int frames, const std::filesystem::path& root) {
  Trajectory truth;
  for (int i = 0; i < frames; ++i) truth.push_back({kFirstStamp + i * kPeriod, pose_at(i)});
  return write_tum((root / "groundtruth_cam0_tum.txt").string(), truth);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << "usage: make_synthetic_dataset FOLDER [FRAMES]\n";
    return 2;
  }
  const std::filesystem::path root(argv[1]);
  const int frames = argc > 2 ? std::atoi(argv[2]) : 40;
  const auto both = sides();
  std::array<Result<void>, 2> done;
  std::thread right([&] { done[1] = write_side(both[1], frames, root); });
  done[0] = write_side(both[0], frames, root);
  right.join();
  const auto truth = write_truth(frames, root);
  for (const Result<void>& result : {done[0], done[1], truth}) {
    if (result.ok()) continue;
    std::cerr << result.error() << "\n";
    return 1;
  }
  return 0;
}
