#include "sovo/vo/motion_hypotheses.h"

#include <algorithm>
#include <cmath>

namespace sovo {

namespace {

/// Rotations tried beside translations when nothing is known [rad]: 2.3, 3.2 and 4.0 degrees over
/// one, two and three axes.
constexpr double kUnknownRotation = 0.04;

void add_rotations(const SE3& around, std::vector<SE3>* hypotheses) {
  for (int i = 0; i < 27; ++i) {
    const Vec3 axis(i % 3 - 1, (i / 3) % 3 - 1, i / 9 - 1);
    if (axis.isZero()) continue;
    hypotheses->push_back(SE3(SO3::exp(kUnknownRotation * axis), Vec3::Zero()) * around);
  }
}

/// Along the first `axes`, to either side.
void add_translations(const SE3& around, double length, int axes, std::vector<SE3>* hypotheses) {
  for (int axis = 0; axis < axes; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      Vec3 t = Vec3::Zero();
      t[axis] = sign * length;
      hypotheses->push_back(SE3(SO3(), t) * around);
    }
  }
}

/// Steps to either side of a grid, of which the outermost is at `reach`, or nearer when that takes
/// more than `most`.
int steps_to(double reach, double step, int most) {
  return std::clamp(static_cast<int>(std::ceil(reach / step)), 1, most);
}

}  // namespace

std::vector<SE3> unknown_motions(const SE3& around, double mean_rho,
                                 std::span<const double> shares) {
  std::vector<SE3> out = {around};
  for (const double share : shares) add_translations(around, share / mean_rho, 3, &out);
  add_rotations(around, &out);
  return out;
}

std::vector<SE3> unknown_translations(const SE3& around, double mean_rho,
                                      std::span<const double> shares, double ahead) {
  std::vector<SE3> out = {around};
  for (const double share : shares) add_translations(around, share / mean_rho, 2, &out);
  const double most = *std::ranges::max_element(shares);
  for (int i = 1; i * ahead <= most; ++i) {
    for (const double sign : {-1.0, 1.0}) {
      out.push_back(SE3(SO3(), Vec3(0.0, 0.0, sign * i * ahead / mean_rho)) * around);
    }
  }
  return out;
}

std::vector<SE3> translations_around(const SE3& around, double mean_rho, double step, int steps) {
  std::vector<SE3> out;
  for (int x = -steps; x <= steps; ++x) {
    for (int y = -steps; y <= steps; ++y) {
      for (int z = -steps; z <= steps; ++z) {
        out.push_back(SE3(SO3(), step / mean_rho * Vec3(x, y, z)) * around);
      }
    }
  }
  return out;
}

std::vector<SO3> turns(double reach, const CameraModel& level) {
  constexpr int kMostSteps = 8;
  constexpr int kMostRolls = 2;
  const double pixel = 1.0 / level.fx;
  const double roll = 3.0 / (0.5 * (level.width + level.height));
  const int n = steps_to(reach, pixel, kMostSteps);
  const int n_roll = steps_to(reach, roll, kMostRolls);
  std::vector<SO3> out;
  for (int x = -n; x <= n; ++x) {
    for (int y = -n; y <= n; ++y) {
      for (int z = -n_roll; z <= n_roll; ++z) {
        out.push_back(SO3::exp(Vec3(x * pixel, y * pixel, z * roll)));
      }
    }
  }
  return out;
}

}  // namespace sovo
