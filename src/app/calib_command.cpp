#include <filesystem>
#include <iostream>
#include <memory>

#include "sovo/app/calib_refine.h"
#include "sovo/app/commands.h"
#include "sovo/app/failure.h"
#include "sovo/driver/dataset/dataset_source.h"
#include "sovo/io/calibration.h"
#include "sovo/io/calibration_check.h"
#include "sovo/io/text.h"

namespace sovo::app {
namespace {

namespace fs = std::filesystem;

/// Options that all three share.
struct CalibOptions {
  std::string path;
  std::string right_path;
  std::string size;
  bool colour = false;
  std::string to = "sovo";
  std::string out;
  std::string dataset;
  int pairs = 5;
};

void add_input(const Command& command, CalibOptions* options) {
  command.option("path", "Calibration file, or a folder that has one", &options->path).required();
  command.option("--right", "ROS camera_info of the right camera", &options->right_path);
  command.option("--size", "Image size WIDTHxHEIGHT, where the file has none (KITTI, OpenCV)",
                 &options->size);
  command.flag("--colour", "KITTI: the colour cameras, 2 and 3", &options->colour);
}

Result<Calibration> load(const CalibOptions& options, bool validate) {
  CalibrationOptions how;
  how.right_path = options.right_path;
  if (options.colour) how.kitti_colour = true;
  how.validate = validate;
  if (!options.size.empty()) {
    const auto sides = split(options.size, "x");
    const auto width = sides.size() == 2 ? parse_integer(sides[0]) : std::nullopt;
    const auto height = sides.size() == 2 ? parse_integer(sides[1]) : std::nullopt;
    if (!width || !height || *width < 1 || *height < 1 || *width > 32768 || *height > 32768) {
      return Error{"--size must be WIDTHxHEIGHT, not '" + excerpt(options.size) + "'"};
    }
    how.image_width = static_cast<int>(*width);
    how.image_height = static_cast<int>(*height);
  }
  return load_calibration(options.path, how);
}

void show_camera(const std::string& side, const CameraModel& camera,
                 const PhotometricCalibration& photometric, const ImageU8& mask) {
  std::cout << side << ": " << camera.width << "x" << camera.height << ", fx "
            << format_fixed(camera.fx, 3) << ", fy " << format_fixed(camera.fy, 3) << ", cx "
            << format_fixed(camera.cx, 3) << ", cy " << format_fixed(camera.cy, 3) << " px, "
            << to_string(camera.distortion);
  for (int i = 0; i < camera.num_coefficients; ++i) {
    std::cout << " " << format_double(camera.d[static_cast<std::size_t>(i)]);
  }
  std::cout << (photometric.inverse_response.empty() ? "" : ", response")
            << (photometric.vignette.empty() ? "" : ", vignette") << (mask.empty() ? "" : ", mask")
            << "\n";
}

void show_port(const std::string& side, const CameraModel& camera) {
  if (!camera.port) return;
  const FlatPort& port = *camera.port;
  const auto millimetres = [](double v) { return format_fixed(1e3 * v, 1) + " mm"; };
  std::cout << side << ": behind a flat port, " << millimetres(port.distance) << " away and "
            << millimetres(port.thickness) << " thick, of index " << format_double(port.glass)
            << ", in water of index " << format_double(port.water) << "; rays meet, in the mean, "
            << millimetres(-port.centre) << " behind the camera\n";
}

int show(const CalibOptions& options) {
  const auto calibration = load(options, false);
  if (!calibration) return fail(kBadInput, calibration.error());
  const StereoRig& rig = calibration->rig;
  const Vec3 t = rig.T_right_left.translation();
  const double turn = rig.T_right_left.rotation().log().norm() * 180.0 / M_PI;
  std::cout << "format: " << calibration->format << "\nname: " << rig.name << "\n";
  show_camera("left", rig.left, calibration->left_photometric, calibration->left_mask);
  show_camera("right", rig.right, calibration->right_photometric, calibration->right_mask);
  show_port("left", rig.left);
  show_port("right", rig.right);
  std::cout << "baseline: " << format_fixed(rig.baseline(), 6)
            << " m, left origin in the right frame (" << format_fixed(t.x(), 6) << ", "
            << format_fixed(t.y(), 6) << ", " << format_fixed(t.z(), 6) << ") m, turned by "
            << format_fixed(turn, 3) << " deg\n";
  const auto problems = check_rig(rig);
  for (const std::string& problem : problems) std::cout << "PROBLEM: " << problem << "\n";
  return problems.empty() ? kOk : kFailed;
}

Result<void> write_ros(const StereoRig& rig, const std::string& folder) {
  std::error_code code;
  fs::create_directories(folder, code);
  if (code) return Error{folder + ": cannot be made: " + code.message()};
  const CameraInfoPair pair = format_ros_calibration(rig);
  const auto left = write_text_file(fs::path(folder) / "left.yaml", pair.left);
  if (!left) return left;
  return write_text_file(fs::path(folder) / "right.yaml", pair.right);
}

int convert(const CalibOptions& options) {
  const auto calibration = load(options, true);
  if (!calibration) return fail(kBadInput, calibration.error());
  if (options.to == "ros") {
    const auto written = write_ros(calibration->rig, options.out);
    return written ? kOk : fail(kFailed, written.error());
  }
  const std::string text = format_sovo_calibration(calibration->rig);
  if (options.out.empty()) {
    std::cout << text;
    return kOk;
  }
  const auto written = write_text_file(options.out, text);
  return written ? kOk : fail(kFailed, written.error());
}

/// Up to `count` pairs, evenly spread over the dataset, brightness as it was recorded.
Result<std::vector<ImagePair>> read_pairs(const CalibOptions& options,
                                          const Calibration& calibration) {
  DatasetOptions dataset;
  dataset.path = options.dataset;
  auto layout = find_layout(dataset.path, dataset.frame_rate);
  if (!layout) return layout.failure();
  DatasetSource source(std::move(*layout), calibration, dataset);
  const std::size_t size = source.size().value_or(0);
  const auto wanted = static_cast<std::size_t>(options.pairs);
  const std::size_t step = std::max<std::size_t>(1, size / wanted);
  std::vector<ImagePair> pairs;
  std::string problem = dataset.path + ": has no pair of images";
  for (std::size_t i = 0; i < size && pairs.size() < wanted; ++i) {
    const SourceResult result = source.next(std::chrono::seconds(10));
    if (result.state == SourceState::kEndOfStream || result.state == SourceState::kFailed) break;
    if (!result.message.empty()) problem = result.message;
    if (result.state != SourceState::kFrame || i % step != 0) continue;
    if (!result.frame.left.valid || !result.frame.right.valid) continue;
    ImagePair& pair = pairs.emplace_back();
    to_float(result.frame.left, {}, 1, &pair.left);
    to_float(result.frame.right, {}, 1, &pair.right);
  }
  if (pairs.empty()) return Error{problem};
  return pairs;
}

int report(const CalibrationReport& result) {
  std::cout << "points: " << result.points << ", matched: " << result.matches
            << ", with the images exchanged: " << result.exchanged_matches
            << "\nmedian depth: " << format_fixed(result.median_depth, 3)
            << " m\nacross the epipolar lines: median " << format_fixed(result.median_across_px, 3)
            << " px, of magnitudes " << format_fixed(result.median_abs_across_px, 3) << " px\n";
  for (const CalibrationFinding& finding : result.findings) {
    std::cout << "PROBLEM: " << finding.message << "\n";
  }
  if (result.findings.empty()) std::cout << "the calibration fits the images\n";
  return result.findings.empty() ? kOk : kFailed;
}

int check(CalibOptions options) {
  const auto calibration = load(options, false);
  if (!calibration) return fail(kBadInput, calibration.error());
  const auto problems = check_rig(calibration->rig);
  for (const std::string& problem : problems) std::cout << "PROBLEM: " << problem << "\n";
  if (!problems.empty()) return kFailed;
  std::error_code code;
  if (options.dataset.empty() && fs::is_directory(options.path, code)) {
    options.dataset = options.path;
  }
  if (options.dataset.empty()) {
    std::cout << "the numbers are consistent; give --dataset DIR to check them against images\n";
    return kOk;
  }
  const auto pairs = read_pairs(options, *calibration);
  if (!pairs) return fail(kBadInput, pairs.error());
  return report(check_calibration_on_images(calibration->rig, *pairs));
}

int convert_checked(const CalibOptions& options) {
  if (options.to == "ros" && options.out.empty()) {
    return fail(kUsage, "--to ros writes two files: give their folder with --out");
  }
  return convert(options);
}

}  // namespace

void add_calib_command(const Command& program) {
  const Command command =
      program.add_command("calib", "Calibration files: show, convert, check, refine");
  command.require_command();
  const auto options = std::make_shared<CalibOptions>();

  const Command showing = command.add_command("show", "Print a calibration in words");
  add_input(showing, options.get());
  showing.action([options] { return show(*options); });

  const Command converting = command.add_command("convert", "Write it in another format");
  add_input(converting, options.get());
  converting.option("--to", "sovo, or ros (left.yaml and right.yaml)", &options->to)
      .one_of({"sovo", "ros"});
  converting.option("--out", "File (sovo; standard output when not given) or folder (ros)",
                    &options->out);
  converting.action([options] { return convert_checked(*options); });

  const Command checking = command.add_command(
      "check",
      "Look for swapped cameras, wrong units and decalibration, in the numbers and in images");
  add_input(checking, options.get());
  checking.option("--dataset", "Images to check against; the calibration's folder when it has them",
                  &options->dataset);
  checking.option("--pairs", "How many pairs of it are looked at", &options->pairs)
      .in_range(1, 1000);
  checking.action([options] { return check(*options); });

  add_calib_refine_command(command);
}

}  // namespace sovo::app
