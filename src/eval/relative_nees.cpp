#include "sovo/eval/relative_nees.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "sovo/eval/nees.h"
#include "sovo/geometry/pose_covariance.h"

namespace sovo {
namespace {

constexpr std::int64_t kStampTolerance = 1'000'000;  ///< [ns]
constexpr int kRarely = 10;         ///< Of so many pairs one may claim what is no covariance.
constexpr std::size_t kStride = 5;  ///< Poses between two starts: neighbours say the same.

/// A pose with the true one of its stamp.
struct KnownPose {
  const UncertainPose* claimed;
  SE3 truth;
  double way = 0.0;  ///< True length of the path up to here [m].
};

/// Those that have a truth, with the way up to them.
std::vector<KnownPose> known_poses(std::span<const UncertainPose> poses, const Trajectory& truth) {
  std::vector<KnownPose> known;
  for (const UncertainPose& pose : poses) {
    const auto at = std::lower_bound(
        truth.begin(), truth.end(), pose.stamp_ns - kStampTolerance,
        [](const StampedPose& t, std::int64_t stamp) { return t.stamp_ns < stamp; });
    if (at == truth.end() || at->stamp_ns > pose.stamp_ns + kStampTolerance) continue;
    KnownPose next{&pose, at->T_world_body};
    if (!known.empty()) {
      const KnownPose& last = known.back();
      next.way = last.way + (next.truth.translation() - last.truth.translation()).norm();
    }
    known.push_back(next);
  }
  return known;
}

double pair_nees(const KnownPose& i, const KnownPose& j) {
  const SE3 estimated = i.claimed->T_odom_left.inverse() * j.claimed->T_odom_left;
  const SE3 expected = i.truth.inverse() * j.truth;
  Vec6 error;
  error << estimated.translation() - expected.translation(),
      (estimated.rotation() * expected.rotation().inverse()).log();
  const SO3 R_left_odom = i.claimed->T_odom_left.rotation().inverse();
  return nees<6>(error, rotated(R_left_odom, relative_covariance(*i.claimed, *j.claimed))) / 6.0;
}

}  // namespace

Mat6 relative_covariance(const UncertainPose& i, const UncertainPose& j) {
  // What lies before i is in both; its own alignment is in i alone.
  const Vec3 step = j.T_odom_left.translation() - i.T_odom_left.translation();
  return j.covariance - carried(i.covariance - 2.0 * i.frame_covariance, step);
}

double relative_nees(std::span<const UncertainPose> poses, const Trajectory& truth,
                     const PairDistance& distance) {
  const std::vector<KnownPose> known = known_poses(poses, truth);
  double sum = 0.0;
  int count = 0;
  int indefinite = 0;
  for (std::size_t i = 0; i < known.size(); i += kStride) {
    for (std::size_t j = i + 1; j < known.size(); ++j) {
      if (known[j].claimed->segment != known[i].claimed->segment) break;
      const double seconds =
          1e-9 * static_cast<double>(known[j].claimed->stamp_ns - known[i].claimed->stamp_ns);
      if (seconds < distance.seconds || known[j].way - known[i].way < distance.metres) continue;
      const double pair = pair_nees(known[i], known[j]);
      if (std::isfinite(pair)) {
        sum += pair;
        ++count;
      } else {
        ++indefinite;
      }
      break;
    }
  }
  const bool enough = count > 0 && kRarely * indefinite <= count;
  return enough ? sum / count : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace sovo
