#include "sovo/vo/direct_odometry.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sovo/vo/depth_sigma.h"
#include "sovo/vo/epipolar_search.h"
#include "sovo/vo/keyframe_policy.h"
#include "sovo/vo/keyframe_slopes.h"
#include "sovo/vo/marginalization.h"
#include "sovo/vo/moving_light.h"
#include "sovo/vo/stage_timer.h"
#include "sovo/vo/static_residual.h"
#include "sovo/vo/staying_cells.h"
#include "sovo/vo/view_forecast.h"
#include "sovo/vo/vignette_estimate.h"

namespace sovo {

namespace {

constexpr double kMaxBundleRmse = 30.0;

PixelSelectorConfig selector_config(PixelSelectorConfig config, int seed) {
  config.seed = seed + 1;
  return config;
}

std::unique_ptr<Keyframe> new_keyframe(std::uint32_t id, const MonoFrame& frame,
                                       const SE3& T_world_camera, const Affine& affine,
                                       const WindowConfig& config) {
  auto k = std::make_unique<Keyframe>();
  k->id = id;
  k->stamp_ns = frame.stamp_ns;
  k->exposure_s = frame.exposure_s;
  k->pyramid = frame.pyramid;
  k->vignette = frame.vignette;
  k->shift = frame.shift;
  k->velocity = frame.velocity;
  k->frozen_T_camera_world = T_world_camera.inverse();
  k->frozen_affine = affine;
  k->set_x(Vec8::Zero());
  k->outlier_threshold = kPatternSize * config.outlier_threshold;
  return k;
}

/// And the points that stereo found in the newest keyframe.
std::vector<SeenPoint> with_matched(std::vector<SeenPoint> seen, const Window& window) {
  const std::vector<SeenPoint> matched = matched_points(window);
  seen.insert(seen.end(), matched.begin(), matched.end());
  return seen;
}

/// Narrows an immature point's interval to a proposed depth.
void set_interval(const DepthProposal& depth, double sigmas, ImmaturePoint* p) {
  if (depth.sigma <= 0.0F) return;
  const auto half = static_cast<float>(sigmas) * depth.sigma;
  p->rho_min = std::max(depth.rho - half, 0.0F);
  p->rho_max = depth.rho + half;
  p->static_information = static_cast<float>(information_of_sigma(depth.sigma));
}

Point start_point(const ImmaturePoint& immature, const DepthProposal& depth) {
  Point p = point_of(immature);
  p.rho = std::max(depth.rho, 1e-5F);
  p.hessian = information_of_sigma(depth.sigma);
  p.static_information = static_cast<float>(p.hessian);
  p.last_state = ResidualState::kIn;
  return p;
}

}  // namespace

DirectOdometry::DirectOdometry(const DirectConfig& config, const CameraModel& camera,
                               const ImageU8& mask, int seed, WorkerPool* pool,
                               const LightObservers& light)
    : config_(config),
      camera_(camera),
      mask_(mask),
      pool_(pool),
      num_levels_(
          ImagePyramid::num_levels_for(camera.width, camera.height, config.tracker.max_levels)),
      window_(camera),
      co_moving_(config.co_moving, camera.width, camera.height),
      motion_check_(config.co_moving, camera.width, camera.height),
      exposure_(config.motion_blur),
      light_(light),
      selector_(selector_config(config.selection, seed)),
      activator_(config.points, config.window, pool),
      adjuster_(config.window, pool),
      tracker_(config.tracker) {}

/// Pixels that neither the mask leaves out nor what moves along with the camera.
std::vector<SelectedPixel> DirectOdometry::select_usable(const ImagePyramid& pyramid, int wanted) {
  const ImageU8 narrower = co_moving_.any() ? co_moving_.mask(mask_) : ImageU8();
  const ImageU8& mask = narrower.empty() ? mask_ : narrower;
  std::vector<SelectedPixel> pixels;
  selector_.select(pyramid, mask.empty() ? nullptr : &mask, wanted, &pixels);
  return pixels;
}

ImageU8 DirectOdometry::co_moving_mask() const {
  return co_moving_.any() ? co_moving_.mask({}) : ImageU8();
}

void DirectOdometry::begin(const MonoFrame& frame, const SE3& T_world_camera,
                           const std::vector<StartPoint>& points, const ImagePyramidPtr& right) {
  window_.clear();
  history_.clear();
  marginalized_.clear();
  snapshot_.reset();
  gradient_scatter_ = 1.0;
  past_ = {};
  lasting_share_ = 1.0;
  next_id_ = 0;
  Keyframe& k =
      window_.insert(new_keyframe(next_id_++, frame, T_world_camera, Affine(), config_.window));
  before_sparse_.reset();
  for (const StartPoint& s : points) {
    if (s.pixel.sparse && !before_sparse_) before_sparse_ = {k.points.size(), k.immature.size()};
    ImmaturePoint p;
    if (!make_immature_point(k.image(), s.pixel.x, s.pixel.y, s.pixel.type, config_.points,
                             config_.window.gradient_constant, &p)) {
      continue;
    }
    if (s.depth.sigma > 0.0F) {
      k.points.push_back(start_point(p, s.depth));
    } else {
      k.immature.push_back(p);
    }
  }
  k.points_hosted = static_cast<int>(k.points.size());
  set_right_image(right, &k);
  for (Point& p : k.points) {
    if (k.right) p.static_state = ResidualState::kIn;
  }
  window_.update_geometry();
  history_.record(window_poses());
  publish_reference(active_points(window_), std::nullopt);
}

MapResult DirectOdometry::map(const TrackedFrame& tracked, const KeyframeStereo& stereo,
                              const MapTimer& timer) {
  // The pose hangs on its reference as that is known now.
  const ReferenceKeyframe& reference = *tracked.reference;
  SE3 T_camera_reference = tracked.tracking.T_current_reference;
  T_camera_reference.translation() *= std::exp(log_scale() - reference.log_scale);
  TrackedFrame found = tracked;
  const double rescaled = std::exp(log_scale() - reference.log_scale);
  found.frame.shift.per_row *= rescaled;
  if (!config_.motion_blur.enable) found.frame.velocity.reset();
  if (found.frame.velocity) found.frame.velocity->head<3>() *= rescaled;
  // How fast a map began tells its second frame.
  if (window_.size() == 1 && !window_[0].velocity) window_[0].velocity = found.frame.velocity;
  const SE3 T_world_camera =
      keyframes()[reference.keyframe_id].T_world_camera * T_camera_reference.inverse();
  const bool stale = reference.keyframe_id != window_.newest().id;
  {
    const StageTimer t(timer, MapStage::kTracing);
    trace_all(found.frame, T_world_camera, tracked.affine);
  }
  if (const auto* view = dynamic_cast<const CoMovingView*>(tracked.views.get())) {
    co_moving_.add(view->cells);
    leave_out_co_moving();
    publish_reference(with_matched(active_points(window_), window_), tracked.tracking.rmse);
  } else if (before_sparse_) {
    drop_sparse_points();
  }
  before_sparse_.reset();
  if (tracked.wants_keyframe && !stale) {
    return make_keyframe(found, T_world_camera, stereo, timer);
  }
  MapResult result;
  result.active_points = window_.num_active_points();
  result.keyframes = window_.size();
  result.co_moving_share = co_moving_.share();
  return result;
}

void DirectOdometry::trace_all(const MonoFrame& frame, const SE3& T_world_camera,
                               const Affine& affine) {
  const ImageF& image = frame.pyramid->level(0);
  constexpr int kBlock = 64;
  for (int h = 0; h < window_.size(); ++h) {
    Keyframe& host = window_[h];
    const SE3 T_camera_host = T_world_camera.inverse() * host.T_world_camera();
    HostGeometry geometry =
        host_geometry(camera_, T_camera_host,
                      brightness_transfer(host.affine, host.exposure_s, affine, frame.exposure_s));
    geometry.shift = PairViewShift(T_camera_host, host.shift, frame.shift);
    geometry.K = camera_.matrix().cast<float>();
    geometry.t = T_camera_host.translation().cast<float>();
    const int total = static_cast<int>(host.immature.size());
    pool_->run((total + kBlock - 1) / kBlock, [&](int block) {
      for (int i = block * kBlock; i < std::min(total, (block + 1) * kBlock); ++i) {
        trace(image, geometry, config_.points, &host.immature[static_cast<std::size_t>(i)]);
      }
    });
  }
}

/// Lets the points of the newest keyframe vote in the frame that will be the next one.
void DirectOdometry::find_co_moving(const TrackedFrame& tracked, const SE3& T_world_camera) {
  if (!config_.co_moving.enable) return;
  constexpr double kNearest = 4.0;  // mean inverse depths
  const Keyframe& host = window_.newest();
  const ImageF& image = tracked.frame.pyramid->level(0);
  const HostGeometry geometry = host_geometry(
      camera_, T_world_camera.inverse() * host.T_world_camera(),
      brightness_transfer(host.affine, host.exposure_s, tracked.affine, tracked.frame.exposure_s));
  co_moving_.compare(host.image(), image, tracked.tracking.rmse);
  co_moving_.vote(image, geometry, host.immature,
                  static_cast<float>(kNearest * window_.mean_inverse_depth()),
                  tracked.tracking.rmse);
  leave_out_co_moving();
}

/// What is hidden by things that move along with the camera is out of view.
void DirectOdometry::begin_residuals_in_newest() {
  const Keyframe& newest = window_.newest();
  for (int h = 0; h + 1 < window_.size(); ++h) {
    const PairGeometry& pair = window_.pair(h, window_.size() - 1);
    for (Point& p : window_[h].points) {
      Residual& r = p.residuals[static_cast<std::size_t>(newest.slot)];
      r.state = ResidualState::kIn;
      if (!co_moving_.any()) continue;
      const Eigen::Vector3f at =
          pair.KRKi * Eigen::Vector3f(p.u, p.v, 1.0F) + static_cast<float>(p.rho) * pair.Kt;
      const bool hidden = at.z() > 0.0F && co_moving_.contains(at.x() / at.z(), at.y() / at.z());
      if (hidden) r.state = ResidualState::kOutOfView;
    }
  }
}

/// Takes the points that move along with the camera out of the window.
void DirectOdometry::leave_out_co_moving() {
  if (!co_moving_.any()) return;
  const auto moves_along = [&](const auto& p) { return co_moving_.contains(p.u, p.v); };
  for (int h = 0; h < window_.size(); ++h) {
    Keyframe& host = window_[h];
    for (Point& p : host.points) p.remove = moves_along(p);
    std::erase_if(host.immature, moves_along);
  }
  erase_marked_points(&window_);
}

void DirectOdometry::observe_light() {
  if (light_.vignette == nullptr && light_.moving == nullptr) return;
  find_sights_in_newest(window_, &sights_);
  if (light_.vignette != nullptr) light_.vignette->observe(window_, sights_);
  if (light_.moving != nullptr) light_.moving->observe(camera_, sights_);
}

MapResult DirectOdometry::make_keyframe(const TrackedFrame& tracked, const SE3& T_world_camera,
                                        const KeyframeStereo& stereo, const MapTimer& timer) {
  MapResult result;
  result.is_keyframe = true;
  find_co_moving(tracked, T_world_camera);
  mark_leaving_keyframes(config_.keyframe, &window_);
  Keyframe& k = window_.insert(
      new_keyframe(next_id_++, tracked.frame, T_world_camera, tracked.affine, config_.window));
  window_.update_geometry();
  begin_residuals_in_newest();
  {
    const StageTimer t(timer, MapStage::kBundleAdjustment);
    exposure_.settle(config_.window, &window_);
    activator_.activate(&window_);
    window_.update_scale_held();
    result.bundle = adjuster_.optimize(&window_);
  }
  result.failed =
      !result.bundle.finite || result.bundle.rmse > kMaxBundleRmse || result.bundle.residuals < 100;
  if (result.failed) return result;

  if (!tracked.tracking.motion_denied && !tracked.tracking.rest_denied) observe_light();
  history_.extend_covariance(k.T_world_camera(), result.bundle.newest_covariance);
  gradient_scatter_ = result.bundle.gradient_scatter;
  for (int h = 0; h < window_.size(); ++h) {
    for (Point& p : window_[h].points) {
      p.remove = h + 1 < window_.size() && p.count(ResidualState::kIn) == 0;
    }
  }
  erase_marked_points(&window_);
  // Before points leave, which the frames until the next keyframe see.
  std::vector<SeenPoint> seen = active_points(window_);
  take_snapshot();
  result.left = marginalize(timer);
  add_immature_points(stereo.depths, timer);
  publish_reference(with_matched(std::move(seen), window_), tracked.tracking.rmse);
  window_.newest().T_later_left = stereo.T_later_left;
  set_right_image(stereo.right, &window_.newest());
  history_.record(window_poses());
  result.active_points = window_.num_active_points();
  result.keyframes = window_.size();
  result.co_moving_share = co_moving_.share();
  return result;
}

std::vector<KeyframeState> DirectOdometry::marginalize(const MapTimer& timer) {
  const StageTimer t(timer, MapStage::kMarginalization);
  history_.record(window_poses());  // of those that leave now
  const LeavingPoints leaving = mark_leaving_points(config_.window, &window_);
  const double rho_unit = window_.mean_inverse_depth();
  for (const PointRef& ref : leaving.marginalize) {
    keep_point(*ref.point, rho_unit, &marginalized_[window_[ref.host].id]);
  }
  marginalize_points(config_.window, leaving.marginalize, &window_, pool_);
  erase_marked_points(&window_);
  std::vector<KeyframeState> left;
  for (int i = 0; i < window_.size(); ++i) {
    if (window_[i].leaving) left.push_back(state_without_active_points(window_[i]));
  }
  for (int i = window_.size() - 1; i >= 0; --i) {
    if (window_[i].leaving) marginalize_keyframe(config_.window, i, &window_);
  }
  for (const KeyframeState& k : left) marginalized_.erase(k.id);
  window_.update_geometry();
  return left;
}

void DirectOdometry::keep_point(const Point& point, double rho_unit, KeyframePoints* points) const {
  const double sigma = known_sigma(point, rho_unit);
  if (sigma <= 0.0) return;
  const double to_first_unit = std::exp(log_scale());
  points->u.push_back(point.u);
  points->v.push_back(point.v);
  points->inverse_depth.push_back(static_cast<float>(point.rho * to_first_unit));
  points->sigma.push_back(static_cast<float>(sigma * to_first_unit));
}

KeyframeState DirectOdometry::state_without_active_points(const Keyframe& keyframe) const {
  KeyframeState state{keyframe.id, keyframe.stamp_ns, keyframe.pyramid, {}};
  const auto kept = marginalized_.find(keyframe.id);
  if (kept != marginalized_.end()) state.points = kept->second;
  return state;
}

std::vector<KeyframeState> DirectOdometry::window_keyframes() const {
  std::vector<KeyframeState> states;
  const double rho_unit = window_.mean_inverse_depth();
  for (int i = 0; i < window_.size(); ++i) {
    states.push_back(state_without_active_points(window_[i]));
    for (const Point& p : window_[i].points) keep_point(p, rho_unit, &states.back().points);
  }
  return states;
}

/// Of a camera that drives fast, half of the pixels are out of view in the next keyframe: so many
/// more are selected as left it last time, and those that will leave it are given up.
std::vector<SelectedPixel> DirectOdometry::select_lasting_pixels() {
  const int wanted = config_.points.immature_points;
  const int more = static_cast<int>(wanted / lasting_share_);
  std::vector<SelectedPixel> pixels = select_usable(*window_.newest().pyramid, more);
  lasting_share_ = ViewForecast(window_).keep_lasting(wanted, &pixels);
  return pixels;
}

void DirectOdometry::add_immature_points(const DepthProposer& proposer, const MapTimer& timer) {
  Keyframe& k = window_.newest();
  std::vector<SelectedPixel> pixels;
  {
    const StageTimer t(timer, MapStage::kSelection);
    pixels = select_lasting_pixels();
  }
  std::vector<DepthProposal> proposals(pixels.size());
  if (proposer) {
    const StageTimer t(timer, MapStage::kStaticMatching);
    proposer(pixels, &proposals);
  }
  k.immature.reserve(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    ImmaturePoint p;
    if (!make_immature_point(k.image(), pixels[i].x, pixels[i].y, pixels[i].type, config_.points,
                             config_.window.gradient_constant, &p)) {
      continue;
    }
    set_interval(proposals[i], config_.points.stereo_interval_sigmas, &p);
    k.immature.push_back(p);
  }
  if (config_.points.surface_slopes) find_slopes(&window_);
}

void DirectOdometry::set_right_image(const ImagePyramidPtr& right, Keyframe* keyframe) {
  if (!right || window_.rig() == nullptr) return;
  keyframe->right = right;
  right_brightness_ = fit_right_brightness(*window_.rig(), *keyframe, right_brightness_);
  keyframe->right_brightness = right_brightness_;
}

std::vector<WindowPose> DirectOdometry::window_poses() const {
  std::vector<WindowPose> poses;
  for (int i = 0; i < window_.size(); ++i) {
    const Keyframe& k = window_[i];
    poses.push_back({k.id, k.stamp_ns, k.T_world_camera()});
  }
  return poses;
}

double DirectOdometry::share_of_thresholds(const TrackingReference& reference,
                                           std::optional<double> rmse) const {
  AlignedVector<float> u = reference.levels[0].u;
  AlignedVector<float> v = reference.levels[0].v;
  if (!rmse) {
    // The pixels of a first keyframe that have a depth are those of strong texture.
    for (const ImmaturePoint& p : window_.newest().immature) {
      u.push_back(p.u);
      v.push_back(p.v);
    }
  }
  if (u.empty()) return 1.0;
  return threshold_share(config_.weak_texture, lower_gradient(window_.newest().image(), u, v),
                         config_.tracker.cutoff, rmse.value_or(0.0));
}

void DirectOdometry::publish_reference(std::span<const SeenPoint> points,
                                       std::optional<double> rmse) {
  auto next = std::make_shared<TrackingReference>(
      build_tracking_reference(window_, points, num_levels_, config_.tracker.gradient_constant));
  if (co_moving_.any()) {
    *next = without(*next, co_moving_.cells(), co_moving_.found());
    next->co_moving = co_moving_.found();
  }
  next->log_scale = log_scale();
  next->covariance = history_.covariance();
  next->gradient_scatter = gradient_scatter_;
  next->threshold_share = share_of_thresholds(*next, rmse);
  window_.newest().huber_share = next->threshold_share;
  const std::lock_guard lock(reference_mutex_);
  reference_ = std::move(next);
}

std::shared_ptr<const TrackingReference> DirectOdometry::tracking_reference() const {
  const std::lock_guard lock(reference_mutex_);
  return reference_;
}

void DirectOdometry::take_snapshot() {
  const Keyframe& newest = window_.newest();
  const auto slot = static_cast<std::size_t>(newest.slot);
  KeyframeSnapshot s;
  s.id = newest.id;
  s.stamp_ns = newest.stamp_ns;
  s.scale_epoch = history_.scale_epoch();
  s.log_scale = log_scale();
  s.T_world_camera = newest.T_world_camera();
  s.camera = camera_;
  s.pyramid = newest.pyramid;
  s.mean_inverse_depth = window_.mean_inverse_depth();
  s.points.reserve(static_cast<std::size_t>(window_.num_active_points()));
  std::size_t shared = 0;
  for (int h = 0; h + 1 < window_.size(); ++h) {
    for (Point& p : window_[h].points) {
      const bool was_in = std::exchange(p.in_snapshot, false);
      const Residual& r = p.residuals[slot];
      const double sigma = known_sigma(p, s.mean_inverse_depth);
      if (r.state != ResidualState::kIn || sigma <= 0.0 || r.centre_rho <= 0.0F) continue;
      const double ratio = r.centre_rho / p.rho;
      s.points.u.push_back(r.centre_u);
      s.points.v.push_back(r.centre_v);
      s.points.inverse_depth.push_back(r.centre_rho);
      s.points.sigma.push_back(static_cast<float>(sigma * ratio * ratio));
      p.in_snapshot = true;
      shared += was_in ? 1 : 0;
    }
  }
  if (s.points.size() > 0) {
    s.shared_points = static_cast<double>(shared) / static_cast<double>(s.points.size());
  }
  snapshot_ = std::move(s);
}

double DirectOdometry::apply(const ScaleCorrection& correction) {
  const double log_scale = history_.still_to_apply(correction);
  const double scale = std::exp(log_scale);
  window_.apply_similarity(scale);
  history_.note_similarity(log_scale, correction.first_lock, window_poses());
  auto next = std::make_shared<TrackingReference>(rescaled(*tracking_reference(), scale));
  next->covariance = history_.covariance();
  const std::lock_guard lock(reference_mutex_);
  reference_ = std::move(next);
  return log_scale;
}

}  // namespace sovo
