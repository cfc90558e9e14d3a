#include "sovo/vo/features/feature_odometry.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "sovo/image/corners.h"
#include "sovo/vo/features/reprojection.h"
#include "sovo/vo/stage_timer.h"

namespace sovo {

namespace {

constexpr double kMaxReprojectionRmse = 3.0;  ///< [px]
constexpr int kFewestResiduals = 40;
constexpr int kCornerBorder = AlignmentPatch::kSide / 2 + 1;  ///< Of corners, from the edge [px].

/// Blanks a square of a mask.
void blank(float u, float v, int radius, ImageU8* mask) {
  const int x0 = std::max(0, static_cast<int>(u) - radius);
  const int y0 = std::max(0, static_cast<int>(v) - radius);
  const int x1 = std::min(mask->width() - 1, static_cast<int>(u) + radius);
  const int y1 = std::min(mask->height() - 1, static_cast<int>(v) + radius);
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) mask->at(x, y) = 0;
  }
}

/// Least distance of corners, so that `wanted` of them cover the image [px].
int spacing_for(const CameraModel& camera, int wanted) {
  const double area = static_cast<double>(camera.width) * camera.height;
  return std::max(3, static_cast<int>(0.4 * std::sqrt(area / std::max(1, wanted))));
}

/// The inverse depth that explains a landmark's observations, by Gauss-Newton from `start`; nothing
/// when they do not determine it.
struct TriangulatedDepth {
  bool good = false;
  double rho = 0.0;
};

TriangulatedDepth triangulate(const FeatureWindow& window, const FeatureLandmark& landmark,
                              double start, double outlier_sigmas) {
  TriangulatedDepth out{.rho = start};
  constexpr int kIterations = 8;
  double information = 0.0;
  double worst = 0.0;
  for (int i = 0; i <= kIterations; ++i) {
    double gradient = 0.0;
    information = worst = 0.0;
    for (const Observation& o : landmark.observations) {
      Reprojection p;
      if (!reproject(window.camera, window.T_target_host(o.keyframe_id, landmark.host_id),
                     landmark.ray, out.rho, &p)) {
        return {};
      }
      const Vec2 r = (o.pixel - p.pixel) / o.sigma;
      information += p.d_rho.squaredNorm() / (o.sigma * o.sigma);
      gradient += p.d_rho.dot(r) / o.sigma;
      worst = std::max(worst, r.norm());
    }
    if (!(information > 0.0) || i == kIterations) break;
    out.rho = std::clamp(out.rho + gradient / information, 1e-3 * start, 1e3 * start);
  }
  const double sigma = 1.0 / std::sqrt(information);
  out.good = sigma < 0.5 * kMaxRelativeSigma * out.rho && worst < 2.0 * outlier_sigmas;
  return out;
}

}  // namespace

FeatureOdometry::FeatureOdometry(const FeatureConfig& config, const KeyframeConfig& keyframe,
                                 const CameraModel& camera, const ImageU8& mask, WorkerPool* pool)
    : config_(config),
      keyframe_config_(keyframe),
      camera_(camera),
      mask_(mask),
      adjuster_(config),
      tracker_(config, camera, pool) {
  window_.camera = camera;
}

void FeatureOdometry::use_static_residuals(const StereoRig& /*rig*/, StaticScale /*scale*/) {
  throw std::logic_error("the feature-based odometry has no static residuals");
}

std::vector<SelectedPixel> FeatureOdometry::select_pixels(const MonoFrame& frame, int wanted) {
  window_.landmarks.clear();
  return select_free_corners(frame, wanted);
}

/// Corners away from the landmarks that the newest keyframe sees. Where there is little texture,
/// weak ones are taken, too.
std::vector<SelectedPixel> FeatureOdometry::select_free_corners(const MonoFrame& frame,
                                                                int wanted) {
  ImageU8 free = mask_;
  if (free.empty()) {
    free.resize(camera_.width, camera_.height);
    free.fill(255);
  }
  const int spacing = spacing_for(camera_, config_.features);
  for (const FeatureLandmark& l : window_.landmarks) {
    if (l.host_id == window_.newest().id) {
      blank(l.u, l.v, spacing, &free);
    } else if (const Observation* seen = l.seen_in(window_.newest().id)) {
      blank(static_cast<float>(seen->pixel.x()), static_cast<float>(seen->pixel.y()), spacing,
            &free);
    }
  }
  const ImageF response = corner_response(frame.pyramid->level(0));
  CornerRequest request{.mask = free,
                        .border = kCornerBorder,
                        .wanted = wanted,
                        .least = static_cast<float>(config_.min_corner)};
  std::vector<Corner> corners = spread_corners(response, request);
  double share = 1.0;
  if (2 * corners.size() < static_cast<std::size_t>(wanted)) {
    share = std::sqrt(config_.weak_corner / config_.min_corner);
    request.least = static_cast<float>(config_.weak_corner);
    corners = spread_corners(response, request);
  }
  std::vector<SelectedPixel> pixels;
  for (const Corner& c : corners) {
    SelectedPixel p;
    p.x = static_cast<std::int16_t>(c.x);
    p.y = static_cast<std::int16_t>(c.y);
    p.gradient_squared = c.response;
    p.threshold_share = static_cast<float>(share);
    pixels.push_back(p);
  }
  return pixels;
}

void FeatureOdometry::add_landmark(const SelectedPixel& pixel, const DepthProposal& depth,
                                   const FeatureKeyframe& host) {
  FeatureLandmark l;
  l.host_id = host.id;
  l.u = static_cast<float>(pixel.x);
  l.v = static_cast<float>(pixel.y);
  const bool known = depth.sigma > 0.0F && depth.rho > 0.0F;
  double rho = known ? static_cast<double>(depth.rho) : window_.mean_inverse_depth();
  l.ray = ray_at_instant(camera_, host.shift, l.u, l.v, &rho);
  AlignmentPatch patch;
  if (!make_patch(host.pyramid->level(0), l.u, l.v, kNoWarp, &patch)) return;
  l.id = next_landmark_++;
  if (known) {
    l.has_depth = true;
    l.rho = rho;
    l.static_sigma = depth.sigma;
  }
  window_.landmarks.push_back(std::move(l));
}

void FeatureOdometry::begin(const MonoFrame& frame, const SE3& T_world_camera,
                            const std::vector<StartPoint>& points,
                            const ImagePyramidPtr& /*right*/) {
  window_.keyframes.clear();
  window_.landmarks.clear();
  history_.clear();
  motion_.clear();
  snapshot_.reset();
  last_pyramid_ = frame.pyramid;
  next_keyframe_ = 0;
  window_.keyframes.push_back(
      {next_keyframe_++, frame.stamp_ns, frame.pyramid, T_world_camera.inverse(), frame.shift});
  // What begins a map need not be corners, nor apart: two views give all kinds of pixels.
  std::vector<StartPoint> best = points;
  const ImageF response = corner_response(frame.pyramid->level(0));
  const auto response_at = [&](const StartPoint& p) { return response.at(p.pixel.x, p.pixel.y); };
  std::stable_sort(best.begin(), best.end(), [&](const StartPoint& a, const StartPoint& b) {
    return response_at(a) > response_at(b);
  });
  ImageU8 free(camera_.width, camera_.height);
  free.fill(255);
  const int spacing = spacing_for(camera_, config_.features);
  for (const StartPoint& p : best) {
    if (window_.landmarks.size() >= static_cast<std::size_t>(config_.features)) break;
    if (response_at(p) < static_cast<float>(config_.weak_corner)) break;
    if (free.at(p.pixel.x, p.pixel.y) == 0) continue;
    add_landmark(p.pixel, p.depth, window_.newest());
    blank(p.pixel.x, p.pixel.y, spacing, &free);
  }
  history_.record(window_.poses());
  publish_reference();
}

MapResult FeatureOdometry::map(const TrackedFrame& tracked, const KeyframeStereo& stereo,
                               const MapTimer& timer) {
  MapResult result;
  result.active_points = window_.num_with_depth();
  result.keyframes = static_cast<int>(window_.keyframes.size());
  const bool stale = tracked.reference->keyframe_id != window_.newest().id;
  if (!tracked.wants_keyframe || stale) return result;
  // The pose hangs on its reference as that is known now.
  SE3 T_camera_reference = tracked.tracking.T_current_reference;
  T_camera_reference.translation() *= std::exp(log_scale() - tracked.reference->log_scale);
  result.is_keyframe = true;
  {
    const StageTimer t(timer, MapStage::kBundleAdjustment);
    insert_keyframe(tracked, keyframes()[tracked.reference->keyframe_id].T_world_camera *
                                 T_camera_reference.inverse());
    give_depths();
    result.bundle = adjuster_.optimize(&window_);
  }
  result.failed = !result.bundle.finite || result.bundle.rmse > kMaxReprojectionRmse ||
                  result.bundle.residuals < kFewestResiduals;
  if (result.failed) return result;
  history_.extend_covariance(window_.newest().T_camera_world.inverse(),
                             result.bundle.newest_covariance);
  take_snapshot();
  {
    const StageTimer t(timer, MapStage::kMarginalization);
    history_.record(window_.poses());  // of the one that leaves now
    result.left = drop_oldest();
    drop_unseen();
  }
  add_landmarks(tracked.frame, stereo.depths, timer);
  history_.record(window_.poses());
  publish_reference();
  result.active_points = window_.num_with_depth();
  result.keyframes = static_cast<int>(window_.keyframes.size());
  return result;
}

void FeatureOdometry::insert_keyframe(const TrackedFrame& tracked, const SE3& T_world_camera) {
  const MonoFrame& frame = tracked.frame;
  window_.keyframes.push_back(
      {next_keyframe_++, frame.stamp_ns, frame.pyramid, T_world_camera.inverse(), frame.shift});
  window_.keyframes.back().shift.per_row *= std::exp(log_scale() - tracked.reference->log_scale);
  const auto& views = static_cast<const FeatureViewList&>(*tracked.views).views;
  // Both are in the order of the landmarks' ids.
  auto landmark = window_.landmarks.begin();
  for (const FeatureView& view : views) {
    while (landmark != window_.landmarks.end() && landmark->id < view.id) ++landmark;
    if (landmark == window_.landmarks.end()) break;
    if (landmark->id != view.id) continue;
    landmark->observations.push_back({window_.newest().id, view.pixel, view.sigma, true});
  }
}

/// Landmarks that began without a depth get one as soon as their observations tell it.
void FeatureOdometry::give_depths() {
  const double start = window_.mean_inverse_depth();
  for (FeatureLandmark& l : window_.landmarks) {
    if (l.has_depth || l.observations.empty()) continue;
    const TriangulatedDepth depth = triangulate(window_, l, start, config_.outlier_sigmas);
    if (!depth.good) continue;
    l.has_depth = true;
    l.rho = depth.rho;
  }
}

/// Those that neither the newest keyframe nor a later one will see.
void FeatureOdometry::drop_unseen() {
  const std::uint32_t newest = window_.newest().id;
  for (FeatureLandmark& l : window_.landmarks) {
    const bool lost = !l.has_depth && l.seen_in(newest) == nullptr;
    const bool only_outliers = l.has_depth && !l.observations.empty() && l.num_inliers() == 0;
    l.remove = lost || only_outliers;
  }
  window_.erase_marked();
}

std::vector<KeyframeState> FeatureOdometry::drop_oldest() {
  std::vector<KeyframeState> left;
  while (window_.keyframes.size() > static_cast<std::size_t>(std::max(3, config_.max_keyframes))) {
    left.push_back(window_keyframes().front());
    window_.drop_oldest();
  }
  return left;
}

void FeatureOdometry::add_landmarks(const MonoFrame& frame, const DepthProposer& proposer,
                                    const MapTimer& timer) {
  const std::uint32_t newest = window_.newest().id;
  const auto seen =
      std::count_if(window_.landmarks.begin(), window_.landmarks.end(),
                    [&](const FeatureLandmark& l) { return l.seen_in(newest) != nullptr; });
  const int wanted = config_.features - static_cast<int>(seen);
  std::vector<SelectedPixel> pixels;
  {
    const StageTimer t(timer, MapStage::kSelection);
    pixels = select_free_corners(frame, wanted);
  }
  std::vector<DepthProposal> proposals(pixels.size());
  if (proposer) {
    const StageTimer t(timer, MapStage::kStaticMatching);
    proposer(pixels, &proposals);
  }
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    add_landmark(pixels[i], proposals[i], window_.newest());
  }
}

void FeatureOdometry::publish_reference() {
  const FeatureKeyframe& newest = window_.newest();
  auto next = std::make_shared<FeatureReference>();
  next->keyframe_id = newest.id;
  next->stamp_ns = newest.stamp_ns;
  next->log_scale = log_scale();
  next->T_world_camera = newest.T_camera_world.inverse();
  next->covariance = history_.covariance();
  next->mean_rho = window_.mean_inverse_depth();
  next->keyframe_poses = window_.poses();
  for (const FeatureLandmark& l : window_.landmarks) {
    const Observation* seen = l.seen_in(newest.id);
    ReferenceFeature f;
    f.seen = l.host_id == newest.id || (seen != nullptr && seen->inlier);
    if (!f.seen && !l.has_depth) continue;
    f.id = l.id;
    f.host = window_.keyframe(l.host_id).pyramid;
    f.u = l.u;
    f.v = l.v;
    f.T_reference_host = window_.T_target_host(newest.id, l.host_id);
    f.ray = l.ray;
    f.has_depth = l.has_depth;
    f.rho = l.has_depth ? l.rho : next->mean_rho;
    f.rho_sigma = l.has_depth ? std::min(l.sigma(config_.min_parallax), l.rho) : 0.0;
    Vec2 pixel;
    if (!f.seen && (!reproject(camera_, f.T_reference_host, f.ray, f.rho, &pixel) ||
                    !camera_.contains(pixel))) {
      continue;
    }
    next->features.push_back(std::move(f));
  }
  const std::lock_guard lock(reference_mutex_);
  reference_ = std::move(next);
}

std::shared_ptr<const FeatureReference> FeatureOdometry::tracking_reference() const {
  const std::lock_guard lock(reference_mutex_);
  return reference_;
}

void FeatureOdometry::take_snapshot() {
  const FeatureKeyframe& newest = window_.newest();
  KeyframeSnapshot s;
  s.id = newest.id;
  s.stamp_ns = newest.stamp_ns;
  s.scale_epoch = history_.scale_epoch();
  s.log_scale = log_scale();
  s.T_world_camera = newest.T_camera_world.inverse();
  s.camera = camera_;
  s.pyramid = newest.pyramid;
  s.mean_inverse_depth = window_.mean_inverse_depth();
  std::size_t shared = 0;
  for (FeatureLandmark& l : window_.landmarks) {
    const bool was_in = std::exchange(l.in_snapshot, false);
    const Observation* seen = l.seen_in(newest.id);
    if (!l.has_depth || seen == nullptr || !seen->inlier || !(l.information > 0.0)) continue;
    const double sigma = 1.0 / std::sqrt(l.information);
    Reprojection p;
    if (sigma > kMaxRelativeSigma * l.rho ||
        !reproject(camera_, window_.T_target_host(newest.id, l.host_id), l.ray, l.rho, &p)) {
      continue;
    }
    double rho = l.rho * p.depth_ratio;
    const Vec2 pixel = seen_by_shift(camera_, newest.shift, p.pixel, &rho);
    s.points.u.push_back(static_cast<float>(pixel.x()));
    s.points.v.push_back(static_cast<float>(pixel.y()));
    s.points.inverse_depth.push_back(static_cast<float>(rho));
    s.points.sigma.push_back(static_cast<float>(sigma * p.depth_ratio * p.depth_ratio));
    l.in_snapshot = true;
    shared += was_in ? 1 : 0;
  }
  if (s.points.size() > 0) {
    s.shared_points = static_cast<double>(shared) / static_cast<double>(s.points.size());
  }
  snapshot_ = std::move(s);
}

double FeatureOdometry::apply(const ScaleCorrection& correction) {
  const double log_scale = history_.still_to_apply(correction);
  window_.apply_similarity(std::exp(log_scale));
  history_.note_similarity(log_scale, correction.first_lock, window_.poses());
  publish_reference();
  return log_scale;
}

void FeatureOdometry::keep_point(const FeatureLandmark& landmark, KeyframePoints* points) const {
  if (!landmark.has_depth || !(landmark.information > 0.0)) return;
  const double sigma = 1.0 / std::sqrt(landmark.information);
  if (sigma > kMaxRelativeSigma * landmark.rho) return;
  const double to_first_unit = std::exp(log_scale());
  points->u.push_back(landmark.u);
  points->v.push_back(landmark.v);
  points->inverse_depth.push_back(static_cast<float>(landmark.rho * to_first_unit));
  points->sigma.push_back(static_cast<float>(sigma * to_first_unit));
}

std::vector<KeyframeState> FeatureOdometry::window_keyframes() const {
  std::vector<KeyframeState> states;
  for (const FeatureKeyframe& k : window_.keyframes) {
    states.push_back({k.id, k.stamp_ns, k.pyramid, {}});
    for (const FeatureLandmark& l : window_.landmarks) {
      if (l.host_id == k.id) keep_point(l, &states.back().points);
    }
  }
  return states;
}

}  // namespace sovo
