#include "sovo/bridge/calibration_conversion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/stereo_frame_conversion.h"

namespace sovo::bridge {
namespace {

constexpr const char* kPinhole = "pinhole";
constexpr const char* kFlatPort = "pinhole_flat_port";
constexpr std::size_t kPortNumbers = 8;
constexpr float kVignetteScale = 65535.0F;
constexpr std::size_t kResponseSize = 256;
constexpr double kLongestBaseline = 100.0;  // [m]; more is millimetres

bool all_finite(const double* values, std::size_t count) {
  return std::all_of(values, values + count, [](double v) { return std::isfinite(v); });
}

/// Also takes the names that ROS gives the same models in CameraInfo.
Result<Distortion> distortion_of(const std::string& name, const std::string& camera) {
  if (name == "none") return Distortion::kNone;
  if (name == "radtan" || name == "plumb_bob" || name == "rational_polynomial") {
    return Distortion::kRadtan;
  }
  if (name == "equidistant") return Distortion::kEquidistant;
  return Error{camera + ".distortion_model is not one of none, radtan, equidistant"};
}

/// The numbers of a port, after those of the distortion.
std::array<double, kPortNumbers> numbers_of(const FlatPort& p) {
  return {p.distance,   p.thickness,  p.glass,      p.water,
          p.normal.x(), p.normal.y(), p.normal.z(), p.centre};
}

std::optional<FlatPort> port_of(const double* d) {
  const FlatPort port{d[0], d[1], d[2], d[3], Vec3(d[4], d[5], d[6]), d[7]};
  return port.is_possible() ? std::optional(port) : std::nullopt;
}

bool fits(Distortion distortion, std::uint32_t coefficients) {
  switch (distortion) {
    case Distortion::kNone:
      return true;
    case Distortion::kEquidistant:
      return coefficients == 4;
    case Distortion::kRadtan:
      return coefficients == 4 || coefficients == 5 || coefficients == 8;
  }
  return false;
}

Result<PhotometricCalibration> photometric_of(const msg::CameraModel& m, const std::string& name) {
  PhotometricCalibration result;
  if (m.response._length != 0) {
    if (m.response._length != kResponseSize || !all_finite(m.response._buffer, kResponseSize)) {
      return Error{name + ".response is not 256 numbers"};
    }
    result.inverse_response.resize(kResponseSize);
    std::transform(m.response._buffer, m.response._buffer + kResponseSize,
                   result.inverse_response.begin(), [](double v) { return static_cast<float>(v); });
  }
  if (m.vignette._length != 0) {
    if (m.vignette._length != std::uint64_t{m.width} * m.height) {
      return Error{name + ".vignette has " + std::to_string(m.vignette._length) +
                   " values, not one a pixel"};
    }
    result.vignette.resize(static_cast<int>(m.width), static_cast<int>(m.height));
    // 0 would make a pixel infinitely bright.
    std::transform(m.vignette._buffer, m.vignette._buffer + m.vignette._length,
                   result.vignette.data(), [](std::uint16_t v) {
                     return static_cast<float>(std::max<std::uint16_t>(v, 1)) / kVignetteScale;
                   });
  }
  return result;
}

}  // namespace

Result<CameraModel> from_message(const msg::CameraModel& m, const std::string& name) {
  if (m.width == 0 || m.height == 0 || m.width > kLargestImage || m.height > kLargestImage) {
    return Error{name + ": size " + std::to_string(m.width) + "x" + std::to_string(m.height) +
                 " px is not between 1 and " + std::to_string(kLargestImage)};
  }
  const std::string model = text_or_empty(m.model);
  if (model != kPinhole && model != kFlatPort) {
    return Error{name + ".model is not pinhole or " + kFlatPort};
  }
  if (!all_finite(m.fx_fy_cx_cy, 4) || m.fx_fy_cx_cy[0] <= 0.0 || m.fx_fy_cx_cy[1] <= 0.0) {
    return Error{name + ".fx_fy_cx_cy has a focal length that is not positive, or no number"};
  }
  const auto distortion = distortion_of(text_or_empty(m.distortion_model), name);
  if (!distortion) return distortion.failure();
  const std::uint32_t of_port = model == kFlatPort ? kPortNumbers : 0;
  if (m.d._length < of_port || !fits(*distortion, m.d._length - of_port) ||
      !all_finite(m.d._buffer, m.d._length)) {
    return Error{name + ".d: " + to_string(*distortion) + " with " + std::to_string(m.d._length) +
                 " coefficients, or one that is not a number"};
  }
  CameraModel camera;
  camera.width = static_cast<int>(m.width);
  camera.height = static_cast<int>(m.height);
  camera.fx = m.fx_fy_cx_cy[0];
  camera.fy = m.fx_fy_cx_cy[1];
  camera.cx = m.fx_fy_cx_cy[2];
  camera.cy = m.fx_fy_cx_cy[3];
  camera.distortion = *distortion;
  if (*distortion != Distortion::kNone) {
    const std::uint32_t coefficients = m.d._length - of_port;
    std::copy_n(m.d._buffer, coefficients, camera.d.begin());
    camera.num_coefficients = static_cast<int>(coefficients);
  }
  if (of_port == 0) return camera;
  const auto port = port_of(m.d._buffer + m.d._length - of_port);
  if (!port) return Error{name + ".d: its last eight numbers are not those of a flat port"};
  camera.port = *port;
  return camera;
}

msg::CameraModel CalibrationMessage::fill(const CameraModel& camera,
                                          const PhotometricCalibration& photometric,
                                          Camera* storage) {
  storage->distortion = to_string(camera.distortion);
  storage->coefficients.assign(camera.d.begin(), camera.d.begin() + camera.num_coefficients);
  if (camera.port) {
    const auto numbers = numbers_of(*camera.port);
    storage->coefficients.insert(storage->coefficients.end(), numbers.begin(), numbers.end());
  }
  storage->response.assign(photometric.inverse_response.begin(),
                           photometric.inverse_response.end());
  storage->vignette.resize(photometric.vignette.size());
  std::transform(
      photometric.vignette.data(), photometric.vignette.data() + photometric.vignette.size(),
      storage->vignette.begin(), [](float v) {
        return static_cast<std::uint16_t>(std::lround(std::clamp(v, 0.0F, 1.0F) * kVignetteScale));
      });
  msg::CameraModel m{};
  m.width = static_cast<std::uint32_t>(camera.width);
  m.height = static_cast<std::uint32_t>(camera.height);
  m.model = borrow(camera.port ? kFlatPort : kPinhole);
  m.distortion_model = borrow(storage->distortion);
  const double intrinsics[] = {camera.fx, camera.fy, camera.cx, camera.cy};
  std::copy_n(intrinsics, 4, m.fx_fy_cx_cy);
  borrow(m.d, storage->coefficients);
  borrow(m.response, storage->response);
  borrow(m.vignette, storage->vignette);
  return m;
}

CalibrationMessage::CalibrationMessage(const StereoCameras& cameras, const std::string& frame_id,
                                       std::int64_t stamp_ns)
    : frame_id_(frame_id), name_(cameras.rig.name) {
  message_.header.stamp = to_message(stamp_ns);
  message_.header.frame_id = borrow(frame_id_);
  message_.name = borrow(name_);
  message_.left = fill(cameras.rig.left, cameras.left_photometric, &cameras_[0]);
  message_.right = fill(cameras.rig.right, cameras.right_photometric, &cameras_[1]);
  message_.right_from_left = to_transform(cameras.rig.T_right_left);
  message_.base_from_left = to_transform(cameras.rig.T_base_left);
}

Result<StereoCameras> from_message(const msg::StereoCalibration& m) {
  StereoCameras cameras;
  cameras.rig.name = text_or_empty(m.name);
  auto left = from_message(m.left, "left");
  if (!left) return left.failure();
  auto right = from_message(m.right, "right");
  if (!right) return right.failure();
  auto left_photometric = photometric_of(m.left, "left");
  if (!left_photometric) return left_photometric.failure();
  auto right_photometric = photometric_of(m.right, "right");
  if (!right_photometric) return right_photometric.failure();
  for (const auto& [name, T] : {std::pair("right_from_left", &m.right_from_left),
                                std::pair("base_from_left", &m.base_from_left)}) {
    if (!is_rigid(T->translation, T->rotation)) {
      return Error{std::string(name) + " is not a rigid motion"};
    }
  }
  cameras.rig.left = *left;
  cameras.rig.right = *right;
  cameras.left_photometric = std::move(*left_photometric);
  cameras.right_photometric = std::move(*right_photometric);
  cameras.rig.T_right_left = to_se3(m.right_from_left.translation, m.right_from_left.rotation);
  cameras.rig.T_base_left = to_se3(m.base_from_left.translation, m.base_from_left.rotation);
  if (cameras.rig.baseline() == 0.0 || cameras.rig.baseline() > kLongestBaseline) {
    return Error{"right_from_left: a baseline of " + std::to_string(cameras.rig.baseline()) +
                 " m; it is to be given in metres"};
  }
  return cameras;
}

}  // namespace sovo::bridge
