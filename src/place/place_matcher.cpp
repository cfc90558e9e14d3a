#include "sovo/place/place_matcher.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "sovo/geometry/linear_solvers.h"

namespace sovo {
namespace {

/// The best and the second-best candidate of a descriptor.
struct Nearest {
  int best = 256;
  int second = 256;
  std::size_t index = 0;
};

Nearest nearest(const BinaryDescriptor& descriptor, const std::vector<Landmark>& landmarks) {
  Nearest n;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const int bits = hamming(descriptor, landmarks[i].keypoint.descriptor);
    if (bits < n.best) {
      n.second = std::exchange(n.best, bits);
      n.index = i;
    } else if (bits < n.second) {
      n.second = bits;
    }
  }
  return n;
}

Vec2 pixel_of(const Landmark& landmark) { return {landmark.keypoint.u, landmark.keypoint.v}; }

bool has_moved(const LandmarkPair& pair, const PlaceMatcherConfig& config) {
  return (pixel_of(*pair.a) - pixel_of(*pair.b)).norm() >= config.min_shift_px;
}

/// Pairs whose descriptors are each other's nearest, and clearly so.
std::vector<LandmarkPair> pair_by_descriptor(const Place& a, const Place& b,
                                             const PlaceMatcherConfig& config) {
  std::vector<LandmarkPair> pairs;
  for (const Landmark& landmark : a.landmarks) {
    const Nearest there = nearest(landmark.keypoint.descriptor, b.landmarks);
    if (there.best > config.max_hamming || there.best > config.max_ratio * there.second) continue;
    const Landmark& found = b.landmarks[there.index];
    const Nearest back = nearest(found.keypoint.descriptor, a.landmarks);
    if (&a.landmarks[back.index] != &landmark) continue;
    const LandmarkPair pair{&landmark, &found};
    const bool has_depth = landmark.has_depth() || found.has_depth();
    if (has_depth && has_moved(pair, config)) pairs.push_back(pair);
  }
  return pairs;
}

Vec3 bearing(const CameraModel& camera, const Landmark& landmark) {
  return {(landmark.keypoint.u - camera.cx) / camera.fx,
          (landmark.keypoint.v - camera.cy) / camera.fy, 1.0};
}

Vec3 point_of(const CameraModel& camera, const Landmark& landmark) {
  return bearing(camera, landmark) / static_cast<double>(landmark.inverse_depth);
}

/// A landmark's reprojection error where another view sees it.
struct Reprojection {
  Vec2 residual;     ///< Observed less projected [px].
  Mat26 jacobian;    ///< Of the projection by exp(x) T_to_from.
  Mat2 information;  ///< Of the residual: pixels and depth.
};

/// `from` needs a depth. Nothing where it lies behind the camera.
std::optional<Reprojection> reproject(const CameraModel& camera, const SE3& T_to_from,
                                      const Landmark& from, const Landmark& to, double sigma_px) {
  const Vec3 point = point_of(camera, from);
  const Vec3 seen = T_to_from * point;
  Mat23 d_point;
  const auto pixel = camera.project(seen, &d_point);
  if (!pixel) return std::nullopt;
  Reprojection r;
  r.residual = pixel_of(to) - *pixel;
  r.jacobian.leftCols<3>() = d_point;
  r.jacobian.rightCols<3>() = -d_point * hat(seen);
  // Both keypoints err; an error of rho moves the point by -point / rho.
  const double pixels_to = sigma_px * (1 << to.keypoint.level);
  const double pixels_from = sigma_px * (1 << from.keypoint.level);
  const Vec2 by_depth = d_point * (T_to_from.rotation() * point) *
                        (static_cast<double>(from.sigma) / static_cast<double>(from.inverse_depth));
  const Mat2 covariance = (pixels_to * pixels_to + pixels_from * pixels_from) * Mat2::Identity() +
                          by_depth * by_depth.transpose();
  r.information = covariance.inverse();
  return r;
}

/// Calls `use` with the one or two reprojections of a pair, told whether it is of a into b.
template <class Use>
void for_each_reprojection(const CameraModel& camera, const LandmarkPair& pair, const SE3& T_a_b,
                           const SE3& T_b_a, double sigma_px, const Use& use) {
  if (pair.a->has_depth()) {
    if (const auto r = reproject(camera, T_b_a, *pair.a, *pair.b, sigma_px)) use(*r, true);
  }
  if (pair.b->has_depth()) {
    if (const auto r = reproject(camera, T_a_b, *pair.b, *pair.a, sigma_px)) use(*r, false);
  }
}

bool fits(const CameraModel& camera, const LandmarkPair& pair, const SE3& T_a_b, const SE3& T_b_a,
          double sigma_px, double max_sigmas) {
  int tried = 0;
  int good = 0;
  for_each_reprojection(camera, pair, T_a_b, T_b_a, sigma_px, [&](const Reprojection& r, bool) {
    ++tried;
    good += r.residual.dot(r.information * r.residual) < max_sigmas * max_sigmas ? 1 : 0;
  });
  return tried > 0 && good == tried;
}

std::vector<LandmarkPair> fitting(const CameraModel& camera, const std::vector<LandmarkPair>& pairs,
                                  const SE3& T_a_b, double sigma_px, double max_sigmas) {
  const SE3 T_b_a = T_a_b.inverse();
  std::vector<LandmarkPair> good;
  std::copy_if(pairs.begin(), pairs.end(), std::back_inserter(good), [&](const LandmarkPair& p) {
    return fits(camera, p, T_a_b, T_b_a, sigma_px, max_sigmas);
  });
  return good;
}

struct MotionEquations {
  Mat6 H = Mat6::Zero();
  Vec6 b = Vec6::Zero();
  double energy = 0.0;
  int residuals = 0;
};

/// Of x in exp(x) T_a_b. A reprojection into b sees T_b_a = T_b_a exp(-x), which is
/// exp(-Ad(T_b_a) x) T_b_a. Huber's weight keeps what fits badly from ruling.
MotionEquations motion_equations(const CameraModel& camera, const std::vector<LandmarkPair>& pairs,
                                 const SE3& T_a_b, double sigma_px) {
  constexpr double kHuber = 1.5;
  const SE3 T_b_a = T_a_b.inverse();
  const Mat6 adjoint = T_b_a.adjoint();
  MotionEquations sum;
  for (const LandmarkPair& pair : pairs) {
    for_each_reprojection(
        camera, pair, T_a_b, T_b_a, sigma_px, [&](const Reprojection& r, bool into_b) {
          const Mat26 J = into_b ? Mat26(-r.jacobian * adjoint) : r.jacobian;
          const double sigmas = std::sqrt(r.residual.dot(r.information * r.residual));
          const double weight = sigmas <= kHuber ? 1.0 : kHuber / sigmas;
          sum.H += weight * J.transpose() * r.information * J;
          sum.b += weight * J.transpose() * r.information * r.residual;
          sum.energy += weight * sigmas * sigmas;
          ++sum.residuals;
        });
  }
  return sum;
}

/// The rigid motion that lays one triangle on another, if their sides agree.
std::optional<SE3> lay_triangle(const std::array<Vec3, 3>& a, const std::array<Vec3, 3>& b) {
  constexpr double kSideRatio = 1.3;
  constexpr double kFlattest = 0.05;  // sine of the least angle
  for (std::size_t i = 0; i < 3; ++i) {
    const double side_a = (a[i] - a[(i + 1) % 3]).norm();
    const double side_b = (b[i] - b[(i + 1) % 3]).norm();
    if (side_a > kSideRatio * side_b || side_b > kSideRatio * side_a) return std::nullopt;
  }
  const auto axes = [](const std::array<Vec3, 3>& p) -> std::optional<Mat3> {
    const Vec3 x = (p[1] - p[0]).normalized();
    const Vec3 normal = x.cross((p[2] - p[0]).normalized());
    if (!(normal.norm() > kFlattest)) return std::nullopt;
    const Vec3 z = normal.normalized();
    Mat3 m;
    m << x, z.cross(x), z;
    return m;
  };
  const auto axes_a = axes(a);
  const auto axes_b = axes(b);
  if (!axes_a || !axes_b) return std::nullopt;
  const Mat3 R = *axes_a * axes_b->transpose();
  const Vec3 centre_a = (a[0] + a[1] + a[2]) / 3.0;
  const Vec3 centre_b = (b[0] + b[1] + b[2]) / 3.0;
  return SE3(R, centre_a - R * centre_b);
}

/// Three sigma of an inlier of a motion that three noisy points gave, and of the refined one.
constexpr double kRoughSigmas = 8.0;
constexpr double kFineSigmas = 3.0;

std::optional<SE3> find_motion(const CameraModel& camera, const std::vector<LandmarkPair>& pairs,
                               const PlaceMatcherConfig& config) {
  std::vector<LandmarkPair> both;
  std::copy_if(pairs.begin(), pairs.end(), std::back_inserter(both),
               [](const LandmarkPair& p) { return p.a->has_depth() && p.b->has_depth(); });
  if (both.size() < 4) return std::nullopt;
  std::mt19937 generator(3);  // NOLINT(cert-msc51-cpp): the same answer to the same question
  std::size_t most = 3;
  std::optional<SE3> best;
  for (int tries = config.max_hypotheses; tries > 0; --tries) {
    std::array<Vec3, 3> in_a;
    std::array<Vec3, 3> in_b;
    for (std::size_t k = 0; k < 3; ++k) {
      std::swap(both[k], both[k + generator() % (both.size() - k)]);
      in_a[k] = point_of(camera, *both[k].a);
      in_b[k] = point_of(camera, *both[k].b);
    }
    const auto motion = lay_triangle(in_a, in_b);
    if (!motion) continue;
    const std::size_t agreeing =
        fitting(camera, pairs, *motion, config.sigma_px, kRoughSigmas).size();
    if (agreeing <= most) continue;
    most = agreeing;
    best = motion;
    // With this share of inliers so many tries find one triple of them in 99.9 % of the cases.
    const double share = static_cast<double>(most) / static_cast<double>(pairs.size());
    const double needed = -6.9 / std::log(1.0 - std::min(0.999, share * share * share));
    tries = std::min(tries, static_cast<int>(needed) + 1);
  }
  return best;
}

/// Pairs that the motion predicts, by descriptors that need not be the nearest of all.
struct PredictedPairs {
  std::vector<LandmarkPair> pairs;
  int expected = 0;  ///< Landmarks of a that b should see.
};

PredictedPairs pair_by_motion(const CameraModel& camera, const Place& a, const Place& b,
                              const SE3& T_a_b, double reach_px, const PlaceMatcherConfig& config) {
  const SE3 T_b_a = T_a_b.inverse();
  PredictedPairs out;
  for (const Landmark& landmark : a.landmarks) {
    if (!landmark.has_depth()) continue;
    const auto predicted = camera.project(T_b_a * point_of(camera, landmark));
    if (!predicted || !camera.contains(*predicted)) continue;
    ++out.expected;
    const double reach = reach_px * (1 << landmark.keypoint.level);
    const Landmark* found = nullptr;
    int fewest = config.max_hamming + 1;
    for (const Landmark& other : b.landmarks) {
      if ((pixel_of(other) - *predicted).squaredNorm() > reach * reach) continue;
      const int bits = hamming(landmark.keypoint.descriptor, other.keypoint.descriptor);
      if (bits >= fewest) continue;
      fewest = bits;
      found = &other;
    }
    if (found == nullptr) continue;
    const LandmarkPair pair{&landmark, found};
    if (has_moved(pair, config)) out.pairs.push_back(pair);
  }
  return out;
}

}  // namespace

PlaceMatch refine_motion(const CameraModel& camera, const std::vector<LandmarkPair>& pairs,
                         const SE3& T_a_b, double sigma_px, double max_sigmas) {
  constexpr int kIterations = 10;
  // A pair's two reprojections share their keypoints.
  constexpr double kCounted = 2.0;
  PlaceMatch match;
  match.T_a_b = T_a_b;
  MotionEquations equations;
  for (int i = 0; i < kIterations; ++i) {
    const auto good = fitting(camera, pairs, match.T_a_b, sigma_px, max_sigmas);
    match.inliers = static_cast<int>(good.size());
    equations = motion_equations(camera, good, match.T_a_b, sigma_px);
    if (equations.residuals < 6) break;
    const Vec6 step = solve_small(equations.H, equations.b);
    if (!step.allFinite()) break;
    match.T_a_b = SE3::exp(step) * match.T_a_b;
    if (step.norm() < 1e-7) break;
  }
  const double noise =
      equations.residuals > 6 ? equations.energy / (2.0 * equations.residuals - 6.0) : 1.0;
  const MatX inverse = solve_symmetric_columns(equations.H, MatX::Identity(6, 6));
  match.covariance = kCounted * std::max(1.0, noise) * inverse;
  return match;
}

namespace {

/// The motion that most of `pairs` agree on, refined with all that it predicts.
std::optional<PlaceMatch> match_pairs(const CameraModel& camera, const Place& a, const Place& b,
                                      const std::vector<LandmarkPair>& pairs,
                                      const PlaceMatcherConfig& config) {
  constexpr double kReachPx = 6.0;
  if (static_cast<int>(pairs.size()) < config.min_inliers / 2) return std::nullopt;
  const auto motion = find_motion(camera, pairs, config);
  if (!motion) return std::nullopt;
  const PlaceMatch rough = refine_motion(camera, pairs, *motion, config.sigma_px, kRoughSigmas);
  const auto [by_motion, expected] = pair_by_motion(camera, a, b, rough.T_a_b, kReachPx, config);
  PlaceMatch match = refine_motion(camera, by_motion, rough.T_a_b, config.sigma_px, kFineSigmas);
  match.support = static_cast<double>(match.inliers) / std::max(1, expected);
  // A wrong motion finds a pair here and there; a right one most of what it predicts.
  constexpr double kLeastShare = 0.4;
  if (match.inliers < config.min_inliers ||
      match.inliers < kLeastShare * static_cast<double>(by_motion.size()) ||
      !match.covariance.allFinite()) {
    return std::nullopt;
  }
  return match;
}

}  // namespace

std::optional<PlaceMatch> match_places(const CameraModel& camera, const Place& a, const Place& b,
                                       const PlaceMatcherConfig& config) {
  return match_pairs(camera, a, b, pair_by_descriptor(a, b, config), config);
}

std::optional<PlaceMatch> match_places_near(const CameraModel& camera, const Place& a,
                                            const Place& b, const SE3& T_a_b,
                                            const PlaceMatcherConfig& config) {
  constexpr double kReach = 0.06;  // of the image's width
  const PredictedPairs near = pair_by_motion(camera, a, b, T_a_b, kReach * camera.width, config);
  return match_pairs(camera, a, b, near.pairs, config);
}

}  // namespace sovo
