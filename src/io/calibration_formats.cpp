#include "sovo/io/calibration_formats.h"

#include <algorithm>

#include "sovo/io/text.h"

namespace sovo::calibration_formats {
namespace {

constexpr double kRotationTolerance = 5e-3;

Distortion distortion_from_name(const std::string& name, const YamlField& where) {
  for (const char* radtan : {"radtan", "radial-tangential", "plumb_bob", "rational_polynomial",
                             "brown_conrady", "RadTan"}) {
    if (name == radtan) return Distortion::kRadtan;
  }
  for (const char* fisheye : {"equidistant", "fisheye", "kannala_brandt", "EquiDistant"}) {
    if (name == fisheye) return Distortion::kEquidistant;
  }
  if (name == "none" || name.empty()) return Distortion::kNone;
  throw where.error("has the distortion model '" + excerpt(name) +
                    "'; known are none, radtan (plumb_bob, rational_polynomial) and equidistant "
                    "(fisheye)");
}

bool all_zero(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return v == 0.0; });
}

void set_distortion(const CameraFields& fields, const YamlField& where, CameraModel* camera) {
  camera->distortion = distortion_from_name(fields.distortion_model, where);
  std::vector<double> d = fields.coefficients;
  if (camera->distortion == Distortion::kRadtan && all_zero(d)) {
    camera->distortion = Distortion::kNone;
  }
  if (camera->distortion == Distortion::kNone) {
    if (!all_zero(d)) throw where.error("has distortion coefficients but the model 'none'");
    return;
  }
  // OpenCV's further coefficients (thin prism, tilt) may be there as long as they do nothing.
  while (d.size() > 8 && d.back() == 0.0) d.pop_back();
  const bool radtan = camera->distortion == Distortion::kRadtan;
  const std::size_t n = d.size();
  if (!(n == 4 || (radtan && (n == 5 || n == 8)))) {
    throw where.error("has " + std::to_string(n) + " distortion coefficients; " +
                      to_string(camera->distortion) + (radtan ? " has 4, 5 or 8" : " has 4"));
  }
  std::copy(d.begin(), d.end(), camera->d.begin());
  camera->num_coefficients = static_cast<int>(n);
}

}  // namespace

CameraModel make_camera(const CameraFields& fields, const YamlField& where) {
  CameraModel camera;
  camera.width = fields.width;
  camera.height = fields.height;
  if (fields.intrinsics.size() != 4) throw where.error("must have the intrinsics fx fy cx cy");
  camera.fx = fields.intrinsics[0];
  camera.fy = fields.intrinsics[1];
  camera.cx = fields.intrinsics[2];
  camera.cy = fields.intrinsics[3];
  set_distortion(fields, where, &camera);
  return camera;
}

SE3 rigid_from_matrix(const MatX& matrix, const std::string& where) {
  const Mat3 r = matrix.topLeftCorner(3, 3);
  if (!((r * r.transpose() - Mat3::Identity()).norm() < kRotationTolerance)) {
    throw FormatError(where + "is no rigid motion: the rotation's rows are not orthonormal");
  }
  if (r.determinant() < 0.0) {
    throw FormatError(where + "is no rigid motion: it mirrors (determinant -1)");
  }
  if (matrix.rows() == 4 && !matrix.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1), 1e-9)) {
    throw FormatError(where + "is no rigid motion: the last row is not 0 0 0 1");
  }
  return {r, Vec3(matrix.topRightCorner(3, 1))};
}

Vec3 translation_of(const Projection& p) {
  const double z = p(2, 3);
  return {(p(0, 3) - p(0, 2) * z) / p(0, 0), (p(1, 3) - p(1, 2) * z) / p(1, 1), z};
}

void apply_size_options(const CalibrationOptions& options, CameraModel* camera) {
  if (camera->width == 0) camera->width = options.image_width;
  if (camera->height == 0) camera->height = options.image_height;
}

}  // namespace sovo::calibration_formats
