#include "sovo/geometry/radtan_fit.h"

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "sovo/geometry/linear_solvers.h"

namespace sovo {

namespace {

struct Sight {
  Vec2 pixel;
  Vec3 direction;
};

/// Of a grid over the image.
std::vector<Sight> sights_of(const CameraModel& camera) {
  constexpr int kColumns = 33;
  constexpr int kRows = 25;
  std::vector<Sight> sights;
  for (int j = 0; j < kRows; ++j) {
    for (int i = 0; i < kColumns; ++i) {
      const Vec2 pixel(i * (camera.width - 1) / (kColumns - 1.0),
                       j * (camera.height - 1) / (kRows - 1.0));
      const auto direction = camera.unproject(pixel);
      if (direction && direction->z() > 0.1) sights.push_back({pixel, *direction});
    }
  }
  return sights;
}

/// fx fy cx cy, and d in its order.
constexpr int kParameters = 12;
using Parameters = Eigen::Matrix<double, kParameters, 1>;

CameraModel camera_of(const CameraModel& like, const Parameters& p) {
  CameraModel c;
  c.width = like.width;
  c.height = like.height;
  c.fx = p[0];
  c.fy = p[1];
  c.cx = p[2];
  c.cy = p[3];
  c.distortion = Distortion::kRadtan;
  c.num_coefficients = 8;
  for (std::size_t i = 0; i < c.d.size(); ++i) c.d[i] = p[4 + static_cast<Eigen::Index>(i)];
  return c;
}

/// Residuals of all sights [px]; nothing where one has none.
std::optional<VecX> errors_of(const CameraModel& like, const Parameters& p,
                              const std::vector<Sight>& sights) {
  const CameraModel camera = camera_of(like, p);
  VecX errors(2 * static_cast<Eigen::Index>(sights.size()));
  for (std::size_t i = 0; i < sights.size(); ++i) {
    const auto pixel = camera.project(sights[i].direction);
    if (!pixel) return std::nullopt;
    errors.segment<2>(2 * static_cast<Eigen::Index>(i)) = *pixel - sights[i].pixel;
  }
  return errors;
}

/// Gauss-Newton's steps, damped (Levenberg and Marquardt), until they no longer help.
Parameters fit(const CameraModel& like, const std::vector<Sight>& sights, Parameters p) {
  constexpr int kSteps = 100;
  constexpr double kDelta = 1e-6;
  Parameters size = Parameters::Constant(1.0);  // how much of each moves pixels about as far
  size.head<4>().setConstant(p[0]);
  double damping = 1e-3;
  auto errors = errors_of(like, p, sights);
  for (int step = 0; step < kSteps && errors && damping < 1e8; ++step) {
    MatX jacobian(errors->size(), kParameters);
    for (int k = 0; k < kParameters; ++k) {
      Parameters moved = p;
      moved[k] += kDelta * size[k];
      const auto there = errors_of(like, moved, sights);
      if (!there) return p;
      jacobian.col(k) = (*there - *errors) / kDelta;
    }
    MatX A = jacobian.transpose() * jacobian;
    const VecX b = jacobian.transpose() * *errors;
    A.diagonal() *= 1.0 + damping;
    const Parameters better = p - size.cwiseProduct(Parameters(solve_symmetric(A, b)));
    const auto there = errors_of(like, better, sights);
    const bool helps = there && there->squaredNorm() < errors->squaredNorm();
    damping = helps ? std::max(1e-9, 0.1 * damping) : 10.0 * damping;
    if (!helps) continue;
    const double left = there->squaredNorm() / errors->squaredNorm();
    p = better;
    errors = there;
    if (left > 1.0 - 1e-9) break;
  }
  return p;
}

}  // namespace

std::optional<RadtanFit> fit_radtan(const CameraModel& camera) {
  constexpr std::size_t kFewest = 100;
  const std::vector<Sight> sights = sights_of(camera);
  if (sights.size() < kFewest) return std::nullopt;
  // As wide as the image's middle is, from which the fit finds the lens.
  Parameters p = Parameters::Zero();
  const double index = camera.port ? camera.port->water : 1.0;
  p.head<4>() << index * camera.fx, index * camera.fy, camera.cx, camera.cy;
  p = fit(camera, sights, p);
  const auto errors = errors_of(camera, p, sights);
  if (!errors) return std::nullopt;
  RadtanFit out{camera_of(camera, p), 0.0};
  for (Eigen::Index i = 0; i < errors->size(); i += 2) {
    out.worst_px = std::max(out.worst_px, errors->segment<2>(i).norm());
  }
  return out;
}

StereoRig without_ports(const StereoRig& rig) {
  StereoRig out = rig;
  for (CameraModel* camera : {&out.left, &out.right}) {
    if (!camera->port) continue;
    const auto fit = fit_radtan(*camera);
    CameraModel unknown;
    unknown.width = camera->width;
    unknown.height = camera->height;
    *camera = fit ? fit->camera : unknown;
  }
  return out;
}

}  // namespace sovo
