#include "sovo/vo/features/feature_tracker.h"

#include <algorithm>
#include <cmath>

#include "sovo/vo/features/reprojection.h"

namespace sovo {

namespace {

constexpr int kBlock = 32;  ///< Features that one thread follows at a time.

/// Of the pyramid, where the pose is known.
constexpr int kLevelsNearby = 2;

double sigma_of(const PatchMatch& match, double sigma_px) {
  return sigma_px * static_cast<double>(1 << match.finest_level);
}

}  // namespace

std::vector<PatchMatch> FeatureTracker::follow(const FeatureReference& reference,
                                               const MonoFrame& frame,
                                               const SE3& T_current_reference,
                                               const std::vector<bool>& wanted, int levels) const {
  const PatchAlignmentConfig alignment{.levels = levels,
                                       .max_iterations = config_.max_iterations,
                                       .min_zncc = static_cast<float>(config_.min_zncc)};
  const int total = static_cast<int>(reference.features.size());
  std::vector<PatchMatch> matches(reference.features.size());
  pool_->run((total + kBlock - 1) / kBlock, [&](int block) {
    const auto end = static_cast<std::size_t>(std::min(total, (block + 1) * kBlock));
    for (auto i = static_cast<std::size_t>(block) * kBlock; i < end; ++i) {
      if (!wanted[i]) continue;
      const ReferenceFeature& f = reference.features[i];
      const SE3 T = T_current_reference * f.T_reference_host;
      Vec2 pixel;
      if (!reproject(camera_, T, f.ray, f.rho, &pixel)) continue;
      const Vec2 by_row = shift_displacement(frame.shift, T, f, pixel);
      pixel += by_row;
      if (!camera_.contains(pixel)) continue;
      const Mat2 A = surroundings(camera_, T, f.ray, f.rho);
      const PatchWarp warp{static_cast<float>(A(0, 0)), static_cast<float>(A(0, 1)),
                           static_cast<float>(A(1, 0)), static_cast<float>(A(1, 1))};
      matches[i] =
          find_patch({f.host.get(), f.u, f.v}, *frame.pyramid, warp, static_cast<float>(pixel.x()),
                     static_cast<float>(pixel.y()), alignment);
      // Where it would be seen at the image's instant.
      matches[i].u -= static_cast<float>(by_row.x());
      matches[i].v -= static_cast<float>(by_row.y());
    }
  });
  return matches;
}

/// From where a landmark is at a frame's instant, by its centre, to where it is seen.
Vec2 FeatureTracker::shift_displacement(const ViewShift& shift, const SE3& T_current_host,
                                        const ReferenceFeature& feature, const Vec2& pixel) const {
  if (shift.none()) return Vec2::Zero();
  const Vec3 q =
      T_current_host.rotation() * feature.ray + feature.rho * T_current_host.translation();
  double rho = feature.rho / q.z();
  return seen_by_shift(camera_, shift, pixel, &rho) - pixel;
}

FeaturePose FeatureTracker::pose_of(const FeatureReference& reference,
                                    const std::vector<PatchMatch>& matches,
                                    const SE3& start) const {
  std::vector<FeatureMatch> known;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const ReferenceFeature& f = reference.features[i];
    if (!matches[i].found || !f.has_depth) continue;
    known.push_back({f.T_reference_host, f.ray, f.rho, f.rho_sigma,
                     Vec2(matches[i].u, matches[i].v), sigma_of(matches[i], config_.sigma_px)});
    index.push_back(i);
  }
  FeaturePose pose = estimate_pose(camera_, known, start, config_.outlier_sigmas);
  std::vector<bool> inlier(matches.size(), false);
  for (std::size_t k = 0; k < index.size(); ++k) inlier[index[k]] = pose.inlier[k];
  pose.inlier = std::move(inlier);
  return pose;
}

bool FeatureTracker::is_in_view(const SE3& T_current_reference, const ReferenceFeature& f) const {
  Vec2 pixel;
  return reproject(camera_, T_current_reference * f.T_reference_host, f.ray, f.rho, &pixel) &&
         camera_.contains(pixel, AlignmentPatch::kReach);
}

FeatureTracking FeatureTracker::track(const FeatureReference& reference, const MonoFrame& frame,
                                      const SE3& expected, int levels) const {
  const std::size_t n = reference.features.size();
  std::vector<bool> wanted(n);
  for (std::size_t i = 0; i < n; ++i) wanted[i] = reference.features[i].seen;
  std::vector<PatchMatch> matches = follow(reference, frame, expected, wanted, levels);
  FeaturePose pose = pose_of(reference, matches, expected);
  for (std::size_t i = 0; i < n; ++i) {
    const ReferenceFeature& f = reference.features[i];
    wanted[i] = f.seen && !(f.has_depth ? pose.inlier[i] : matches[i].found);
  }
  const std::vector<PatchMatch> second =
      follow(reference, frame, pose.T_current_reference, wanted, kLevelsNearby);
  for (std::size_t i = 0; i < n; ++i) {
    if (wanted[i]) matches[i] = second[i];
  }
  pose = pose_of(reference, matches, pose.T_current_reference);

  FeatureTracking out;
  out.views = std::make_shared<FeatureViewList>();
  int in_view = 0;
  int seen = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const ReferenceFeature& f = reference.features[i];
    if (!f.seen) continue;
    ++seen;
    in_view += f.has_depth && is_in_view(pose.T_current_reference, f) ? 1 : 0;
    if (!(f.has_depth ? pose.inlier[i] : matches[i].found)) continue;
    out.views->views.push_back(
        {f.id, Vec2(matches[i].u, matches[i].v), sigma_of(matches[i], config_.sigma_px)});
  }
  const auto followed = static_cast<double>(out.views->views.size());
  out.followed = seen > 0 ? followed / seen : 0.0;
  out.covariance = pose.covariance;
  FrameTracking& t = out.tracking;
  t.T_current_reference = pose.T_current_reference;
  t.inliers = pose.inliers;
  t.rmse = pose.rmse;
  t.inlier_ratio = in_view > 0 ? static_cast<double>(pose.inliers) / in_view : 0.0;
  t.good = t.inliers >= config_.min_inliers && t.inlier_ratio >= config_.min_inlier_ratio;
  return out;
}

SE3 FeatureTracker::best_of(const FeatureReference& reference, const MonoFrame& frame,
                            const std::vector<SE3>& motions) const {
  constexpr std::size_t kFew = 100;
  std::vector<bool> wanted(reference.features.size(), false);
  const std::size_t stride = std::max<std::size_t>(1, wanted.size() / kFew);
  for (std::size_t i = 0; i < wanted.size(); i += stride) {
    wanted[i] = reference.features[i].seen && reference.features[i].has_depth;
  }
  SE3 best;
  int most = -1;
  for (const SE3& motion : motions) {
    const FeaturePose pose =
        pose_of(reference, follow(reference, frame, motion, wanted, config_.levels), motion);
    if (pose.inliers <= most) continue;
    most = pose.inliers;
    best = pose.T_current_reference;
  }
  return best;
}

void FeatureTracker::find_unseen(const FeatureReference& reference, const MonoFrame& frame,
                                 FeatureTracking* tracked) const {
  const SE3& T = tracked->tracking.T_current_reference;
  std::vector<bool> wanted;
  for (const ReferenceFeature& f : reference.features) wanted.push_back(!f.seen);
  const std::vector<PatchMatch> matches = follow(reference, frame, T, wanted, kLevelsNearby);
  std::vector<FeatureView>& views = tracked->views->views;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const ReferenceFeature& f = reference.features[i];
    const PatchMatch& m = matches[i];
    Reprojection at;
    if (!m.found || !reproject(camera_, T * f.T_reference_host, f.ray, f.rho, &at)) continue;
    const double sigma = sigma_of(m, config_.sigma_px);
    const double expected = std::hypot(sigma, f.rho_sigma * at.d_rho.norm());
    const Vec2 pixel(m.u, m.v);
    if ((pixel - at.pixel).norm() < config_.outlier_sigmas * expected) {
      views.push_back({f.id, pixel, sigma});
    }
  }
  std::sort(views.begin(), views.end(),
            [](const FeatureView& a, const FeatureView& b) { return a.id < b.id; });
}

}  // namespace sovo
