#include <cmath>

#include "sovo/io/calibration.h"
#include "sovo/io/text.h"

namespace sovo {
namespace {

constexpr double kLongestBaseline = 10.0;   // [m]
constexpr double kShortestBaseline = 1e-3;  // [m]
constexpr int kLargestImage = 32768;        // [px] a side

std::string metres(double value) { return format_fixed(value, 4) + " m"; }

bool is_finite(const CameraModel& camera) {
  bool finite = std::isfinite(camera.fx) && std::isfinite(camera.fy) && std::isfinite(camera.cx) &&
                std::isfinite(camera.cy);
  for (const double d : camera.d) finite = finite && std::isfinite(d);
  return finite;
}

void check_camera(const CameraModel& camera, const std::string& side,
                  std::vector<std::string>* problems) {
  const auto complain = [&](const std::string& what) {
    problems->push_back(side + " camera: " + what);
  };
  const std::string size = std::to_string(camera.width) + "x" + std::to_string(camera.height);
  if (!is_finite(camera)) {
    complain("an intrinsic or distortion value is not a finite number; calibrate it again");
    return;
  }
  if (camera.width <= 0 || camera.height <= 0) {
    complain("the image size is not known; give width and height");
  } else if (camera.width > kLargestImage || camera.height > kLargestImage) {
    complain("the image size " + size + " is not possible");
  } else if (!(camera.cx > 0.0 && camera.cy > 0.0 && camera.cx < camera.width - 1 &&
               camera.cy < camera.height - 1)) {
    complain("the principal point (" + format_double(camera.cx) + ", " + format_double(camera.cy) +
             ") lies outside the " + size +
             " image; check cx and cy, and that the image size is the calibrated one");
  }
  if (camera.fx <= 0.0 || camera.fy <= 0.0) {
    complain("the focal length (fx " + format_double(camera.fx) + ", fy " +
             format_double(camera.fy) + ") must be positive");
  } else if (camera.fx > 3.0 * camera.fy || camera.fy > 3.0 * camera.fx) {
    complain("fx " + format_double(camera.fx) + " and fy " + format_double(camera.fy) +
             " differ by more than three times; check the order fx fy cx cy");
  }
}

void check_baseline(const StereoRig& rig, std::vector<std::string>* problems) {
  const Vec3 t = rig.T_right_left.translation();
  if (!t.allFinite() || !rig.T_right_left.rotation().quaternion().coeffs().allFinite() ||
      !rig.T_base_left.matrix().allFinite()) {
    problems->push_back("a pose is not made of finite numbers");
    return;
  }
  const double baseline = rig.baseline();
  if (baseline == 0.0) {
    problems->push_back("the baseline is 0: both cameras are in the same place; scale needs one");
  } else if (baseline > kLongestBaseline) {
    problems->push_back("the baseline is " + metres(baseline) +
                        ", which looks like millimetres; translations are in metres: divide them "
                        "by 1000 (" +
                        metres(baseline / 1000.0) + ")");
  } else if (baseline < kShortestBaseline) {
    problems->push_back("the baseline is only " + format_double(baseline) +
                        " m; translations are in metres");
  }
  const bool horizontal = std::abs(t.x()) > std::abs(t.y()) && std::abs(t.x()) > std::abs(t.z());
  if (horizontal && t.x() > 0.0) {
    problems->push_back(
        "left and right look swapped: the right camera lies to the left of the left one (x of "
        "T_right_left's translation is " +
        metres(t.x()) + ", it must be negative); exchange the cameras, or invert the transform");
  }
}

}  // namespace

std::vector<std::string> check_rig(const StereoRig& rig) {
  std::vector<std::string> problems;
  check_camera(rig.left, "left", &problems);
  check_camera(rig.right, "right", &problems);
  check_baseline(rig, &problems);
  return problems;
}

}  // namespace sovo
