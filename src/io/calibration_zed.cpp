#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "sovo/geometry/so3.h"
#include "sovo/io/calibration_formats.h"
#include "sovo/io/text.h"

namespace sovo::calibration_formats {
namespace {

/// Image sizes of one eye, and how the file calls them.
struct Resolution {
  int width;
  int height;
  const char* name;
};
constexpr std::array<Resolution, 6> kResolutions = {{{2208, 1242, "2K"},
                                                     {1920, 1080, "FHD"},
                                                     {1280, 720, "HD"},
                                                     {672, 376, "VGA"},
                                                     {1920, 1200, "FHD1200"},
                                                     {960, 600, "SVGA"}}};
constexpr double kMetresPerMillimetre = 1e-3;

/// "[SECTION]" and "key=value" lines.
class IniFile {
 public:
  IniFile(const std::string& text, const std::string& path) : path_(path) {
    std::string section;
    int number = 0;
    for (const std::string_view raw : split_lines(text)) {
      ++number;
      const std::string_view line = trim(raw.substr(0, raw.find_first_of("#;")));
      if (line.empty()) continue;
      if (line.front() == '[' && line.back() == ']') {
        section = std::string(line.substr(1, line.size() - 2));
        sections_[section];
        continue;
      }
      const auto equals = line.find('=');
      if (equals == std::string_view::npos) {
        throw FormatError(place(number) + "'" + excerpt(line) +
                          "' is neither [SECTION] nor KEY=VALUE");
      }
      sections_[section][std::string(trim(line.substr(0, equals)))] = {
          std::string(trim(line.substr(equals + 1))), number};
    }
  }

  bool has(const std::string& section) const { return sections_.count(section) > 0; }
  bool has(const std::string& section, const std::string& key) const {
    return has(section) && sections_.at(section).count(key) > 0;
  }

  double number(const std::string& section, const std::string& key) const {
    if (!has(section, key)) throw FormatError(path_ + ": [" + section + "] has no " + key);
    const auto& [text, line] = sections_.at(section).at(key);
    const auto value = parse_double(text);
    if (!value) {
      throw FormatError(place(line) + key + " must be a finite number, not '" + excerpt(text) +
                        "'");
    }
    return *value;
  }

  double number_or(const std::string& section, const std::string& key, double otherwise) const {
    return has(section, key) ? number(section, key) : otherwise;
  }

 private:
  std::string place(int line) const { return path_ + ":" + std::to_string(line) + ": "; }

  std::string path_;
  std::map<std::string, std::map<std::string, std::pair<std::string, int>>> sections_;
};

Resolution find_resolution(const IniFile& file, const std::string& path,
                           const CalibrationOptions& options) {
  std::string known;
  for (const Resolution& r : kResolutions) {
    if (!file.has(std::string("LEFT_CAM_") + r.name)) continue;
    if (r.width == options.image_width && r.height == options.image_height) return r;
    known += (known.empty() ? "" : ", ") + std::to_string(r.width) + "x" + std::to_string(r.height);
  }
  throw FormatError(
      path + ": a ZED's calibration is for " + known + " (one eye); which one must be said" +
      (options.image_width > 0 ? ", " + std::to_string(options.image_width) + "x" +
                                     std::to_string(options.image_height) + " it is not"
                               : ": --size 1280x720"));
}

CameraModel read_camera(const IniFile& file, const std::string& section, const Resolution& size) {
  CameraModel camera;
  camera.width = size.width;
  camera.height = size.height;
  camera.fx = file.number(section, "fx");
  camera.fy = file.number(section, "fy");
  camera.cx = file.number(section, "cx");
  camera.cy = file.number(section, "cy");
  // In OpenCV's order; files of newer cameras have the rational model's k4 to k6.
  constexpr std::array kNames = {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
  for (std::size_t i = 0; i < kNames.size(); ++i)
    camera.d[i] = file.number_or(section, kNames[i], 0.0);
  const bool rational = camera.d[5] != 0.0 || camera.d[6] != 0.0 || camera.d[7] != 0.0;
  camera.num_coefficients = rational ? 8 : 5;
  bool any = false;
  for (const double d : camera.d) any |= d != 0.0;
  camera.distortion = any ? Distortion::kRadtan : Distortion::kNone;
  if (!any) camera.num_coefficients = 0;
  for (const char* name : {"s1", "s2", "s3", "s4"}) {
    if (std::abs(file.number_or(section, name, 0.0)) > 1e-6) {
      throw FormatError("[" + section + "] has thin-prism distortion (" + name +
                        "), which is not known here; calibrate the camera with Kalibr or OpenCV");
    }
  }
  return camera;
}

/// A value of [STEREO], with the resolution's suffix or without one, as the files have them.
double stereo_value(const IniFile& file, const std::string& key, const Resolution& size) {
  const std::string suffixed = key + "_" + size.name;
  if (file.has("STEREO", suffixed)) return file.number("STEREO", suffixed);
  return file.number_or("STEREO", key, 0.0);
}

}  // namespace

Calibration parse_zed(const std::string& text, const std::string& path,
                      const CalibrationOptions& options) {
  const IniFile file(text, path);
  const Resolution size = find_resolution(file, path, options);
  Calibration calibration;
  calibration.format = "ZED";
  StereoRig& rig = calibration.rig;
  rig.name = "zed";
  rig.left = read_camera(file, std::string("LEFT_CAM_") + size.name, size);
  rig.right = read_camera(file, std::string("RIGHT_CAM_") + size.name, size);
  // CV is the rotation about y ("convergence"); RX CV RZ is a rotation vector of the left frame
  // into the right one. The lengths say where the right camera is, so the left origin lies at minus
  // them in the right frame.
  const Vec3 rotation(stereo_value(file, "RX", size), stereo_value(file, "CV", size),
                      stereo_value(file, "RZ", size));
  const Vec3 millimetres(file.number("STEREO", "Baseline"), stereo_value(file, "TY", size),
                         stereo_value(file, "TZ", size));
  rig.T_right_left = SE3(SO3::exp(rotation), -kMetresPerMillimetre * millimetres);
  return calibration;
}

}  // namespace sovo::calibration_formats
