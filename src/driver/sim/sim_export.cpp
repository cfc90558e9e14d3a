#include "sovo/driver/sim/sim_export.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>
#include <utility>

#include "sovo/geometry/radtan_fit.h"
#include "sovo/io/image_file.h"
#include "sovo/io/text.h"

namespace sovo::sim {
namespace {

namespace fs = std::filesystem;

std::string numbers(const std::vector<double>& values) {
  std::string text = "[";
  for (std::size_t i = 0; i < values.size(); ++i) {
    text += (i == 0 ? "" : ", ") + format_double(values[i]);
  }
  return text + "]";
}

std::string sensor_yaml(const CameraModel& camera, const SE3& T_body_sensor, double rate) {
  const Mat4 m = T_body_sensor.matrix();
  std::vector<double> pose;
  for (int i = 0; i < 16; ++i) pose.push_back(m(i / 4, i % 4));
  const bool plain = camera.distortion == Distortion::kNone;
  std::vector<double> coefficients(camera.d.begin(),
                                   camera.d.begin() + std::max(4, camera.num_coefficients));
  return "sensor_type: camera\ncomment: simulated\n\nT_BS:\n  cols: 4\n  rows: 4\n  data: " +
         numbers(pose) + "\n\nrate_hz: " + format_double(rate) + "\nresolution: [" +
         std::to_string(camera.width) + ", " + std::to_string(camera.height) +
         "]\ncamera_model: pinhole\nintrinsics: " +
         numbers({camera.fx, camera.fy, camera.cx, camera.cy}) + "\ndistortion_model: " +
         (plain                                      ? std::string("radial-tangential")
          : camera.distortion == Distortion::kRadtan ? "radial-tangential"
                                                     : "equidistant") +
         "\ndistortion_coefficients: " + numbers(coefficients) + "\n";
}

/// The files of one camera.
class CameraFiles {
 public:
  CameraFiles(const fs::path& root, const std::string& camera)
      : mav_(root / "mav0" / camera), dso_(root / "dso" / camera) {}

  Result<void> begin(const CameraModel& camera, const SE3& T_body_sensor, double rate,
                     const PhotometricCalibration& photometric) {
    std::error_code error;
    fs::create_directories(mav_ / "data", error);
    if (!error) fs::create_directories(dso_, error);
    if (error) return Error{mav_.string() + ": cannot be made: " + error.message()};
    const std::string yaml = sensor_yaml(camera, T_body_sensor, rate);
    if (auto ok = write_text_file((mav_ / "sensor.yaml").string(), yaml); !ok) return ok;
    if (!photometric.inverse_response.empty()) {
      std::string text;
      for (const float v : photometric.inverse_response) text += format_float(v) + " ";
      if (auto ok = write_text_file((dso_ / "pcalib.txt").string(), text + "\n"); !ok) return ok;
    }
    if (photometric.vignette.empty()) return {};
    return write_vignette(photometric.vignette);
  }

  Result<void> add(const SideImage& side, std::int64_t stamp_ns) {
    const std::string name = std::to_string(stamp_ns);
    csv_ += name + "," + name + ".png\n";
    // As many digits as bring the same float back from milliseconds.
    const double exposure_ms = 1e3 * static_cast<double>(side.exposure_s);
    times_ += name + " " + format_ns_as_seconds(stamp_ns) + " " + format_double(exposure_ms) + "\n";
    return write_png((mav_ / "data" / (name + ".png")).string(),
                     {side.width, side.height, side.format, *side.data});
  }

  Result<void> finish() {
    if (auto ok = write_text_file((mav_ / "data.csv").string(), csv_); !ok) return ok;
    return write_text_file((dso_ / "times.txt").string(), times_);
  }

 private:
  Result<void> write_vignette(const ImageF& vignette) {
    GreyImage image{vignette.width(), vignette.height(), PixelFormat::kMono16, {}};
    for (std::size_t i = 0; i < vignette.size(); ++i) {
      const auto value = static_cast<std::uint16_t>(std::lround(65535.0F * vignette.data()[i]));
      image.data.push_back(static_cast<std::uint8_t>(value & 0xFF));
      image.data.push_back(static_cast<std::uint8_t>(value >> 8));
    }
    return write_png((dso_ / "vignette.png").string(), image);
  }

  fs::path mav_;
  fs::path dso_;
  std::string csv_ = "#timestamp [ns],filename\n";
  std::string times_;
};

/// True depths of the same left pixels of some pairs, as comma separated values.
class DepthTable {
 public:
  static constexpr std::size_t kEvery = 10;  ///< Pairs: an image of depths is rendered for it.

  DepthTable(int width, int height) {
    constexpr int kColumns = 12;
    constexpr int kRows = 8;
    for (int row = 0; row < kRows; ++row) {
      for (int column = 0; column < kColumns; ++column) {
        pixels_.emplace_back((2 * column + 1) * width / (2 * kColumns),
                             (2 * row + 1) * height / (2 * kRows));
      }
    }
  }

  void add(std::int64_t stamp_ns, const ImageF& depth) {
    const std::string stamp = std::to_string(stamp_ns);
    for (const auto& [u, v] : pixels_) {
      text_ += stamp + "," + std::to_string(u) + "," + std::to_string(v) + "," +
               format_float(depth.at(u, v)) + "\n";
    }
  }

  const std::string& text() const { return text_; }

 private:
  std::vector<std::pair<int, int>> pixels_;
  std::string text_ = "#timestamp [ns],u [px],v [px],depth [m]\n";
};

/// EuRoC's files know no ports: ours, beside them, comes first.
Result<void> write_with_ports(const fs::path& root, const Calibration& c) {
  PhotometricFiles files;
  if (!c.left_photometric.inverse_response.empty()) files.left_response = "dso/cam0/pcalib.txt";
  if (!c.left_photometric.vignette.empty()) files.left_vignette = "dso/cam0/vignette.png";
  if (!c.right_photometric.inverse_response.empty()) files.right_response = "dso/cam1/pcalib.txt";
  if (!c.right_photometric.vignette.empty()) files.right_vignette = "dso/cam1/vignette.png";
  return write_text_file((root / "calibration.yaml").string(),
                         format_sovo_calibration(c.rig, files));
}

}  // namespace

Result<void> write_pfm(const std::string& path, const ImageF& image) {
  static_assert(std::endian::native == std::endian::little);
  std::string text =
      "Pf\n" + std::to_string(image.width()) + " " + std::to_string(image.height()) + "\n-1.0\n";
  for (int y = image.height() - 1; y >= 0; --y) {
    for (int x = 0; x < image.width(); ++x) {
      const auto bits = std::bit_cast<std::uint32_t>(image.at(x, y));
      for (int b = 0; b < 4; ++b) text.push_back(static_cast<char>(bits >> (8 * b) & 0xFFU));
    }
  }
  return write_text_file(path, text);
}

Result<void> export_dataset(SimSource* source, const std::string& directory, bool depth,
                            const std::function<bool(std::size_t)>& progress) {
  const fs::path root(directory);
  const Calibration& c = source->calibration();
  const StereoRig rig = without_ports(c.rig);
  CameraFiles left(root, "cam0");
  CameraFiles right(root, "cam1");
  const SE3 T_body_right = rig.T_base_left * rig.T_right_left.inverse();
  const double rate = source->frame_rate();
  if (auto ok = left.begin(rig.left, rig.T_base_left, rate, c.left_photometric); !ok) return ok;
  if (auto ok = right.begin(rig.right, T_body_right, rate, c.right_photometric); !ok) return ok;
  if (c.rig.left.port || c.rig.right.port) {
    if (auto ok = write_with_ports(root, c); !ok) return ok;
  }
  if (depth) fs::create_directories(root / "depth");
  Trajectory truth;
  DepthTable table(rig.left.width, rig.left.height);
  for (std::size_t done = 0;;) {
    const SourceResult next = source->next(std::chrono::seconds(10));
    if (next.state == SourceState::kEndOfStream) break;
    if (next.state == SourceState::kTimeout) continue;
    const std::int64_t stamp = next.frame.stamp_ns;
    if (auto ok = left.add(next.frame.left, stamp); !ok) return ok;
    const std::int64_t right_stamp = stamp + next.frame.right.stamp_offset_ns;
    if (auto ok = right.add(next.frame.right, right_stamp); !ok) return ok;
    truth.push_back({stamp, source->pose_at(stamp)});
    const bool in_table = done % DepthTable::kEvery == 0;
    const ImageF true_depth = depth || in_table ? source->depth_at(stamp) : ImageF();
    if (in_table) table.add(stamp, true_depth);
    if (depth) {
      const fs::path file = root / "depth" / (std::to_string(stamp) + ".pfm");
      if (auto ok = write_pfm(file.string(), true_depth); !ok) return ok;
    }
    ++done;
    if (progress && !progress(done)) break;
  }
  if (auto ok = left.finish(); !ok) return ok;
  if (auto ok = right.finish(); !ok) return ok;
  if (auto ok = write_text_file((root / "depth.csv").string(), table.text()); !ok) return ok;
  return write_tum((root / "groundtruth_cam0_tum.txt").string(), truth,
                   "simulated: t tx ty tz qx qy qz qw of the left camera");
}

}  // namespace sovo::sim
