#include "sovo/vo/motion_hypotheses.h"

#include <array>

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

}  // namespace

std::vector<SE3> unknown_motions(const SE3& around, double mean_rho) {
  constexpr std::array<double, 7> kShares = {0.02, 0.04, 0.07, 0.11, 0.16, 0.23, 0.32};
  std::vector<SE3> out = {around};
  for (const double share : kShares) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double sign : {-1.0, 1.0}) {
        Vec3 t = Vec3::Zero();
        t[axis] = sign * share / mean_rho;
        out.push_back(SE3(SO3(), t) * around);
      }
    }
  }
  add_rotations(around, &out);
  return out;
}

}  // namespace sovo
